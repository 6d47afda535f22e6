"""Compiled plans for tests: of the library, each once in a run, and what their curves say."""

from functools import cache

import numpy as np

from go2_wbc.robot.model import RobotModel
from motions import CompiledPlan, Timeline, compile_timeline, load_motion

MODEL = RobotModel()


@cache
def library_plan(name: str) -> CompiledPlan:
    """The motion ``name`` with its usual parameters, compiled for ``MODEL``."""
    return compile_timeline(load_motion(name), MODEL)


def plan_of(line: Timeline) -> CompiledPlan:
    """``line`` compiled for ``MODEL``."""
    return compile_timeline(line, MODEL)


def curves_at(plan: CompiledPlan, t: float) -> np.ndarray:
    """Values, rates and accelerations of all curves (3, 30), by SciPy; the ends are held."""
    inside = min(max(t, 0.0), plan.duration)
    return np.array(
        [plan.curves(inside, order) * (order == 0 or inside == t) for order in range(3)]
    )
