"""How the feet of a plan land: when and where they meet the ground, not when it was planned.

- A foot that meets the ground in the last part of its swing stands from then on. If it went on
  towards its place it would push against the ground; the plan's time is not changed by it, so that
  a beat stays one.
- A foot that should stand, but has no contact yet, goes on as a swing foot, downwards. One that
  were said to stand would hang where it is: the controller would keep it there, and count on a
  force that the ground does not give. After ``time_out`` it counts as standing all the same: what
  has not been met by then is no uneven ground, and a contact sensor that fails must not keep a leg
  in the air. It is counted as missed.
- The ground's height is learnt from feet whose contact is measured, each once a landing, as in
  ``locomotion``.
- While a foot stands, the others swing to the plan's places in the world: what one step was off,
  the next one is not. In flight no leg can move the CoM, which goes on as it took off: the plan is
  carried along with it (x and y) but for the first ``NEAR``, so that the feet come down below the
  body nearly as planned, and the next jump starts from where this one has ended. Within ``NEAR``
  they come down in their places, and the legs bring the body back over them.
"""

from __future__ import annotations

from bisect import bisect_right
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Float

from go2_wbc.contacts import TIE, ContactPhase
from go2_wbc.legs import LEGS
from go2_wbc.reference import Anchor, Footsteps, LegTask, Reference
from go2_wbc.robot.model import FOOT_RADIUS
from go2_wbc.robot.snapshot import Snapshot

EARLIEST = 0.6
"""Share of a swing after which a contact is a landing: before, it is the lift-off's, or a stone's.
From a prototype: the peak force on a foot went from 496 to 297 N."""
PRESS_SPEED = 0.4
"""Speed [m/s] at which a foot that is late goes down: own choice, slower than it swings."""
PRESS_DEPTH = 0.06
"""Greatest depth [m] below the ground that it looks for: what a standing leg can still reach."""
TIME_OUT = 0.2
"""Time [s] after which a foot without contact counts as standing: it reaches the depth in 0.15."""
PLAN_SHARE = 0.3
"""Share of how much higher than planned a foot landed by which the rest of the plan is raised."""
NEAR = 0.02
"""Distance [m] by which the CoM may be off its plan when feet come down in their places all the
same: a tenth of the way to the edge of their support. Far jumps land half as far beside."""


@dataclass(frozen=True, slots=True)
class Landings:
    """What came of a plan's landings.

    Attributes:
        missed: feet that had no contact even ``TIME_OUT`` after they should have come down.
        error: greatest distance [m], on the level, of a foot that had landed from the place where
            the plan, as it was placed at its start, wanted it.
    """

    missed: int
    error: float


class ReadableLanding:
    """Changes references to what the feet's measured contacts make of them, step by step.

    Attributes:
        anchor: where the plan is now.
    """

    def __init__(self, anchor: Anchor, footsteps: Footsteps) -> None:
        """All feet stand."""
        self.anchor = self._origin = anchor
        self._steps = footsteps
        self._planned = [LegTask.STANCE] * 4
        self._is_in_air, self._is_awaited = [False] * 4, [False] * 4
        self._touchdown: list[float | None] = [None] * 4
        self._missed, self._error = 0, 0.0

    @property
    def landings(self) -> Landings:
        """What came of the landings so far."""
        return Landings(self._missed, self._error)

    def landed(self, plan: Reference, snapshot: Snapshot, t: float) -> Reference:
        """The reference ``t`` seconds into the plan, in the world.

        Args:
            plan: what is planned then, in the motion's frame.
            snapshot: of this tick.
            t: [s].
        """
        phase, placed = self._steps.contacts.at(t), plan.placed(self.anchor)
        event = max(bisect_right(self._steps.contacts.times, t + TIE) - 1, 0)
        left = self._steps.unloads[event] - t
        for leg in LEGS:
            self._plan(leg, plan.legs[leg])
            if self._is_in_air[leg]:
                self._notice(leg, phase, snapshot, t)
        legs = [self._task(leg) for leg in LEGS]
        loads = np.array([self._load(leg, t, float(left[leg]), placed) for leg in LEGS])
        feet = placed.p_world_feet.copy(), placed.v_world_feet.copy(), placed.a_world_feet.copy()
        for leg in LEGS:
            if legs[leg] is LegTask.SWING and self._planned[leg] is LegTask.STANCE:
                self._press(leg, float(phase.elapsed[leg]), *feet)
        self._judge(placed, snapshot)
        p, v, a = feet
        landed = replace(
            placed,
            legs=tuple(legs),
            normal_force_min=loads[:, 0],
            normal_force_max=loads[:, 1],
            p_world_feet=p,
            v_world_feet=v,
            a_world_feet=a,
        )
        return landed if LegTask.STANCE in legs else self._carried(landed, snapshot)

    def _plan(self, leg: int, planned: LegTask) -> None:
        if planned is LegTask.JOINTS:
            self._is_in_air[leg] = self._is_awaited[leg] = False
            self._touchdown[leg] = None
        elif planned is LegTask.SWING and self._planned[leg] is not LegTask.SWING:
            self._is_in_air[leg] = self._is_awaited[leg] = True
        self._planned[leg] = planned

    def _notice(self, leg: int, phase: ContactPhase, snapshot: Snapshot, t: float) -> None:
        """Find out whether the foot has landed."""
        should_stand = self._planned[leg] is LegTask.STANCE
        may_land = should_stand or phase.progress[leg] >= EARLIEST
        if may_land and snapshot.state.feet_in_contact[leg]:
            self._learn_ground(float(snapshot.p_world_feet[leg, 2]) - FOOT_RADIUS)
        elif should_stand and phase.elapsed[leg] > TIME_OUT:
            self._missed += 1
        else:
            return
        self._is_in_air[leg], self._touchdown[leg] = False, t

    def _learn_ground(self, height: float) -> None:
        p = self.anchor.p_world
        higher = np.array([0.0, 0.0, PLAN_SHARE * (height - p[2])])
        self.anchor = Anchor(p + higher, self.anchor.yaw)

    def _task(self, leg: int) -> LegTask:
        if self._planned[leg] is LegTask.JOINTS:
            return LegTask.JOINTS
        return LegTask.SWING if self._is_in_air[leg] else LegTask.STANCE

    def _load(self, leg: int, t: float, left: float, placed: Reference) -> tuple[float, float]:
        """Least and greatest normal force [N], ramped from when the foot came down."""
        if self._is_in_air[leg]:
            return 0.0, 0.0
        touchdown = self._touchdown[leg]
        if touchdown is None:
            return float(placed.normal_force_min[leg]), float(placed.normal_force_max[leg])
        should_stand = self._planned[leg] is LegTask.STANCE
        nearest = min(t - touchdown, left if should_stand else np.inf)
        share = min(max(nearest / self._steps.ramp, 0.0), 1.0)
        return self._steps.normal_force_min * share, self._steps.normal_force_max * share

    def _press(
        self,
        leg: int,
        late: float,
        p: Float[np.ndarray, "4 3"],
        v: Float[np.ndarray, "4 3"],
        a: Float[np.ndarray, "4 3"],
    ) -> None:
        depth = min(PRESS_SPEED * late, PRESS_DEPTH)
        p[leg, 2] -= depth
        v[leg] = [0.0, 0.0, -PRESS_SPEED if depth < PRESS_DEPTH else 0.0]
        a[leg] = 0.0

    def _judge(self, placed: Reference, snapshot: Snapshot) -> None:
        moved = (self.anchor.p_world - self._origin.p_world)[:2]
        for leg in LEGS:
            has_landed = self._planned[leg] is LegTask.STANCE and not self._is_in_air[leg]
            if self._is_awaited[leg] and has_landed:
                self._is_awaited[leg] = False
                off = snapshot.p_world_feet[leg] - placed.p_world_feet[leg]
                self._error = max(self._error, float(np.linalg.norm(off[:2] + moved)))

    def _carried(self, reference: Reference, snapshot: Snapshot) -> Reference:
        """``reference`` moved to ``NEAR`` of where the CoM is, the feet in step with it."""
        level, body = np.array([1.0, 1.0, 0.0]), reference.body
        off = level * (snapshot.p_world_com - body.p_world)
        share = 1.0 - NEAR / max(float(np.linalg.norm(off)), NEAR)
        off = share * off
        faster = share * level * (snapshot.v_world_com - body.v_world)
        self.anchor = Anchor(self.anchor.p_world + off, self.anchor.yaw)
        return replace(
            reference,
            body=replace(body, p_world=body.p_world + off),
            p_world_feet=reference.p_world_feet + off,
            v_world_feet=reference.v_world_feet + faster,
        )


def landing_numbers(footsteps: Footsteps) -> Sequence[float]:
    """What the kernel reads, in the order of ``kernels.layout.LANDING``."""
    return (
        EARLIEST,
        PRESS_SPEED,
        PRESS_DEPTH,
        TIME_OUT,
        PLAN_SHARE,
        FOOT_RADIUS,
        NEAR,
        footsteps.ramp,
        footsteps.normal_force_min,
        footsteps.normal_force_max,
    )
