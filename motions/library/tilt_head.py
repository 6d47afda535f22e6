"""Tilt the head."""

from typing import Annotated

from motions import Range, Timeline, deg, motion


@motion
def tilt_head(times: Annotated[int, Range(1, 4)] = 1) -> Timeline:
    """Tilt the head: what did you say? To one side, to the other, and up at you."""
    line = Timeline()
    for _ in range(times):
        for side in (1.0, -1.0):
            line = line.body(roll=deg(12.0) * side, pitch=deg(-6.0), over=0.5).hold(0.7)
    return line.body(roll=0.0, pitch=deg(-10.0), over=0.6).hold(0.5).home(over=0.7)
