"""Velocity commands: what was asked, checked and clipped to what the robot can do."""

from __future__ import annotations

import math
from dataclasses import dataclass
from numbers import Real

from go2_wbc.errors import CommandError


def _as_float(value: Real) -> float:
    try:
        return float(value)
    except OverflowError:  # an integer beyond every float
        return math.inf


@dataclass(frozen=True, slots=True)
class VelocityCommand:
    """Body-frame velocity of the robot: forward and left [m/s], turning left [rad/s]."""

    linear_x: float = 0.0
    linear_y: float = 0.0
    angular_z: float = 0.0

    def __post_init__(self) -> None:
        """Make every component a float; raise CommandError unless it is a finite number."""
        for name in ("linear_x", "linear_y", "angular_z"):
            value = getattr(self, name)
            if isinstance(value, bool) or not isinstance(value, Real):
                raise CommandError(f"{name} must be a number, got {value!r}")
            number = _as_float(value)
            if not math.isfinite(number):
                raise CommandError(f"{name} must be finite, got {value}")
            object.__setattr__(self, name, number)

    @property
    def is_zero(self) -> bool:
        """Whether the robot is asked to stay."""
        return self.linear_x == 0.0 and self.linear_y == 0.0 and self.angular_z == 0.0


ZERO_COMMAND = VelocityCommand()


@dataclass(frozen=True, slots=True)
class VelocityEnvelope:
    """Commands that the trot follows inside the torque and joint-speed limits.

    The bounds are combined as an ellipsoid: a command on its surface uses the whole envelope.
    """

    forward: float = 1.5
    backward: float = 1.0
    lateral: float = 0.6
    turning: float = 2.0

    def clip(self, command: VelocityCommand) -> VelocityCommand:
        """``command``, scaled down if it lies outside."""
        forward = self.forward if command.linear_x >= 0.0 else self.backward
        load = math.hypot(
            command.linear_x / forward,
            command.linear_y / self.lateral,
            command.angular_z / self.turning,
        )
        if load <= 1.0:
            return command
        return VelocityCommand(
            command.linear_x / load, command.linear_y / load, command.angular_z / load
        )
