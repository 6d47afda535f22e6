"""What the trunk carries beside its own parts: a mass and its place."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import pinocchio as pin

from go2_wbc.validation import FINITE, NOT_NEGATIVE, ranged


@dataclass(frozen=True, slots=True)
@ranged(mass=NOT_NEGATIVE, place=FINITE)
class Payload:
    """A point mass that is fixed to the trunk.

    Attributes:
        mass: [kg].
        place: in the base frame [m].
    """

    mass: float = 0.0
    place: tuple[float, float, float] = (0.0, 0.0, 0.0)

    @property
    def inertia(self) -> pin.Inertia:
        """About the base's origin."""
        return pin.Inertia(self.mass, np.array(self.place), np.zeros((3, 3)))


NO_PAYLOAD = Payload()  #: The robot carries nothing
