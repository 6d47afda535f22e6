"""Terrain that a simulated plant can stand the robot on, as plain data."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from go2_wbc.validation import require_not_negative, require_positive


@dataclass(frozen=True, slots=True)
class Boxes:
    """Flat ground strewn with low boxes that the robot does not know about.

    The robot starts at the origin, which stays clear.

    Attributes:
        height: largest height of a box [m]; heights are uniform in (0, height].
        size: side of a box [m].
        count: number of boxes.
        extent: half side of the square they are strewn over [m].
        clear_radius: no box reaches closer than this to the origin [m]; the Go2 is 0.7 m long.
        seed: of the random places and heights.
    """

    height: float = 0.06
    size: float = 0.25
    count: int = 100
    extent: float = 4.0
    clear_radius: float = 0.55
    seed: int = 0

    def __post_init__(self) -> None:
        """Raise ConfigError for a number that is out of range."""
        require_positive(self, "height", "size", "extent")
        require_not_negative(self, "count", "clear_radius", "seed")

    def layout(self) -> Float[np.ndarray, "n 4"]:
        """One row per box: x, y of its centre [m], yaw [rad], height [m].

        Places that reach into the clear disc are dropped, so there may be fewer than ``count``.
        """
        rng = np.random.default_rng(self.seed)
        low = (-self.extent, -self.extent, -np.pi, 0.0)
        high = (self.extent, self.extent, np.pi, self.height)
        rows = rng.uniform(low, high, size=(self.count, 4))
        reach = self.size / np.sqrt(2.0)
        return rows[np.hypot(rows[:, 0], rows[:, 1]) - reach > self.clear_radius]
