"""Motions: written in Python, checked without simulation, played by ``GO2Controller``."""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from motions.authoring import Choice, Motion, Range, motion
    from motions.compiler import CompiledPlan, compile_timeline
    from motions.feasibility import (
        CheckedMotion,
        FeasibilityChecker,
        FeasibilityReport,
        Finding,
        check,
    )
    from motions.registry import find_motion, load_file, load_motion, motion_names
    from motions.timeline import Timeline, deg

__all__ = [
    "CheckedMotion",
    "Choice",
    "CompiledPlan",
    "FeasibilityChecker",
    "FeasibilityReport",
    "Finding",
    "Motion",
    "Range",
    "Timeline",
    "check",
    "compile_timeline",
    "deg",
    "find_motion",
    "load_file",
    "load_motion",
    "motion",
    "motion_names",
]

_HOMES = {
    "authoring": ("Choice", "Motion", "Range", "motion"),
    "compiler": ("CompiledPlan", "compile_timeline"),
    "feasibility": ("FeasibilityChecker", "FeasibilityReport", "Finding", "CheckedMotion", "check"),
    "registry": ("find_motion", "load_file", "load_motion", "motion_names"),
    "timeline": ("Timeline", "deg"),
}
"""The module of every public name."""


def __getattr__(name: str) -> object:
    """Import the heavy parts when first asked for: the pytest plugin lies in this package."""
    for home, names in _HOMES.items():
        if name in names:
            return getattr(import_module(f"motions.{home}"), name)
    raise AttributeError(f"module 'motions' has no attribute {name!r}")
