"""Motions: written in Python, checked without simulation, played by ``GO2Controller``."""

from motions.authoring import Choice, Motion, Range, motion
from motions.compiler import CompiledPlan, compile_timeline
from motions.feasibility import FeasibilityChecker, FeasibilityReport, Finding, Rehearsal, check
from motions.registry import find_motion, load_file, load_motion, motion_names
from motions.timeline import Timeline, deg

__all__ = [
    "Choice",
    "CompiledPlan",
    "FeasibilityChecker",
    "FeasibilityReport",
    "Finding",
    "Motion",
    "Range",
    "Rehearsal",
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
