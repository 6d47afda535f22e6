"""Nose circle."""

import math
from typing import Annotated

from motions import Range, Timeline, motion

POINTS = 12
"""Points of the circle that the curve passes."""


@motion
def nose_circle(
    radius: Annotated[float, Range(0.05, 0.25, "rad")] = 0.18,
    rounds: Annotated[int, Range(1, 4)] = 2,
) -> Timeline:
    """Nose circle: the nose draws a ring in the air."""
    angles = [2.0 * math.pi * k / POINTS for k in range(1, POINTS * rounds + 1)]
    points = [{"yaw": radius * math.sin(a), "pitch": -radius * math.cos(a)} for a in angles]
    line = Timeline().body(pitch=-radius, over=0.7)
    return line.body_path(points, over=2.0 * rounds).home(over=0.7)
