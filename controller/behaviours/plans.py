"""Behaviours that play a motion plan."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from jaxtyping import Float

from controller.behaviours import Behaviour
from controller.behaviours.anchoring import Approach, anchor_of
from controller.behaviours.safe_return import SafeReturn
from controller.behaviours.weight import FeltWeight
from go2_wbc.motion_plan import MotionPlan, Posture
from go2_wbc.reference import Anchor, Reference, Target
from go2_wbc.robot.motor import JointFriction
from go2_wbc.robot.rotations import wrap_angle, yaw_rotation
from go2_wbc.robot.state import Snapshot
from go2_wbc.tracking.landing import Landings
from go2_wbc.tracking.plan_feedback import fed_back
from go2_wbc.tracking.plan_tracking import Deviation, PlanTracker, tracked_position

LOW = 0.15
"""Height [m] of the trunk over the ground below which a posture may begin on the belly."""
RISEN = 0.22
"""Height [m] of the tracked point over the ground from which on the robot has left its belly."""
SUNK_BACK = 0.04
"""Depth [m] below the highest that it has risen to, from which on a rising robot is falling: one
that is too weak, or carries too much, stops where it is."""


class PlayPlan(Behaviour):
    """Play a plan where the robot stands."""

    _anchor: Anchor
    _tracker: PlanTracker
    _approach: Approach
    _weight: FeltWeight

    def __init__(self, plan: MotionPlan, friction: JointFriction | None = None) -> None:
        """Play ``plan``; ``friction`` is that of the joints, by default as configured at first."""
        self._friction = friction or JointFriction()
        self.label, self.duration = plan.name, plan.duration
        self.plan, self.is_dynamic = plan, plan.has_dynamic_spans
        self._start = self._last = 0.0
        self._must_return = False
        self._return: SafeReturn | None = None

    def start(self, snapshot: Snapshot) -> None:
        """Anchor the plan at the feet."""
        super().start(snapshot)
        self._last = self._start
        self._anchor = anchor_of(self.plan, snapshot.p_world_feet, snapshot.foot_radius)
        self._tracker = PlanTracker(self._anchor, self.plan.footsteps)
        self._approach = Approach.of(self.plan, self._anchor, snapshot)
        self._weight = FeltWeight(self._friction)

    def return_safely(self) -> None:
        """Leave the plan: go to its nearest instant on four loaded feet; any thread may call."""
        self._must_return = True

    @property
    def progress(self) -> float:
        """Share of the plan that has been played, 0 to 1; 0 before ``start``."""
        return min(1.0, (self._last - self._start) / self.plan.duration)

    @property
    def deviation(self) -> Deviation:
        """How far the robot has been off the plan since ``start``."""
        return self._tracker.deviation

    @property
    def landings(self) -> Landings:
        """What came of the landings of feet that step."""
        return self._tracker.landings

    def end_error(self, snapshot: Snapshot) -> tuple[float, float]:
        """Distance [m], on the level, and angle [rad] of the feet's middle from its planned end.

        That is where the plan ends, placed where the robot stood when it began.
        """
        planned = self.plan.at(self.plan.duration).placed(self._anchor).p_world_feet
        wanted = Anchor.of_feet(planned, snapshot.foot_radius)
        stands = Anchor.of_feet(snapshot.p_world_feet, snapshot.foot_radius)
        off = (stands.p_world - wanted.p_world)[:2]
        return float(np.linalg.norm(off)), abs(wrap_angle(stands.yaw - wanted.yaw))

    @property
    def sag_and_lean(self) -> tuple[float, float]:
        """From the plan: a correction that pulls against a load is no wanted lean."""
        return self._tracker.sag_and_lean

    def update(self, snapshot: Snapshot) -> Reference:
        """The plan's reference of this instant, in the world."""
        now = snapshot.state.time
        target, t = self._planned(snapshot)
        reference = self._tracker.track(target, snapshot, t, now - self._last)
        self._last = now
        if not self.is_dynamic or self._return is not None:
            return reference
        feedback = self.plan.feedback_at(t)
        if feedback is None:
            return reference
        return fed_back(reference, feedback, self._tracker.anchor, snapshot)

    def _planned(self, snapshot: Snapshot) -> tuple[Target, float]:
        """What the plan asks for in this tick, and how far into the plan it is [s]."""
        now = snapshot.state.time
        if self._must_return and self._return is None:
            self._return = SafeReturn(self.plan, self._last - self._start)
        if self._return is not None:
            target = Target.of(self._return.advance(now - self._last).row)
            return target, self._return.t
        t = now - self._start
        target = Target.of(self.plan.row_at(t))
        self._approach.add_to(target, t)
        if self.is_dynamic:
            self._weight.add_to(target, snapshot, now - self._last)
        return target, t

    def is_finished(self, snapshot: Snapshot) -> bool:
        """Whether the plan is over, or the way back from it."""
        if self._return is not None:
            return self._return.is_over
        return super().is_finished(snapshot)


class ChangePosture(PlayPlan):
    """Play a plan that starts from the measured pose of the body."""

    knows_payload = True

    def __init__(self, make_plan: Callable[[Float[np.ndarray, "6"]], MotionPlan]) -> None:
        """Args: make_plan: from the pose (6,) of its point in the feet's frame to the plan."""
        super().__init__(make_plan(np.zeros(6)))  # until ``start`` has measured
        self._make_plan = make_plan
        self._point = self.plan.at(0.0).body.point

    def start(self, snapshot: Snapshot) -> None:
        """Make the plan from the measured pose."""
        super().start(snapshot)
        state, anchor = snapshot.state, self._anchor
        p = tracked_position(snapshot, self._point)
        roll, pitch, yaw = state.rpy
        position = yaw_rotation(anchor.yaw).T @ (p - anchor.p_world)
        pose = np.array([*position, roll, pitch, wrap_angle(float(yaw) - anchor.yaw)])
        self.plan = self._make_plan(pose)
        self.duration = self.plan.duration
        self._highest = float(pose[2])
        self.may_lie = bool(pose[2] < LOW) or self.plan.exit is Posture.LIE

    def update(self, snapshot: Snapshot) -> Reference:
        """The plan's reference; once the robot has risen, or sinks back, it must not lie."""
        height = float(tracked_position(snapshot, self._point)[2] - self._anchor.p_world[2])
        self._highest = max(self._highest, height)
        has_sunk_back = self._highest - height > SUNK_BACK
        if (height > RISEN or has_sunk_back) and self.plan.exit is not Posture.LIE:
            self.may_lie = False
        return super().update(snapshot)
