"""Leg order and per-leg index arithmetic, defined once.

Legs are FL, FR, RL, RR; joints of a leg are hip, thigh, calf. ``q`` is (19,) with the joints from
7 on, ``v`` is (18,) with the joints from 6 on (Pinocchio's free-flyer layout).
"""

from __future__ import annotations

from enum import IntEnum


class Leg(IntEnum):
    """A leg; its value is its row in every per-leg array."""

    FL = 0
    FR = 1
    RL = 2
    RR = 3

    @property
    def joints(self) -> slice:
        """Columns of this leg in a (12,) joint array."""
        return slice(3 * self, 3 * self + 3)

    @property
    def velocities(self) -> slice:
        """Columns of this leg in an (18,) generalised velocity."""
        return slice(6 + 3 * self, 9 + 3 * self)

    @property
    def foot(self) -> str:
        """Name of the foot link."""
        return f"{self.name}_foot"

    @property
    def is_front(self) -> bool:
        """Whether this is a front leg."""
        return self < Leg.RL

    @property
    def side(self) -> int:
        """+1 for a left leg (positive y), -1 for a right leg."""
        return 1 if self % 2 == 0 else -1

    @property
    def mirror(self) -> Leg:
        """The leg across the sagittal plane."""
        return Leg(self ^ 1)


LEGS: tuple[Leg, ...] = tuple(Leg)
JOINT_NAMES: tuple[str, ...] = tuple(
    f"{leg.name}_{part}_joint" for leg in LEGS for part in ("hip", "thigh", "calf")
)
FOOT_NAMES: tuple[str, ...] = tuple(leg.foot for leg in LEGS)
SIDES: dict[str, Leg] = {"left": Leg.FL, "right": Leg.FR}
