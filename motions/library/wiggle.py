"""Wiggle."""

from typing import Annotated

from motions import Range, Timeline, deg, motion


@motion
def wiggle(times: Annotated[int, Range(1, 10)] = 4) -> Timeline:
    """Wiggle the hips: happy to see you."""
    line = Timeline().body(pitch=deg(8.0), z=-0.02, over=0.5)
    for _ in range(times):
        line = line.body(yaw=deg(4.5), roll=deg(5.0), y=0.01, over=0.4)
        line = line.body(yaw=deg(-4.5), roll=deg(-5.0), y=-0.01, over=0.4)
    return line.home(over=0.6)
