"""Feasibility: whether the robot can do a motion, told without simulating it."""

from motions.feasibility.check import FeasibilityChecker, check
from motions.feasibility.limits import FeasibilityLimits
from motions.feasibility.rehearsal import Rehearsal
from motions.feasibility.report import FeasibilityReport, Finding, Series

__all__ = [
    "FeasibilityChecker",
    "FeasibilityLimits",
    "FeasibilityReport",
    "Finding",
    "Rehearsal",
    "Series",
    "check",
]
