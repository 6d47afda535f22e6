"""Zigzag."""

from typing import Annotated

from motions import Range, Timeline, motion


@motion
def zigzag(
    length: Annotated[float, Range(0.6, 2.0, "m")] = 1.2,
    width: Annotated[float, Range(0.05, 0.2, "m")] = 0.12,
) -> Timeline:
    """Zigzag: ahead in curves, left and right, heading where it goes."""
    quarter = length / 4.0
    points = [(quarter, width), (2 * quarter, 0.0), (3 * quarter, -width), (length, 0.0)]
    return Timeline().path(points, gait="trot")
