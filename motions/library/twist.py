"""Twist."""

from typing import Annotated

from motions import Range, Timeline, deg, motion


@motion
def twist(tempo: Annotated[float, Range(40.0, 120.0, "beats/min")] = 75.0) -> Timeline:
    """Twist: turn against the feet to the beat, going down and coming up again."""
    line, swing = Timeline().bpm(tempo), deg(11.0)
    for height in (-0.03, -0.07, -0.10, -0.07, -0.03, 0.0):
        line = line.body(yaw=swing, z=height, over=1.0)
        swing = -swing
    return line.home(over=1.0)
