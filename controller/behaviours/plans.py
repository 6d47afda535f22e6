"""Behaviours that play a motion plan."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
from jaxtyping import Float

from controller.behaviours.base import Behaviour
from go2_wbc.planning.correction import SteadyStateCorrection, tracked_position
from go2_wbc.reference import Anchor, MotionPlan, Reference, TrackedPoint
from go2_wbc.robot.rotations import wrap_angle, yaw_rotation
from go2_wbc.robot.snapshot import Snapshot


class PlayPlan(Behaviour):
    """Play a plan where the robot stands."""

    def __init__(self, plan: MotionPlan, foot_radius: float) -> None:
        """Play ``plan``; ``foot_radius`` [m] tells where the ground is."""
        self.label = plan.name
        self.plan = plan
        self._foot_radius = foot_radius

    def start(self, snapshot: Snapshot) -> None:
        """Anchor the plan at the feet."""
        self._start = self._last = snapshot.state.time
        self._correction = SteadyStateCorrection()
        self._anchor = Anchor.of_feet(snapshot.p_world_feet, self._foot_radius)

    def update(self, snapshot: Snapshot) -> Reference:
        """The plan's reference of this instant, in the world."""
        now = snapshot.state.time
        reference = self.plan.at(now - self._start).placed(self._anchor)
        body = self._correction.corrected(reference.body, snapshot, now - self._last)
        self._last = now
        return replace(reference, body=body)

    def is_finished(self, snapshot: Snapshot) -> bool:
        """Whether the plan is over."""
        return snapshot.state.time - self._start >= self.plan.duration


class ChangePosture(PlayPlan):
    """Play a plan that starts from the measured pose of the body."""

    def __init__(
        self,
        label: str,
        make_plan: Callable[[Float[np.ndarray, "6"]], MotionPlan],
        point: TrackedPoint,
        foot_radius: float,
    ) -> None:
        """Args: make_plan: from the pose (6,) of ``point`` in the feet's frame to the plan."""
        self.label = label
        self._make_plan = make_plan
        self._point = point
        self._foot_radius = foot_radius

    def start(self, snapshot: Snapshot) -> None:
        """Make the plan from the measured pose."""
        super().start(snapshot)
        state, anchor = snapshot.state, self._anchor
        p = tracked_position(snapshot, self._point)
        roll, pitch, yaw = state.rpy
        position = yaw_rotation(anchor.yaw).T @ (p - anchor.p_world)
        pose = np.array([*position, roll, pitch, wrap_angle(float(yaw) - anchor.yaw)])
        self.plan = self._make_plan(pose)
