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
from motions.feasibility.report import FeasibilityReport, Series
from motions.mending import Mend

Progress = Callable[[int, float], None]
SUMS = ("slip",)
"""Checks whose values add up: what was too much stays so, but is wrong only while it grows."""
GROWTH = 5e-5
"""By how much [m] at least from one sample to the next: less is the creep of any movement."""


def mending(
    check: Callable[[CompiledPlan], FeasibilityReport],
    model: RobotModel,
    tolerance: Tolerance,
    progress: Progress | None = None,
) -> Mend:
    """Solves what ``check`` finds infeasible, within ``tolerance``."""

    def broken(plan: CompiledPlan) -> Float[np.ndarray, " k"]:
        return np.concatenate([[], *(_broken(one) for one in check(plan).series)])

    def solve(written: Written) -> DynamicTrajectory:
        return nearest_cached(written, model, tolerance=tolerance, progress=progress)

    return Mend(broken, solve)


def _broken(series: Series) -> Float[np.ndarray, " k"]:
    """Instants [s] at which a limit is broken; nan, nothing to check, breaks none."""
    is_below = series.margins < 0.0
    if series.check in SUMS:
        before = np.vstack([np.full((1, series.margins.shape[1]), np.inf), series.margins[:-1]])
        is_below &= ~(series.margins >= before - GROWTH)
    return series.times[is_below.any(axis=1)]
