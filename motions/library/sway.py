"""Sway."""

from typing import Annotated

from motions import Range, Timeline, deg, motion


@motion
def sway(
    tempo: Annotated[float, Range(40.0, 90.0, "bpm")] = 60.0,
    bars: Annotated[int, Range(1, 8)] = 2,
) -> Timeline:
    """Sway: from side to side in time, leaning into each step of the song."""
    line = Timeline().bpm(tempo)
    for _ in range(bars):
        for side in (1.0, -1.0):
            line = line.body(y=0.03 * side, roll=deg(-6.0) * side, z=-0.02, over=1.0)
            line = line.body(y=0.0, roll=0.0, z=0.0, over=1.0)
    return line.home(over=1.0)
