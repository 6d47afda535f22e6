"""Figure of eight."""

import math
from typing import Annotated

from motions import Range, Timeline, deg, motion

POINTS = 16
"""Points of the figure that the curve passes."""


@motion
def figure_eight(
    width: Annotated[float, Range(0.02, 0.05, "m")] = 0.04,
    rounds: Annotated[int, Range(1, 4)] = 2,
) -> Timeline:
    """Figure of eight: the trunk draws a lying eight over feet that stay."""
    angles = [2.0 * math.pi * k / POINTS for k in range(1, POINTS * rounds + 1)]
    points = [
        {"y": width * math.sin(a), "x": width / 2 * math.sin(2 * a), "roll": deg(-6) * math.sin(a)}
        for a in angles
    ]
    return Timeline().body(z=-0.03, over=0.6).body_path(points, over=3.2 * rounds).home(over=0.7)
