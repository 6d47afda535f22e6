"""Stamp."""

from typing import Annotated

from motions import Choice, Range, Timeline, deg, motion


@motion
def stamp(
    side: Annotated[str, Choice("left", "right")] = "right",
    times: Annotated[int, Range(1, 8)] = 3,
) -> Timeline:
    """Stamp: impatient, with a front foot, again and again."""
    line = Timeline().body(pitch=deg(3.0), over=0.4)
    for _ in range(times):
        line = line.foot("FR", x=0.01, z=0.06, over=0.3).down("FR", over=0.3).hold(0.3)
    line = line.home(over=0.8)
    return line if side == "right" else line.mirror()
