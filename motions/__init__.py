"""Motions: written in Python, checked without simulation, played by ``GO2Controller``."""

from __future__ import annotations

from typing import TYPE_CHECKING

from go2_wbc.lazy import lazy_exports

if TYPE_CHECKING:
    from go2_wbc.motion_plan import Posture
    from motions.authoring import Choice, Motion, Range, motion
    from motions.dynamics.phases import Tolerance
    from motions.feasibility.check import (
        CheckedMotion,
        FeasibilityChecker,
        Playable,
        check,
        compile_motion,
    )
    from motions.feasibility.report import FeasibilityReport, Finding
    from motions.feasibility.suggestions import Suggestion, suggest
    from motions.language.timeline import Timeline, deg
    from motions.music.beat_tracking import Beats, beats
    from motions.plan.compiled_plan import CompiledPlan
    from motions.plan.timeline_compiler import compile_timeline
    from motions.registry import find_motion, load_file, load_motion, motion_names
    from motions.saved.files import load_plan, save_motion, save_plan

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
    "Posture",
    "Range",
    "Suggestion",
    "Timeline",
    "Tolerance",
    "beats",
    "check",
    "compile_motion",
    "compile_timeline",
    "deg",
    "find_motion",
    "load_file",
    "load_motion",
    "load_plan",
    "motion",
    "motion_names",
    "save_motion",
    "save_plan",
    "suggest",
]

__getattr__ = lazy_exports(__name__)
