"""What ``doctor`` asks the machine: installed versions, and whether a library really imports.

Imports are tried in processes of their own, so that a library that crashes the interpreter, or
takes the wrong shared object with it, is a finding and not the end of the program.
"""

from __future__ import annotations

import importlib.metadata
import json
import signal
import subprocess
import sys
from collections.abc import Collection, Iterable, Mapping
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass

from packaging.requirements import Requirement
from packaging.specifiers import SpecifierSet

IMPORT_TIME_LIMIT = 60.0
"""Seconds after which an import counts as hung; the slowest takes 1 s on a laptop."""

_PROBE = """
import importlib, json, sys
module = importlib.import_module(sys.argv[1])
solvers = getattr(module, "available_solvers", [])
print(json.dumps({"file": getattr(module, "__file__", None) or "", "solvers": solvers}))
"""
_SIGNALS = {number.value: number.name for number in signal.Signals}


@dataclass(frozen=True, slots=True)
class ImportProbe:
    """How the import of a module went.

    Attributes:
        error: why it failed, in one line; empty if it worked.
        file: the file that was imported.
        solvers: the QP solvers that the module offers, if it is ``qpsolvers``.
    """

    error: str = ""
    file: str = ""
    solvers: tuple[str, ...] = ()


def probe_imports(modules: Collection[str]) -> dict[str, ImportProbe]:
    """Import each module in a process of its own, all at the same time."""
    with ThreadPoolExecutor(max(len(modules), 1)) as pool:
        return dict(zip(modules, pool.map(_probe, modules), strict=True))


def _probe(module: str) -> ImportProbe:
    command = [sys.executable, "-P", "-c", _PROBE, module]
    try:
        done = subprocess.run(
            command,
            stdin=subprocess.DEVNULL,
            capture_output=True,
            text=True,
            timeout=IMPORT_TIME_LIMIT,
            check=False,
        )
    except subprocess.TimeoutExpired:
        return ImportProbe(error=f"the import did not end within {IMPORT_TIME_LIMIT:g} s")
    if done.returncode < 0:
        name = _SIGNALS.get(-done.returncode, f"signal {-done.returncode}")
        return ImportProbe(error=f"the import crashed ({name})")
    if done.returncode > 0:
        lines = done.stderr.strip().splitlines() or [f"exit code {done.returncode}"]
        return ImportProbe(error=lines[-1])
    answer = json.loads(done.stdout.splitlines()[-1])
    return ImportProbe(file=answer["file"], solvers=tuple(answer["solvers"]))


def requirements_of(distribution: str) -> Mapping[str, str]:
    """Version bounds that a package puts on its dependencies, by name, without its extras.

    Empty for a package that is not installed.
    """
    try:
        rows = importlib.metadata.requires(distribution) or []
    except importlib.metadata.PackageNotFoundError:
        return {}
    return parse_requirements(rows)


def parse_requirements(rows: Iterable[str]) -> dict[str, str]:
    """``["placo<0.11,>=0.10.2", ...]`` as ``{"placo": "<0.11,>=0.10.2", ...}``, without extras."""
    found = [Requirement(row) for row in rows]
    return {
        item.name: str(item.specifier)
        for item in found
        if item.marker is None or item.marker.evaluate({"extra": ""})
    }


def satisfies(version: str, bounds: str) -> bool:
    """Whether ``version``, pre-releases included, lies within ``bounds`` (PEP 440)."""
    return SpecifierSet(bounds).contains(version, prereleases=True)
