"""Content."""

from typing import Annotated

from motions import Range, Timeline, deg, motion


@motion
def content(times: Annotated[int, Range(1, 6)] = 2) -> Timeline:
    """Content: look up, sway from side to side with small bounces, and sigh."""
    line = Timeline().body(pitch=deg(-9.0), z=0.01, over=0.7)
    for _ in range(times):
        for side in (1.0, -1.0):
            line = line.body(roll=side * deg(6.0), y=side * 0.015, over=0.55)
            line = line.body(z=-0.01, over=0.3).body(z=0.012, over=0.3)
    line = line.body(roll=0.0, y=0.0, pitch=deg(-12.0), z=0.015, over=0.7).hold(0.3)
    return line.body(pitch=deg(4.0), z=-0.03, over=1.0).hold(0.2).home(over=0.8)
