"""Dynamic motions from their phases."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pinocchio as pin

from go2_wbc.errors import MissingDependency, PlanNotFound
from go2_wbc.legs import FOOT_NAMES, LEGS
from go2_wbc.robot.model import RobotModel
from go2_wbc.robot.rotations import rotation_from_rpy
from motions.dynamics.knots import Knots, feet_at, knots_of
from motions.dynamics.limits import PlanLimits, Weights
from motions.dynamics.phases import PhaseProblem
from motions.dynamics.trajectory import DynamicTrajectory, Miss
from motions.dynamics.verdict import audit

INSTALL_LINE = "pip install go2-wbc[dynamics]"
BUDGET = 20.0
"""Time [s] that solving may take."""


def solve(
    problem: PhaseProblem,
    model: RobotModel,
    *,
    budget: float = BUDGET,
    progress: Callable[[int, float], None] | None = None,
    limits: PlanLimits | None = None,
    weights: Weights | None = None,
) -> DynamicTrajectory:
    """The motion that does what the phases ask, within what the robot can do.

    Box-constrained feasibility-driven differential dynamic programming (Mastalli et al. 2022). The
    result depends on the arguments only; the time, on whether there is one.

    Args:
        problem: what is asked.
        model: the robot.
        budget: time [s] after which to give up.
        progress: called after every iteration with their number and the cost.
        limits: what the plan keeps.
        weights: what being off costs.

    Raises:
        MissingDependency: if crocoddyl is not installed.
        PlanNotFound: if no plan is found in time, or the best one breaks a limit or is farther from
            what was asked than the problem's tolerance; says what binds, and where.
    """
    require_crocoddyl()
    from motions.dynamics.program import Program
    from motions.dynamics.search import Search

    limits = limits or PlanLimits()
    knots = knots_of(problem, model, limits)
    weights = weights or Weights()
    soft = Program(knots, model, limits, weights.softened())
    full = Program(knots, model, limits, weights)
    found = Search(soft, full, knots, budget=budget, progress=progress).run()
    q = found.x[:, :19]
    p_feet = feet_at(model, q)
    trajectory = DynamicTrajectory(
        times=knots.times,
        q=q,
        v=found.x[:, 19:],
        tau=found.tau,
        forces=found.forces,
        stance=knots.stance,
        gains=found.gains,
        p_feet=p_feet,
        iterations=found.iterations,
        cost=found.cost,
        misses=_misses(knots, q, p_feet),
    )
    accept(trajectory, problem, model)
    return trajectory


def require_crocoddyl() -> None:
    """Raise MissingDependency unless crocoddyl can be imported."""
    try:
        import crocoddyl  # noqa: F401
    except ImportError as error:
        raise MissingDependency(
            f"dynamic motions are solved with crocoddyl, which cannot be imported ({error}): "
            f"{INSTALL_LINE}"
        ) from error


def _misses(knots: Knots, q: np.ndarray, p_feet: np.ndarray) -> tuple[Miss, ...]:
    misses = []
    for goal in knots.goals:
        time = float(knots.times[goal.knot])
        if goal.pose is not None:
            R = pin.Quaternion(q[goal.knot, 3:7]).toRotationMatrix()
            off = pin.log3(rotation_from_rpy(*goal.pose[3:].tolist()).T @ R)
            place = float(np.linalg.norm(q[goal.knot, :3] - goal.pose[:3]))
            misses.append(Miss("trunk", goal.label, time, place, float(np.linalg.norm(off))))
        for leg in LEGS:
            if goal.asked[leg]:
                off = np.linalg.norm(p_feet[goal.knot, leg] - goal.p_feet[leg])
                misses.append(Miss(FOOT_NAMES[leg], goal.label, time, float(off), 0.0))
    return tuple(misses)


def accept(trajectory: DynamicTrajectory, problem: PhaseProblem, model: RobotModel) -> None:
    """Raise PlanNotFound for a plan that breaks a limit or is too far off."""
    reasons = [str(reading) for reading in audit(trajectory, model) if not reading.is_kept]
    if reasons:
        raise PlanNotFound("no dynamic plan: the best one breaks what the robot can do", reasons)
    tolerance = problem.tolerance
    far = [
        str(miss)
        for miss in trajectory.misses
        if miss.position > tolerance.position or miss.angle > tolerance.angle
    ]
    if far:
        raise PlanNotFound(
            f"no dynamic plan within {1e3 * tolerance.position:.0f} mm and "
            f"{np.degrees(tolerance.angle):.0f} deg of the phases; the nearest one is off:",
            far,
        )
