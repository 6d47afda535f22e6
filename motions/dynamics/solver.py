"""Dynamic motions from their phases.

Likewise the motion nearest to one that was written without regard to physics: what was written is
the cost, at every knot; the dynamics and the limits of the robot are kept.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
import pinocchio as pin
from jaxtyping import Bool, Float
from scipy.spatial.transform import Rotation, Slerp

from go2_wbc.errors import PlanNotFound, TimelineError, needing
from go2_wbc.legs import FOOT_NAMES, LEGS
from go2_wbc.robot.model import RobotModel
from go2_wbc.robot.rotations import log_rotation, rotation_from_rpy
from motions.dynamics.dynamic_trajectory import DynamicTrajectory, Miss
from motions.dynamics.knots import (
    Goal,
    Knots,
    Solution,
    feet_at,
    guess_velocities,
    knots_of,
    pose_of,
)
from motions.dynamics.phases import (
    KNOT_PERIOD,
    LONGEST_PHASE,
    FullState,
    PhaseProblem,
    Progress,
    Tolerance,
)
from motions.dynamics.plan_audit import PlanLimits, Weights, audit

BUDGET = 20.0  #: Processor time [s] that solving may take
SAME = 1e-9  #: Time [s] by which rounding may put a knot before its phase
ANOTHER_TURN = 1.5 * math.pi
"""Angle [rad] about an axis of the trunk from which on what is left of a turn is a whole one that
was lost: attitudes look the same, and the axes tip by much less than the rest."""


def solve(
    problem: PhaseProblem,
    model: RobotModel,
    *,
    budget: float = BUDGET,
    progress: Progress | None = None,
    limits: PlanLimits | None = None,
    start: Solved | None = None,
) -> DynamicTrajectory:
    """The motion that does what the phases ask, within what the robot can do.

    Box-constrained feasibility-driven differential dynamic programming (Mastalli et al. 2022). The
    result depends on the arguments only; the time, on whether there is one.

    Args:
        budget: processor time [s] after which to give up.
        progress: called after every iteration with their number and the cost.
        limits: what the plan keeps.
        start: a plan of the same phases for something a little easier, from which to begin; jumps
            that are not found from scratch are found in such steps.

    Raises:
        TimelineError: if the phases of ``start`` are others.
        MissingDependency: if crocoddyl is not installed.
        PlanNotFound: if no plan is found in time, or the best one breaks a limit or is farther from
            what was asked than the problem's tolerance; says what binds, and where.
    """
    limits = limits or PlanLimits()
    knots = knots_of(problem, model, limits)
    task = Task(knots, model, limits, Weights(), problem.tolerance, _misses)
    first = None if start is None else continued(start, problem, knots.times, model)
    return optimum(task, budget=budget, progress=progress, start=first)


@dataclass(frozen=True, slots=True)
class Solved:
    """A problem and its plan, from which the search for another of the same phases may begin."""

    problem: PhaseProblem  #: what was asked
    plan: DynamicTrajectory  #: what was found


def continued(
    solved: Solved, problem: PhaseProblem, times: Float[np.ndarray, " n1"], model: RobotModel
) -> tuple[Float[np.ndarray, "n1 37"], Float[np.ndarray, "n 12"]]:
    """States and torques [N m] of the plan of ``solved`` at the knots ``times`` [s] of ``problem``.

    Each knot is where it was as a share of its phase, so phases may last longer or shorter.

    Raises:
        TimelineError: if the two problems differ in which feet stand in which phase.
    """
    asked, known = ([phase.stance for phase in one.phases] for one in (problem, solved.problem))
    if asked != known:
        raise TimelineError(
            f"a plan of {len(known)} phases is no start for these {len(asked)}: the same feet must "
            "stand, phase by phase"
        )
    plan = solved.plan
    at = np.interp(times, _ends(problem), _ends(solved.problem))
    rows = np.clip(np.searchsorted(plan.times, at + SAME, side="right") - 1, 0, len(plan.tau) - 1)
    shares = np.clip((at - plan.times[rows]) / np.diff(plan.times)[rows], 0.0, 1.0)
    q = [
        pin.interpolate(model.pin_model, plan.q[row], plan.q[row + 1], share)
        for row, share in zip(rows.tolist(), shares.tolist(), strict=True)
    ]
    v = plan.v[rows] + shares[:, None] * (plan.v[rows + 1] - plan.v[rows])
    return np.hstack([np.array(q), v]), plan.tau[rows[:-1]]


def _ends(problem: PhaseProblem) -> Float[np.ndarray, " k"]:
    """When [s] the phases begin, and the last one ends."""
    return np.cumsum([0.0, *(phase.duration for phase in problem.phases)])


@dataclass(frozen=True, slots=True)
class Task:
    """What is solved, and what is then asked of the plan."""

    knots: Knots  #: the problem
    model: RobotModel  #: the robot
    limits: PlanLimits  #: what the plan keeps
    weights: Weights  #: what being off costs
    tolerance: Tolerance  #: how far it may be from what was asked
    misses: Callable[[Knots, DynamicTrajectory], tuple[Miss, ...]]  #: measures how far that is

    def plan(self, found: Solution) -> DynamicTrajectory:
        """The plan of what the search found."""
        q = found.x[:, :19]
        plan = DynamicTrajectory(
            times=self.knots.times,
            q=q,
            v=found.x[:, 19:],
            tau=found.tau,
            forces=found.forces,
            stance=self.knots.stance,
            gains=found.gains,
            p_feet=feet_at(self.model, q),
            iterations=found.iterations,
            cost=found.cost,
            misses=(),
        )
        return replace(plan, misses=self.misses(self.knots, plan))


def optimum(
    task: Task,
    *,
    budget: float,
    progress: Progress | None,
    start: tuple[np.ndarray, np.ndarray] | None = None,
) -> DynamicTrajectory:
    """The best plan for ``task``; raises what ``solve`` does."""
    require_crocoddyl()
    from motions.dynamics.shooting_problem import Search, ShootingProblem

    def objections(found: Solution) -> list[str]:
        plan = task.plan(found)
        return broken_limits(plan, task.model) + far_misses(plan, task.tolerance)

    knots, model, limits, weights = task.knots, task.model, task.limits, task.weights
    soft = ShootingProblem(knots, model, limits, weights.softened())
    full = ShootingProblem(knots, model, limits, weights)
    search = Search(
        soft, full, knots,
        objections=objections,
        turns=lambda found: task.plan(found).angle_deviation <= math.pi,
        budget=budget, progress=progress, start=start,
    )  # fmt: skip
    try:
        plan = task.plan(search.run())
    except PlanNotFound as error:
        best = search.best()
        raise PlanNotFound(str(error), [] if best is None else objections(best)) from None
    accept(plan, task.tolerance, model)
    return plan


def require_crocoddyl() -> None:
    """Raise MissingDependency unless crocoddyl can be imported."""
    with needing("dynamics", "dynamic motions are solved with crocoddyl"):
        import crocoddyl  # noqa: F401


def _misses(knots: Knots, plan: DynamicTrajectory) -> tuple[Miss, ...]:
    misses = []
    first, turned = pose_of(knots.initial.q), _turned(plan)
    for goal in knots.goals:
        time = float(knots.times[goal.knot])
        if goal.pose is not None:
            R_des = rotation_from_rpy(*goal.pose[3:].tolist())
            place, angle = trunk_miss(plan.q[goal.knot], goal.pose[:3], R_des)
            left = float(np.abs(goal.pose[3:] - first[3:] - turned[goal.knot]).max())
            angle = left if left > ANOTHER_TURN else angle
            misses.append(Miss("trunk", goal.label, time, place, angle))
        for leg in LEGS:
            if goal.asked[leg]:
                off = np.linalg.norm(plan.p_feet[goal.knot, leg] - goal.p_feet[leg])
                misses.append(Miss(FOOT_NAMES[leg], goal.label, time, float(off), 0.0))
    return tuple(misses)


def _turned(plan: DynamicTrajectory) -> Float[np.ndarray, "n1 3"]:
    """By how much the trunk has turned about its own axes since the start [rad]."""
    steps = plan.v[1:, 3:6] * np.diff(plan.times)[:, None]
    return np.vstack([np.zeros(3), np.cumsum(steps, axis=0)])


def trunk_miss(
    q: Float[np.ndarray, "19"], p: Float[np.ndarray, "3"], R: Float[np.ndarray, "3 3"]
) -> tuple[float, float]:
    """Distance [m] and angle [rad] between the trunk at ``q`` and a wanted pose."""
    angle = log_rotation(R.T @ pin.Quaternion(q[3:7]).toRotationMatrix())
    return float(np.linalg.norm(q[:3] - p)), float(np.linalg.norm(angle))


def accept(plan: DynamicTrajectory, tolerance: Tolerance, model: RobotModel) -> None:
    """Raise PlanNotFound for a plan that breaks a limit or is too far from what was asked."""
    if broken := broken_limits(plan, model):
        raise PlanNotFound("no dynamic plan: the best one breaks what the robot can do", broken)
    if far := far_misses(plan, tolerance):
        raise PlanNotFound(
            f"no dynamic plan within {1e3 * tolerance.position:.0f} mm and "
            f"{np.degrees(tolerance.angle):.0f} deg of what was asked; the nearest one is off:",
            far,
        )


def broken_limits(plan: DynamicTrajectory, model: RobotModel) -> list[str]:
    """What a plan breaks, in words."""
    return [str(reading) for reading in audit(plan, model) if not reading.is_kept]


def far_misses(plan: DynamicTrajectory, tolerance: Tolerance) -> list[str]:
    """Where a plan is too far from what was asked, in words."""
    return [
        str(miss)
        for miss in plan.misses
        if miss.position > tolerance.position or miss.angle > tolerance.angle
    ]


TRACKING = (300.0, 100.0, 1000.0)
"""Weights of the trunk's path [1/m^2, 1/rad^2] in the order in which they are tried: solving does
not get easier with less in every case (own experiments)."""
POSTURE = 3.0
"""Weight of the legs' angles [1/rad^2], by which feet in the air follow what was written."""
LATEST = 0.2  #: Greatest lag [s] that is looked for
EXPLAINED = 0.8
"""Share of the squared deviation that a lag must leave less than, to be one: a trunk that sways
where none was written is not late by anything. Own choice."""
LAG_STEP = 0.005  #: Between two lags [s] that are compared


@dataclass(frozen=True, slots=True)
class PlanTarget:
    """A motion as it was written, from rest to rest, in its own frame (see ``FullState``).

    Raises:
        TimelineError: if these are no motion that can be solved.
    """

    times: Float[np.ndarray, " n"]  #: (n,) increasing instants [s], from 0
    q: Float[np.ndarray, "n 19"]  #: (n, 19) configurations, whether or not physics allows them
    stance: Bool[np.ndarray, "n 4"]
    """(n, 4) feet that stand from each instant to the next; all of them at both ends."""

    def __post_init__(self) -> None:
        """Check that it can be solved."""
        times = self.times
        if len(times) < 2 or times[0] != 0.0 or not (np.diff(times) > 0.0).all():
            raise TimelineError("the instants of a motion must increase, from 0")
        if times[-1] > 2.0 * LONGEST_PHASE:
            raise TimelineError(
                f"the nearest motion is solved as a whole, over {2.0 * LONGEST_PHASE:g} s at most; "
                f"this one lasts {times[-1]:.1f} s: split it where it rests"
            )
        if not np.isfinite(self.q).all():
            raise TimelineError("a motion's configurations must be finite")
        if not (self.stance[0].all() and self.stance[-1].all()):
            raise TimelineError("a motion must start and end on four feet")

    def at(self, times: Float[np.ndarray, " k"]) -> Float[np.ndarray, "k 19"]:
        """Configurations at ``times`` [s], between the instants that are known."""
        inside = np.clip(times, 0.0, self.times[-1])
        q = np.column_stack([np.interp(inside, self.times, column) for column in self.q.T])
        q[:, 3:7] = Slerp(self.times, Rotation.from_quat(self.q[:, 3:7]))(inside).as_quat()
        return q


def nearest(
    written: PlanTarget,
    model: RobotModel,
    *,
    tolerance: Tolerance | None = None,
    progress: Progress | None = None,
) -> DynamicTrajectory:
    """The motion that comes nearest to ``written`` within what the robot can do.

    Its ``misses`` are the trunk's greatest distance and angle from what was written at the same
    time, and how far from its place each foot lands; ``lag`` is how late it is as a whole.

    Args:
        tolerance: how far it may be off.
        progress: called after every iteration with their number and the cost.

    Raises:
        MissingDependency: if crocoddyl is not installed.
        PlanNotFound: if there is none within the tolerance; says what binds, and where.
    """
    limits = PlanLimits(clearance=0.0)
    knots = _knots_of_written(written, model)
    last: PlanNotFound | None = None
    for weight in TRACKING:
        weights = Weights(track=weight, posture=POSTURE, trunk=0.0)
        try:
            task = Task(knots, model, limits, weights, tolerance or Tolerance(), _misses_of_written)
            plan = optimum(task, budget=BUDGET / len(TRACKING), progress=progress)
        except PlanNotFound as error:  # itself it would hold all that was solved
            last = last or PlanNotFound(str(error).partition("\n")[0], error.reasons)
        else:
            return replace(plan, lag=_lag_of(knots, plan))
    raise last or PlanNotFound("no dynamic plan: nothing was tried")


def _knots_of_written(written: PlanTarget, model: RobotModel) -> Knots:
    duration = float(written.times[-1])
    count = max(round(duration / KNOT_PERIOD), 1)
    times = np.linspace(0.0, duration, count + 1)
    q = written.at(times)
    rows = np.searchsorted(written.times, times[:-1] + 1e-9, side="right") - 1
    stance = written.stance[rows]
    stance[0] = True  # a foot that leaves at once needs a knot to do so
    p_feet = feet_at(model, q)
    p_stance = _standing_places(stance, p_feet)
    still = np.zeros(18)
    return Knots(
        times=times,
        stance=stance,
        p_stance=p_stance,
        goals=_landings(stance, p_stance, p_feet[-1]),
        clearance=np.full((count + 1, 4), model.foot_radius),
        q=q,
        v=guess_velocities(q, times, model),
        initial=FullState(q[0], still),
        final=FullState(q[-1], still),
    )


def _standing_places(
    stance: Bool[np.ndarray, "n 4"], p_feet: Float[np.ndarray, "n1 4 3"]
) -> Float[np.ndarray, "n 4 3"]:
    """Where each foot stands: where it was when it began to."""
    places = p_feet[:-1].copy()
    for row in range(1, len(stance)):
        stays = stance[row] & stance[row - 1]
        places[row, stays] = places[row - 1, stays]
    return places


def _landings(
    stance: Bool[np.ndarray, "n 4"],
    p_stance: Float[np.ndarray, "n 4 3"],
    p_end: Float[np.ndarray, "4 3"],
) -> tuple[Goal, ...]:
    goals, nothing = [], np.zeros(4, dtype=bool)
    for row in range(1, len(stance)):
        lands = stance[row] & ~stance[row - 1]
        if lands.any():
            goals.append(Goal(row, "touchdown", None, p_stance[row], lands, lands))
    return (*goals, Goal(len(stance), "end", None, p_end, nothing, nothing))


def _misses_of_written(knots: Knots, plan: DynamicTrajectory) -> tuple[Miss, ...]:
    offs = np.array([
        trunk_miss(q, wanted[:3], pin.Quaternion(wanted[3:7]).toRotationMatrix())
        for q, wanted in zip(plan.q, knots.q, strict=True)
    ])  # fmt: skip
    misses = []
    for row in sorted({int(row) for row in offs.argmax(axis=0)}):
        place, angle = offs[row].tolist()
        misses.append(Miss("trunk", "", float(knots.times[row]), place, angle))
    for goal in knots.goals:
        for leg in LEGS:
            if goal.lands[leg]:
                off = np.linalg.norm(plan.p_feet[goal.knot, leg] - goal.p_feet[leg])
                time = float(knots.times[goal.knot])
                misses.append(Miss(FOOT_NAMES[leg], goal.label, time, float(off), 0.0))
    return tuple(misses)


def _lag_of(knots: Knots, plan: DynamicTrajectory) -> float:
    """The delay [s] with which what was written comes nearest to the trunk's path."""
    times = knots.times
    wanted, done = knots.q[:, :7], plan.q[:, :7]
    count = round(LATEST / LAG_STEP)
    steps = LAG_STEP * np.arange(-count, count + 1)
    errors = []
    for step in steps:
        moved = [np.interp(times - step, times, column) for column in wanted.T]
        errors.append(float(np.square(done - np.array(moved).T).sum()))
    # Of equal ones the smallest delay: a motion that stands still has none.
    best = min(range(len(steps)), key=lambda row: (round(errors[row], 9), abs(steps[row])))
    return float(steps[best]) if errors[best] < EXPLAINED * errors[count] else 0.0
