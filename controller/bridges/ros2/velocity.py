"""Velocity commands from a topic: checked, clipped, and forgotten when they cease."""

from __future__ import annotations

import logging
import math

import numpy as np

from controller.go2_controller import GO2Controller
from controller.modes import Mode
from controller.pacing import LogThrottle
from go2_wbc.errors import CommandError
from go2_wbc.planning.command import ZERO_COMMAND, VelocityCommand, VelocityEnvelope, finite_number
from go2_wbc.planning.trunk import LEVEL, BodyPose, PoseEnvelope
from go2_wbc.robot.rotations import rpy_from_quaternion

_log = logging.getLogger(__name__)

CMD_VEL_SILENCE = 0.5  #: Robot time [s] without a command after which the robot stops


class VelocityInput:
    """Hands velocity commands on to a robot that walks.

    Attributes:
        counts: how many commands came, and what became of them.
    """

    def __init__(
        self, go2: GO2Controller, envelope: VelocityEnvelope, poses: PoseEnvelope | None = None
    ) -> None:
        """Drive ``go2`` within the envelopes of velocities and of poses."""
        self._go2, self._envelope, self._poses = go2, envelope, poses or PoseEnvelope()
        self._pose = LEVEL
        self._throttle = LogThrottle(_log)
        self._last: float | None = None
        self.counts = dict.fromkeys(
            ("received", "followed", "not_finite", "out_of_mode", "silences", "poses_refused"), 0
        )

    def accept(self, x: float, y: float, turn: float, *, is_busy: bool) -> None:
        """Follow the velocity x forward, y to the left [m/s], turn left [rad/s], if it can now.

        Not while it ``is_busy`` with a behaviour, which is not to be disturbed.
        """
        self.counts["received"] += 1
        if not all(map(math.isfinite, (x, y, turn))):
            self.counts["not_finite"] += 1
            self._throttle.warn("finite", f"cmd_vel ({x}, {y}, {turn}) is not finite: ignored")
            return
        mode = self._go2.mode
        if is_busy or mode is not Mode.WALKING:
            self.counts["out_of_mode"] += 1
            state = "carrying out a behaviour" if is_busy else mode.value
            self._throttle.warn("mode", f"cmd_vel ignored: the robot is {state}, send 'walk' first")
            return
        wanted = VelocityCommand(x, y, turn)
        if excess := self._envelope.excess(wanted):
            self._throttle.warn("clip", f"cmd_vel: {excess}")
        self._move(self._envelope.clip(wanted))
        self.counts["followed"] += 1
        self._last = self._go2.state.time

    def accept_pose(self, height: float, quaternion: tuple[float, float, float, float]) -> None:
        """Take a pose of the trunk while the robot walks; it lasts until the next one.

        ``height`` [m] is from the usual one, ``quaternion`` (x y z w) from level; all 0 is level.
        """
        try:
            rpy = _attitude(quaternion)
            pose = BodyPose(height, *rpy)
            self._poses.require(pose)
        except CommandError as error:
            self.counts["poses_refused"] += 1
            self._throttle.warn("pose", f"body_pose ignored: {error}")
            return
        self._pose = pose
        if self._go2.mode is Mode.WALKING and self._go2.body_pose != pose:
            self._move(self._go2.command)

    def _move(self, command: VelocityCommand) -> None:
        pose = self._pose
        self._go2.move(
            command.linear_x,
            command.angular_z,
            linear_y=command.linear_y,
            height=pose.height,
            roll=pose.roll,
            pitch=pose.pitch,
            yaw=pose.yaw,
        )

    def expire(self) -> None:
        """Stop a robot whose last command is older than ``CMD_VEL_SILENCE``."""
        if self._last is not None and self._go2.state.time - self._last >= CMD_VEL_SILENCE:
            self.counts["silences"] += self.end()

    def end(self) -> bool:
        """Stop following the last command; returns whether the robot was walking by it."""
        self._last = None
        was_walking = self._go2.mode is Mode.WALKING and not self._go2.command.is_zero
        if was_walking:
            self._move(ZERO_COMMAND)
        return was_walking


def _attitude(quaternion: tuple[float, float, float, float]) -> list[float]:
    """Roll, pitch and yaw [rad] of x y z w; CommandError unless they are finite numbers."""
    x, y, z, w = (finite_number("orientation", part) for part in quaternion)
    if not any((x, y, z, w)):  # what a message has in which nobody has set it
        return [0.0, 0.0, 0.0]
    return rpy_from_quaternion(np.array([x, y, z, w])).tolist()
