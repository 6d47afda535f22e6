"""Motions: postures, the library, and whether the robot can do them."""

from __future__ import annotations

from collections.abc import Callable

from go2_wbc.errors import CommandError, unknown_name
from go2_wbc.legs import Leg
from go2_wbc.reference import MotionPlan
from go2_wbc.robot.model import RobotModel
from motions.feasibility import Finding, check_plan
from motions.high_five import HighFivePlan, high_five_plan

__all__ = [
    "Finding",
    "HighFivePlan",
    "check_plan",
    "high_five_plan",
    "load_motion",
    "motion_names",
]

_LIBRARY: dict[str, Callable[[RobotModel], MotionPlan]] = {
    "high_five": lambda model: high_five_plan(model, Leg.FR),
    "high_five_left": lambda model: high_five_plan(model, Leg.FL),
}


def motion_names() -> tuple[str, ...]:
    """Names of the motions in the library."""
    return tuple(sorted(_LIBRARY))


def load_motion(name: str, model: RobotModel) -> MotionPlan:
    """The plan of a motion of the library.

    Raises:
        CommandError: for an unknown name; lists the valid ones.
    """
    if name not in _LIBRARY:
        raise CommandError(unknown_name("motion", name, _LIBRARY))
    return _LIBRARY[name](model)
