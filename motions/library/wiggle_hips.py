"""Wiggle the hips."""

import math
from typing import Annotated

from motions import Range, Timeline, deg, motion

HEAD = 0.25
"""Distance [m] from the middle of the trunk to the point ahead that stays where it is."""
SWING = deg(6.0)
"""Angle [rad] by which the rump goes to either side."""


@motion
def wiggle_hips(
    times: Annotated[int, Range(1, 8)] = 4,
    tempo: Annotated[float, Range(60.0, 120.0, "beats/min")] = 100.0,
) -> Timeline:
    """Wiggle the hips: head low and still, the rump from side to side, on the beat."""
    line = Timeline().body(pitch=deg(9.0), z=-0.02, over=0.6).bpm(tempo)
    for _ in range(times):
        for swing in (SWING, -SWING):
            line = line.body(yaw=swing, y=-HEAD * math.sin(swing), roll=swing / 2, over=1.0)
    return line.home(over=2.0)
