"""Where a plan is played: in the frame of the feet, and above two feet, over their line."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from go2_wbc.curves import Ease
from go2_wbc.legs import Leg
from go2_wbc.motion_plan import MotionPlan
from go2_wbc.reference import Anchor, Target
from go2_wbc.robot.rotations import yaw_rotation
from go2_wbc.robot.state import Snapshot
from go2_wbc.tracking.plan_tracking import tracked_position

FARTHEST = 0.02
"""Distance [m] by which a plan is moved at most; more than feet are beside their places after
standing up, of which 5 mm are common."""
APPROACH = 0.15
"""Time [s] of the approach: own choice, less than dynamic motions take to leave four feet; 5 mm
take 1.3 m/s^2."""
SAME_PLACE = 0.01
"""Distance [m] below which a foot is where it stood at the start: a landing's, at most."""
_PAIR = 2


def anchor_of(
    plan: MotionPlan, p_world_feet: Float[np.ndarray, "4 3"], foot_radius: float
) -> Anchor:
    """Where ``plan`` is played by a robot whose feet stand there.

    That is the frame of the feet (``Anchor.of_feet``). On two feet, though, the CoM balances over
    the line between them like an inverted pendulum, and where feet are a little beside their
    planned places, so is that line: 5 mm become 30 mm in half a second. So a dynamic plan is moved
    by as much as the lines between such feet are beside their planned places.
    """
    anchor = Anchor.of_feet(p_world_feet, foot_radius)
    pairs = _pairs(plan) if plan.has_dynamic_spans else []
    if not pairs:
        return anchor
    planned = plan.at(0.0).placed(anchor).p_world_feet
    across, beside = [], []
    for pair in pairs:
        x, y = np.subtract(*p_world_feet[pair, :2])
        normal = np.array([-y, x]) / np.hypot(x, y)
        across.append(normal)
        beside.append(normal @ (p_world_feet[pair, :2] - planned[pair, :2]).mean(axis=0))
    moved = np.linalg.lstsq(np.array(across), np.array(beside), rcond=None)[0]
    moved *= min(1.0, FARTHEST / max(float(np.linalg.norm(moved)), FARTHEST))
    return Anchor(anchor.p_world + np.array([*moved, 0.0]), anchor.yaw)


@dataclass(frozen=True, slots=True)
class Approach:
    """The way from where the robot stands to a dynamic plan, by minimum jerk.

    Feedback alone comes near in half a second; a plan that flies or balances before is met so.

    Attributes:
        p_start: (3,) place [m] of the tracked point from its planned one, in the motion's frame.
    """

    p_start: Float[np.ndarray, "3"]

    @staticmethod
    def of(plan: MotionPlan, anchor: Anchor, snapshot: Snapshot) -> Approach:
        """From where the robot stands; none for a plan that is not dynamic."""
        if not plan.has_dynamic_spans:
            return Approach(np.zeros(3))
        body = plan.at(0.0).body
        seen = yaw_rotation(anchor.yaw).T @ (
            tracked_position(snapshot, body.point) - anchor.p_world
        )
        return Approach(seen - body.p_world)

    def add_to(self, target: Target, t: float) -> None:
        """Add what is left of the way ``t`` seconds into the plan to its target of that instant."""
        if t >= APPROACH or not self.p_start.any():
            return
        values = Ease.MINIMUM_JERK.progress(t / APPROACH)
        derivatives = target.p_world, target.v_world, target.a_world
        for power, derivative in enumerate(derivatives):
            share = values[power] / APPROACH**power
            left = 1.0 - share if power == 0 else -share
            derivative += left * self.p_start


def _pairs(plan: MotionPlan) -> list[list[Leg]]:
    """Two feet that carry the robot together, where they stand from the start."""
    steps = plan.footsteps
    if steps is None:
        return []
    placed, pairs = plan.at(0.0).p_world_feet, list[list[Leg]]()
    for t, stands in zip(steps.contacts.times, steps.contacts.modes, strict=True):
        pair = [Leg(leg) for leg in np.flatnonzero(stands)]
        if len(pair) == _PAIR and pair not in pairs:
            moved = plan.at(t).p_world_feet[pair] - placed[pair]
            pairs += [pair] if np.abs(moved).max() < SAME_PLACE else []
    return pairs
