"""Motions: written in Python, checked without simulation, played by ``GO2Controller``."""

from __future__ import annotations

from typing import TYPE_CHECKING

from go2_wbc.lazy import lazy_exports

if TYPE_CHECKING:
    from motions.authoring import Choice, Motion, Range, motion
    from motions.compiler import CompiledPlan, compile_timeline
    from motions.feasibility import (
        CheckedMotion,
        FeasibilityChecker,
        FeasibilityReport,
        Finding,
        Playable,
        check,
        compile_motion,
    )
    from motions.music.finding import Beats, beats
    from motions.registry import find_motion, load_file, load_motion, motion_names
    from motions.timeline import Timeline, deg

__all__ = [
    "Beats",
    "CheckedMotion",
    "Choice",
    "CompiledPlan",
    "FeasibilityChecker",
    "FeasibilityReport",
    "Finding",
    "Motion",
    "Playable",
    "Range",
    "Timeline",
    "beats",
    "check",
    "compile_motion",
    "compile_timeline",
    "deg",
    "find_motion",
    "load_file",
    "load_motion",
    "motion",
    "motion_names",
]

__getattr__ = lazy_exports(
    __name__,
    {
        "authoring": ("Choice", "Motion", "Range", "motion"),
        "compiler": ("CompiledPlan", "compile_timeline"),
        "feasibility": (
            "CheckedMotion",
            "FeasibilityChecker",
            "FeasibilityReport",
            "Finding",
            "Playable",
            "check",
            "compile_motion",
        ),
        "music.finding": ("Beats", "beats"),
        "registry": ("find_motion", "load_file", "load_motion", "motion_names"),
        "timeline": ("Timeline", "deg"),
    },
)
