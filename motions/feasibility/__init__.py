"""Feasibility: whether the robot can do a motion, told without simulating it."""

from go2_wbc.feasibility_limits import FeasibilityLimits
from motions.feasibility.check import FeasibilityChecker, check
from motions.feasibility.checked_motion import CheckedMotion, Playable, compile_motion
from motions.feasibility.goal_errors import Departure
from motions.feasibility.report import FeasibilityReport, Finding, Series
from motions.feasibility.suggestions import Suggestion, suggest

__all__ = [
    "CheckedMotion",
    "Departure",
    "FeasibilityChecker",
    "FeasibilityLimits",
    "FeasibilityReport",
    "Finding",
    "Playable",
    "Series",
    "Suggestion",
    "check",
    "compile_motion",
    "suggest",
]
