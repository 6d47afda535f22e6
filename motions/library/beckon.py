"""Beckon."""

from typing import Annotated

from motions import Choice, Range, Timeline, deg, motion


@motion
def beckon(
    side: Annotated[str, Choice("left", "right")] = "right",
    times: Annotated[int, Range(1, 6)] = 3,
) -> Timeline:
    """Beckon: come here! A paw stretched out curls in, again and again."""
    line = Timeline().leg("FR", hip=-0.05, thigh=-0.4, calf=-1.9, over=0.7)
    line = line.also().body(pitch=deg(-6.0), over=0.7)
    for _ in range(times):
        line = line.leg("FR", hip=-0.05, thigh=-0.9, calf=-1.2, over=0.45)
        line = line.leg("FR", hip=-0.05, thigh=-0.5, calf=-2.1, over=0.45)
    line = line.home(over=0.9)
    return line if side == "right" else line.mirror()
