"""Heart."""

import math
from typing import Annotated

from motions import Range, Timeline, deg, motion

POINTS = 24
"""Points of the heart that the nose passes."""
WIDTH, HEIGHT = deg(7.0), deg(9.0)
"""Half of its width in yaw and of its height in pitch [rad]."""


@motion
def heart(times: Annotated[int, Range(1, 4)] = 2) -> Timeline:
    """Heart: the nose draws a heart in the air, then a paw is raised to the chest."""
    yaw, pitch = _place(0)
    line = Timeline().body(yaw=yaw, pitch=pitch, over=0.8)
    for _ in range(times):
        points = [_place(number) for number in range(1, POINTS + 1)]
        line = line.body_path([{"yaw": yaw, "pitch": pitch} for yaw, pitch in points], over=3.6)
    line = line.home(over=0.8).foot("FR", x=0.04, y=0.06, z=0.12, over=0.8).hold(0.6)
    return line.home(over=0.9)


def _place(number: int) -> tuple[float, float]:
    """Yaw and pitch [rad] on a heart that begins at the dip between its two bows."""
    t = 2.0 * math.pi * number / POINTS
    aside = math.sin(t) ** 3
    up = (13.0 * math.cos(t) - 5.0 * math.cos(2 * t) - 2.0 * math.cos(3 * t) - math.cos(4 * t)) / 15
    return -WIDTH * aside, -HEIGHT * up
