"""Shake the head."""

from typing import Annotated

from motions import Range, Timeline, deg, motion


@motion
def shake_head(times: Annotated[int, Range(1, 6)] = 3) -> Timeline:
    """Shake the head: no, no, no."""
    line = Timeline()
    for _ in range(times):
        line = line.body(yaw=deg(10.0), over=0.5).body(yaw=deg(-10.0), over=0.5)
    return line.home(over=0.4)
