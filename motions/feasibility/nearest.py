"""The nearest motion that the robot can do, of one that it cannot do as it is written."""

from __future__ import annotations

from collections.abc import Callable

from go2_wbc.errors import PlanNotFound, TimelineError
from go2_wbc.robot.model import RobotModel
from motions.assembly import Mend
from motions.compiled_plan import CompiledPlan
from motions.dynamics.cache import nearest_cached
from motions.dynamics.nearest import Written
from motions.dynamics.phases import Tolerance
from motions.dynamics.trajectory import DynamicTrajectory
from motions.feasibility.checked_motion import CheckedMotion


def mending(
    evaluate: Callable[[CompiledPlan], CheckedMotion], model: RobotModel, tolerance: Tolerance
) -> Mend:
    """Solves what ``evaluate`` finds infeasible, within ``tolerance``."""

    def mend(plan: CompiledPlan) -> tuple[Written, DynamicTrajectory] | None:
        checked = evaluate(plan)
        if checked.report.ok:
            return None
        path = checked.path
        try:
            written = Written(path.times, path.q, path.stance)
        except TimelineError as error:
            raise PlanNotFound("there is no nearest motion", [str(error)]) from error
        return written, nearest_cached(written, model, tolerance=tolerance)

    return mend
