"""What the trunk carries beside its own parts: a mass and its place."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import pinocchio as pin

from go2_wbc.validation import require_finite, require_not_negative


@dataclass(frozen=True, slots=True)
class Payload:
    """A point mass that is fixed to the trunk.

    Attributes:
        mass: [kg].
        place: in the base frame [m].
    """

    mass: float = 0.0
    place: tuple[float, float, float] = (0.0, 0.0, 0.0)

    def __post_init__(self) -> None:
        """Raise ConfigError for a mass that is negative, or a number that is not finite."""
        require_not_negative(self, "mass")
        require_finite(self, "place")

    @property
    def inertia(self) -> pin.Inertia:
        """About the base's origin."""
        return pin.Inertia(self.mass, np.array(self.place), np.zeros((3, 3)))


NO_PAYLOAD = Payload()
"""The robot carries nothing."""
