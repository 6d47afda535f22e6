"""Velocity commands from a topic: checked, clipped, and forgotten when they cease."""

from __future__ import annotations

import logging
import math

from controller.bridges.ros2.names import CMD_VEL_SILENCE
from controller.go2_controller import GO2Controller
from controller.modes import Mode
from controller.pacing import LogThrottle
from go2_wbc.planning.command import VelocityCommand, VelocityEnvelope

_log = logging.getLogger(__name__)


class VelocityInput:
    """Hands velocity commands on to a robot that walks.

    Attributes:
        counts: how many commands came, and what became of them.
    """

    def __init__(self, go2: GO2Controller, envelope: VelocityEnvelope) -> None:
        """Drive ``go2`` within ``envelope``."""
        self._go2, self._envelope = go2, envelope
        self._throttle = LogThrottle(_log)
        self._last: float | None = None
        self.counts = dict.fromkeys(
            ("received", "followed", "not_finite", "out_of_mode", "silences"), 0
        )

    def accept(self, x: float, y: float, turn: float, *, is_busy: bool) -> None:
        """Follow the velocity x, y [m/s], turn [rad/s], if that is possible now.

        Args:
            x: forward.
            y: to the left.
            turn: to the left.
            is_busy: whether the robot carries out a behaviour, which is not to be disturbed.
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
        command = self._envelope.clip(wanted)
        if command != wanted:
            self._throttle.warn("clip", f"cmd_vel clipped from {wanted} to {command}")
        self._go2.move(command.linear_x, command.angular_z, linear_y=command.linear_y)
        self.counts["followed"] += 1
        self._last = self._go2.state.time

    def expire(self) -> None:
        """Stop a robot whose last command is older than ``CMD_VEL_SILENCE``."""
        if self._last is not None and self._go2.state.time - self._last >= CMD_VEL_SILENCE:
            self.counts["silences"] += self.end()

    def end(self) -> bool:
        """Stop following the last command; returns whether the robot was walking by it."""
        self._last = None
        was_walking = self._go2.mode is Mode.WALKING and not self._go2.command.is_zero
        if was_walking:
            self._go2.move()
        return was_walking
