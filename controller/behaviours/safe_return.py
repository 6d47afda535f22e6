"""The way out of a motion that was called off: along the plan, back or on, to four loaded feet.

A raised paw cannot just be put down: the plan knows the one way that was checked. So the plan is
left along itself, by letting its clock run back, or on, to the nearest instant that is safe.

Where feet swing to other places, or fewer than three stand, the robot is kept up by its momentum,
and a clock that slows down, or turns round, would take that away. There the plan keeps its tempo
until it stands again: a jump that has begun lands first.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from go2_wbc.motion_plan import MotionPlan
from go2_wbc.recording import true_runs
from go2_wbc.reference import Reference

TURNING = 0.3  #: Time [s] in which the plan's clock comes to a stop
STEP = 0.05
"""Time [s] between the instants that are looked at; a foot is loaded for longer than that."""
ARRIVED = 1e-3  #: Distance [s] from the safe instant at which the clock stands
_BRAKING = 0.8  #: Share of the clock's deceleration that the approach counts on
ROOM = TURNING / (2.0 * _BRAKING)
"""Time [s] of the plan that passes while the clock comes to a stop."""
PATIENCE = 1.0
"""Time [s] after it first stands on four feet for which a walk goes on until its clock can stop
smoothly; after that it is left where it first stands: own choice."""


class SafeReturn:
    """Runs the clock of a plan smoothly from one instant to the nearest safe one.

    Attributes:
        t: where its clock stands [s].
        target: the safe instant [s].
        is_over: whether it has been reached.
    """

    def __init__(self, plan: MotionPlan, t: float) -> None:
        """Leave ``plan`` ``t`` seconds into it."""
        self._plan, self.t, self._rate = plan, min(t, plan.duration), 1.0
        self._way = way_out(plan, self.t)
        self.target = self._way.target
        self.is_over = False

    def advance(self, dt: float) -> Reference:
        """The reference ``dt`` seconds later, its rates those of the clock."""
        if self.t < self._way.keeps_tempo_until:
            self.t = min(self.t + dt, self._plan.duration)
            return self._plan.at(self.t)
        left = self.target - self.t
        has_stopped = abs(left) < ARRIVED and abs(self._rate) < 0.1
        self.is_over = self.is_over or self._way.is_left_in_motion or has_stopped
        if self.is_over or dt <= 0.0:
            return retimed(self._plan.at(self.t), 0.0 if self.is_over else self._rate, 0.0)
        wanted = np.sign(left) * min(1.0, np.sqrt(2.0 * _BRAKING * abs(left) / TURNING))
        change = float(np.clip(wanted - self._rate, -dt / TURNING, dt / TURNING))
        self._rate += change
        self.t += self._rate * dt
        return retimed(self._plan.at(self.t), self._rate, change / dt)


@dataclass(frozen=True, slots=True)
class WayOut:
    """How a plan is left.

    Attributes:
        target: instant [s] on four feet at which the clock shall stand.
        keeps_tempo_until: instant [s] before which it keeps its tempo; -inf if it need not.
        is_left_in_motion: whether the plan is left at the target as it goes, and not slowed down.
    """

    target: float
    keeps_tempo_until: float
    is_left_in_motion: bool = False


def way_out(plan: MotionPlan, t: float) -> WayOut:
    """How ``plan`` is left from the instant ``t`` [s]."""
    calm = _calm_spans(plan)
    for start, end in calm:
        if start <= t < end and (t + ROOM <= end or end == plan.duration):
            target = nearest_safe_instant(plan, t, start, end)
            if target is not None:
                return WayOut(target, -np.inf)
    landings = (_landing(plan, span) for span in calm if span[0] > t)
    smooth = next(
        (way for way in landings if way is not None),
        WayOut(plan.duration, plan.duration, is_left_in_motion=True),
    )
    first = _next_on_four_feet(plan, t)
    if first + PATIENCE < smooth.keeps_tempo_until:
        return WayOut(first, first, is_left_in_motion=True)
    return smooth


def nearest_safe_instant(
    plan: MotionPlan, t: float, start: float = 0.0, end: float | None = None
) -> float | None:
    """The instant [s] on four fully loaded feet that is reached soonest from ``t``.

    Going back costs the time of turning round. Start and end of a plan are always safe.

    Args:
        t: from where [s].
        start, end: instants [s] between which it must be; the whole plan unless said otherwise.
            None is returned if there is none.
    """
    end = plan.duration if end is None else end
    later, earlier = np.arange(t, end, STEP), np.arange(t, start, -STEP)
    ahead = next((s for s in later.tolist() if _is_safe(plan, s)), np.inf)
    behind = next((s for s in earlier.tolist() if _is_safe(plan, s)), -np.inf)
    ahead = plan.duration if ahead == np.inf and end == plan.duration else ahead
    behind = 0.0 if behind == -np.inf and start == 0.0 else behind
    nearest = ahead if ahead - t <= t - behind + 2.0 * TURNING else behind
    return float(nearest) if np.isfinite(nearest) else None


def _is_safe(plan: MotionPlan, t: float) -> bool:
    reference = plan.at(t)
    loads = reference.normal_force_max
    return bool(reference.stance.all() and loads.min() >= loads.max())


def _calm_spans(plan: MotionPlan) -> list[tuple[float, float]]:
    """Spans [s] in which three feet or more stand and no foot swings to another place."""
    steps = plan.footsteps
    if steps is None:
        return [(0.0, plan.duration)]
    times = [*steps.contacts.times, np.inf]
    is_calm = ~steps.swings.any(axis=1) & (steps.contacts.modes.sum(axis=1) >= 3)
    return [(times[run.start], min(times[run.stop], plan.duration)) for run in true_runs(is_calm)]


def _landing(plan: MotionPlan, span: tuple[float, float]) -> WayOut | None:
    """The way to stop in a calm span ahead, if there is time enough."""
    start, end = span
    if start + ROOM > end:
        return None
    target = nearest_safe_instant(plan, start + ROOM, start + ROOM, end)
    return None if target is None else WayOut(target, start)


def _next_on_four_feet(plan: MotionPlan, t: float) -> float:
    if plan.footsteps is None:
        return plan.duration
    contacts = plan.footsteps.contacts
    on_four_feet = np.flatnonzero(contacts.modes.all(axis=1))
    return next((s for s in np.array(contacts.times)[on_four_feet] if s > t), plan.duration)


def retimed(reference: Reference, rate: float, change: float) -> Reference:
    """``reference`` as it is when its time runs at ``rate``, which grows by ``change`` [1/s].

    Forces that were planned for its own tempo are let go.
    """
    body = reference.body
    return replace(
        reference,
        body=replace(
            body,
            v_world=rate * body.v_world,
            a_world=rate**2 * body.a_world + change * body.v_world,
            w_world=rate * body.w_world,
            dw_world=rate**2 * body.dw_world + change * body.w_world,
        ),
        v_world_feet=rate * reference.v_world_feet,
        a_world_feet=rate**2 * reference.a_world_feet + change * reference.v_world_feet,
        v_joints=rate * reference.v_joints,
        a_joints=rate**2 * reference.a_joints + change * reference.v_joints,
        force_weight=0.0,
    )
