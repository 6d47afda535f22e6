"""Velocity commands: what was asked, checked and clipped to what the robot can do."""

from __future__ import annotations

import math
from dataclasses import astuple, dataclass
from numbers import Real

from go2_wbc.errors import CommandError
from go2_wbc.validation import POSITIVE, ranged

ROUNDING = 1e-12  #: Share of the envelope by which a command on its surface may seem to lie outside

FAR = 2.0  #: How many times the envelope from which on other units may be meant


def finite_number(name: str, value: float) -> float:
    """``value`` as a float; raise CommandError if it is not a finite number."""
    if isinstance(value, bool) or not isinstance(value, Real):
        raise CommandError(f"{name} must be a number, got {value!r}")
    try:
        number = float(value)
    except OverflowError:  # an integer beyond every float
        number = math.inf
    if not math.isfinite(number):
        raise CommandError(f"{name} must be finite, got {value}")
    return number


@dataclass(frozen=True, slots=True)
class VelocityCommand:
    """Body-frame velocity of the robot: forward and left [m/s], turning left [rad/s]."""

    linear_x: float = 0.0
    linear_y: float = 0.0
    angular_z: float = 0.0

    def __post_init__(self) -> None:
        """Make every component a float; raise CommandError unless it is a finite number."""
        for name in ("linear_x", "linear_y", "angular_z"):
            object.__setattr__(self, name, finite_number(name, getattr(self, name)))

    @property
    def is_zero(self) -> bool:
        """Whether the robot is asked to stay."""
        return self.linear_x == 0.0 and self.linear_y == 0.0 and self.angular_z == 0.0


ZERO_COMMAND = VelocityCommand()


@dataclass(frozen=True, slots=True)
@ranged(POSITIVE)
class VelocityEnvelope:
    """Commands that are followed.

    The speeds are combined as an ellipsoid: a command on its surface uses the whole envelope. Those
    by default are half of what the trot holds in simulation or less (``envelopes.trot_of``).

    Attributes:
        forward, backward, lateral: speeds [m/s].
        turning: turning rate [rad/s].
        curve: acceleration aside [m/s^2] in a curve, speed times turning rate. On a floor of
            friction 0.6 robots held steady curves of 3, and 12 of 15 fell in those of 4. Under 20
            random commands in the trot's envelope, each for 1.5 s, on sensors, 4 of 26 robots fell
            with 2.5, 1 of 36 with 2, and 1 of 40 with this.
    """

    forward: float = 1.5
    backward: float = 1.0
    lateral: float = 0.6
    turning: float = 2.0
    curve: float = 1.5

    def scaled(self, share: float) -> VelocityEnvelope:
        """That of every command in this one multiplied by ``share``."""
        bounds = (self.forward, self.backward, self.lateral, self.turning, share * self.curve)
        return VelocityEnvelope(*(share * bound for bound in bounds))

    def within(self, other: VelocityEnvelope) -> VelocityEnvelope:
        """The smaller one of each bound of both."""
        return VelocityEnvelope(*map(min, astuple(self), astuple(other)))

    def clip(self, command: VelocityCommand) -> VelocityCommand:
        """``command``, scaled down if it lies outside."""
        parts = (command.linear_x, command.linear_y, command.angular_z)
        scale = max(1.0, *map(abs, parts))  # so that no quotient overflows
        x, y, turn = (part / scale for part in parts)
        load = self._load(x, y, turn)
        if load * scale <= 1.0 + ROUNDING:
            return command
        return VelocityCommand(x / load, y / load, turn / load)

    def excess(self, command: VelocityCommand) -> str:
        """What there is to say of a command that lies outside, or nothing."""
        if (followed := self.clip(command)) == command:
            return ""
        told = f"velocity command clipped from {command} to {followed}"
        if self.is_far(command):
            told += (
                f", which asks for {self.load(command):.3g} times what is followed: speeds are in "
                "m/s, turning rates in rad/s"
            )
        return told

    def is_far(self, command: VelocityCommand) -> bool:
        """Whether ``command`` is so far outside that other units may be meant."""
        return self.load(command) > FAR

    def load(self, command: VelocityCommand) -> float:
        """Share of the envelope that ``command`` uses: 1 on its surface."""
        return self._load(command.linear_x, command.linear_y, command.angular_z)

    def _load(self, x: float, y: float, turn: float) -> float:
        forward = self.forward if x >= 0.0 else self.backward
        curve = math.sqrt(math.hypot(x, y) * abs(turn) / self.curve)
        return max(math.hypot(x / forward, y / self.lateral, turn / self.turning), curve)

    def __str__(self) -> str:
        """The bounds with their units."""
        return (
            f"{self.forward:.2f} m/s ahead, {self.backward:.2f} back, {self.lateral:.2f} aside, "
            f"{self.turning:.2f} rad/s, {self.curve:.2f} m/s^2 in a curve"
        )
