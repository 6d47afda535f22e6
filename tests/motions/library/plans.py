"""The library's motions as compiled plans, each compiled once in a run of tests."""

from __future__ import annotations

from functools import cache

from go2_wbc.robot.model import RobotModel
from motions import CompiledPlan, compile_timeline, load_motion

MODEL = RobotModel()


@cache
def library_plan(name: str) -> CompiledPlan:
    """The motion ``name`` with its usual parameters, compiled for ``MODEL``."""
    return compile_timeline(load_motion(name), MODEL)
