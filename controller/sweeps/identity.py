"""What results depend on besides seeds: code, libraries, Python. Needs no version control."""

from __future__ import annotations

import hashlib
import importlib.metadata
import platform
from collections.abc import Sequence
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
SOURCES = ("go2_wbc", "motions", "controller")
"""Packages whose code decides what a run gives."""
LIBRARIES = ("mujoco", "pin", "placo", "proxsuite", "numpy")
_SHOWN = 12
"""Digits of a digest that are kept."""


def digest(content: bytes) -> str:
    """A short name for ``content``, which nothing else has."""
    return hashlib.sha256(content).hexdigest()[:_SHOWN]


def code_digest(root: Path = ROOT, packages: Sequence[str] = SOURCES) -> str:
    """A short name for the code of the packages in ``root``."""
    code = hashlib.sha256()
    for file in sorted(file for name in packages for file in (root / name).rglob("*.py")):
        code.update(file.relative_to(root).as_posix().encode() + b"\0" + file.read_bytes())
    return code.hexdigest()[:_SHOWN]


def identity(root: Path = ROOT, packages: Sequence[str] = SOURCES) -> dict[str, str]:
    """What results depend on besides what was run: two runs that agree in it give equal rows."""
    return {
        "version": importlib.metadata.version("go2-wbc"),
        "python": platform.python_version(),
        "libraries": ", ".join(f"{n} {importlib.metadata.version(n)}" for n in LIBRARIES),
        "code": code_digest(root, packages),
    }
