"""The ground around the robot as it has been seen, for users; read-only."""

from __future__ import annotations

from typing import final

import numpy as np
from jaxtyping import Float

from go2_wbc.arguments import typed
from go2_wbc.brief import inline_html
from go2_wbc.errors import CommandError
from go2_wbc.planning.height_map import CELL, HeightMap, cells, heights_at


@final
class SeenTerrain:
    """Heights of the ground in the world of ``go2.state``, in cells of 2.5 cm, 4 m around.

    Attributes:
        blocked: what the robot has stopped in front of, in plain words; "" if its way is free.
    """

    _repr_html_ = inline_html

    def __init__(self, heights: HeightMap, blocked: str) -> None:
        """Look at ``heights``, which change as the robot walks on."""
        self._heights, self.blocked = heights, blocked

    @typed(error=CommandError)
    def height(self, x: float, y: float) -> float:
        """Of the ground at a place [m]; nan where nothing has been seen."""
        z = np.empty(1)
        heights_at(self._heights, np.array([[x, y]]), z)
        return float(z[0])

    def points(self) -> Float[np.ndarray, "n 3"]:
        """Middles of all cells that have been seen [m]."""
        return cells(self._heights)

    def __repr__(self) -> str:
        """How much of it there is, and whether the way is free."""
        z = self.points()[:, 2]
        way = f"blocked: {self.blocked}" if self.blocked else "way free"
        if not len(z):
            return f"<SeenTerrain: nothing seen, {way}>"
        area = len(z) * CELL**2
        return f"<SeenTerrain: {area:.1f} m^2, {z.min():.2f} to {z.max():.2f} m, {way}>"
