"""Shake a paw."""

from typing import Annotated

from motions import Choice, Range, Timeline, deg, motion


@motion
def shake_paw(
    side: Annotated[str, Choice("left", "right")] = "right",
    times: Annotated[int, Range(1, 6)] = 3,
) -> Timeline:
    """Shake a paw: offer it, let it be shaken, take it back."""
    line = (
        Timeline()
        .foot("FR", x=0.13, y=0.04, z=0.16, over=0.9)
        .also()
        .body(pitch=deg(-6.0), over=0.9)
        .hold(0.4)
    )
    for _ in range(times):
        line = line.foot("FR", x=0.13, y=0.04, z=0.20, over=0.22)
        line = line.foot("FR", x=0.13, y=0.04, z=0.14, over=0.22)
    line = line.hold(0.3).home(over=0.9)
    return line if side == "right" else line.mirror()
