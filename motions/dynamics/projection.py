"""The motion nearest to one that was written without regard to physics.

What was written is the cost, at every knot; the dynamics and the limits of the robot are kept.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
import pinocchio as pin
from jaxtyping import Bool, Float
from scipy.spatial.transform import Rotation, Slerp

from go2_wbc.errors import PlanNotFound, TimelineError
from go2_wbc.legs import FOOT_NAMES, LEGS
from go2_wbc.robot.model import RobotModel
from motions.dynamics.dynamic_trajectory import DynamicTrajectory, Miss
from motions.dynamics.knots import Goal, Knots, feet_at, guess_velocities
from motions.dynamics.phases import KNOT_PERIOD, LONGEST_PHASE, FullState, Progress, Tolerance
from motions.dynamics.plan_audit import PlanLimits, Weights
from motions.dynamics.solver import BUDGET, Task, optimum, trunk_miss

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

    Attributes:
        times: (n,) increasing instants [s], from 0.
        q: (n, 19) configurations, whether or not physics allows them.
        stance: (n, 4) feet that stand from each instant to the next; all of them at both ends.

    Raises:
        TimelineError: if these are no motion that can be solved.
    """

    times: Float[np.ndarray, " n"]
    q: Float[np.ndarray, "n 19"]
    stance: Bool[np.ndarray, "n 4"]

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
    knots = _knots(written, model)
    last: PlanNotFound | None = None
    for weight in TRACKING:
        weights = Weights(track=weight, posture=POSTURE, trunk=0.0)
        try:
            task = Task(knots, model, limits, weights, tolerance or Tolerance(), _misses)
            plan = optimum(task, budget=BUDGET / len(TRACKING), progress=progress)
        except PlanNotFound as error:  # itself it would hold all that was solved
            last = last or PlanNotFound(str(error).partition("\n")[0], error.reasons)
        else:
            return replace(plan, lag=_lag(knots, plan))
    raise last or PlanNotFound("no dynamic plan: nothing was tried")


def _knots(written: PlanTarget, model: RobotModel) -> Knots:
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


def _misses(knots: Knots, plan: DynamicTrajectory) -> tuple[Miss, ...]:
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


def _lag(knots: Knots, plan: DynamicTrajectory) -> float:
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
