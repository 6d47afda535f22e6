"""The nearest motion that the robot can do, of one that it cannot do as it is written."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from jaxtyping import Float

from go2_wbc.robot.model import RobotModel
from motions.compiled_plan import CompiledPlan
from motions.dynamics.cache import nearest_cached
from motions.dynamics.nearest import Written
from motions.dynamics.phases import Tolerance
from motions.dynamics.trajectory import DynamicTrajectory
from motions.feasibility.report import FeasibilityReport
from motions.mending import Mend

Progress = Callable[[int, float], None]


def mending(
    check: Callable[[CompiledPlan], FeasibilityReport],
    model: RobotModel,
    tolerance: Tolerance,
    progress: Progress | None = None,
) -> Mend:
    """Solves what ``check`` finds infeasible, within ``tolerance``."""

    def broken(plan: CompiledPlan) -> Float[np.ndarray, " k"]:
        report = check(plan)
        found = [
            one.times[(one.margins < 0.0).any(axis=1)] for one in report.series
        ]  # nan, nothing to check, is not below 0
        return np.concatenate([[], *found])

    def solve(written: Written) -> DynamicTrajectory:
        return nearest_cached(written, model, tolerance=tolerance, progress=progress)

    return Mend(broken, solve)
