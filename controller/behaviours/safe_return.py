"""The way out of a motion that was called off: along the plan, back or on, to four loaded feet.

A raised paw cannot just be put down: the plan knows the one way that was checked. So the plan is
left along itself, by letting its clock run back, or on, to the nearest instant that is safe.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from go2_wbc.reference import MotionPlan, Reference

TURNING = 0.3
"""Time [s] in which the plan's clock comes to a stop."""
STEP = 0.05
"""Time [s] between the instants that are looked at; a foot is loaded for longer than that."""
ARRIVED = 1e-3
"""Distance [s] from the safe instant at which the clock stands."""
_BRAKING = 0.8
"""Share of the clock's deceleration that the approach counts on."""


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
        self.target = nearest_safe_instant(plan, self.t)
        self.is_over = False

    def advance(self, dt: float) -> Reference:
        """The reference ``dt`` seconds later, its rates those of the clock."""
        left = self.target - self.t
        self.is_over = self.is_over or (abs(left) < ARRIVED and abs(self._rate) < 0.1)
        if self.is_over or dt <= 0.0:
            return retimed(self._plan.at(self.t), 0.0 if self.is_over else self._rate, 0.0)
        wanted = np.sign(left) * min(1.0, np.sqrt(2.0 * _BRAKING * abs(left) / TURNING))
        change = float(np.clip(wanted - self._rate, -dt / TURNING, dt / TURNING))
        self._rate += change
        self.t += self._rate * dt
        return retimed(self._plan.at(self.t), self._rate, change / dt)


def nearest_safe_instant(plan: MotionPlan, t: float) -> float:
    """The instant [s] on four fully loaded feet that is reached soonest from ``t``.

    Going back costs the time of turning round. The end of a plan is always safe.
    """
    later, earlier = np.arange(t, plan.duration, STEP), np.arange(t, 0.0, -STEP)
    ahead = next((s for s in later.tolist() if _is_safe(plan, s)), plan.duration)
    behind = next((s for s in earlier.tolist() if _is_safe(plan, s)), 0.0)
    return float(ahead if ahead - t <= t - behind + 2.0 * TURNING else behind)


def _is_safe(plan: MotionPlan, t: float) -> bool:
    reference = plan.at(t)
    loads = reference.normal_force_max
    return bool(reference.stance.all() and loads.min() >= loads.max())


def retimed(reference: Reference, rate: float, change: float) -> Reference:
    """``reference`` as it is when its time runs at ``rate``, which grows by ``change`` [1/s]."""
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
    )
