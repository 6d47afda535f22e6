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
from collections.abc import Iterable, Mapping
from dataclasses import dataclass

from packaging.requirements import Requirement
from packaging.specifiers import SpecifierSet

PROJECT = "go2-wbc"
IMPORT_TIME_LIMIT = 60.0
"""Seconds after which an import counts as hung; the slowest takes 1 s on a laptop."""

_PROBE = """
import importlib, json, sys
module = importlib.import_module(sys.argv[1])
solvers = getattr(module, "available_solvers", [])
print(json.dumps({"file": getattr(module, "__file__", None) or "", "solvers": solvers}))
"""


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


def probe_imports(modules: Iterable[str]) -> dict[str, ImportProbe]:
    """Import each module in a process of its own, all at the same time."""
    running = {
        name: subprocess.Popen(
            [sys.executable, "-P", "-c", _PROBE, name],
            stdin=subprocess.DEVNULL,
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
            text=True,
        )
        for name in modules
    }
    return {name: _result(process) for name, process in running.items()}


def _result(process: subprocess.Popen[str]) -> ImportProbe:
    try:
        out, complaint = process.communicate(timeout=IMPORT_TIME_LIMIT)
    except subprocess.TimeoutExpired:
        process.kill()
        process.communicate()
        return ImportProbe(error=f"the import did not end within {IMPORT_TIME_LIMIT:g} s")
    if process.returncode < 0:
        return ImportProbe(error=f"the import crashed ({_signal_name(-process.returncode)})")
    lines = complaint.strip().splitlines()
    if process.returncode > 0:
        return ImportProbe(error=lines[-1] if lines else f"exit code {process.returncode}")
    answer = json.loads(out.splitlines()[-1])
    return ImportProbe(file=answer["file"], solvers=tuple(answer["solvers"]))


def _signal_name(number: int) -> str:
    try:
        return signal.Signals(number).name
    except ValueError:
        return f"signal {number}"


def installed_version(distribution: str) -> str | None:
    """Version of an installed package; ``None`` if it is not installed."""
    try:
        return importlib.metadata.version(distribution)
    except importlib.metadata.PackageNotFoundError:
        return None


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
