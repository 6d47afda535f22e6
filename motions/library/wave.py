"""Wave."""

from typing import Annotated

from motions import Choice, Range, Timeline, deg, motion

THIGH, CALF = -1.05, -1.15
"""Angles [rad] of the raised leg."""


@motion
def wave(
    side: Annotated[str, Choice("left", "right")] = "right",
    times: Annotated[int, Range(1, 8)] = 3,
) -> Timeline:
    """Wave hello: raise a paw and swing it from side to side."""
    line = (
        Timeline()
        .leg("FR", hip=-0.1, thigh=-0.3, calf=-2.0, over=0.6)
        .also()
        .body(pitch=deg(-8.0), z=0.01, over=0.6)
        .leg("FR", hip=-0.1, thigh=THIGH, calf=CALF, over=0.6)
        .also()
        .body(pitch=deg(-13.0), z=0.02, over=0.6)
    )
    for _ in range(times):
        for hip in (-0.38, 0.12):
            line = line.leg("FR", hip=hip, thigh=THIGH, calf=CALF, over=0.35)
    line = line.leg("FR", hip=-0.1, thigh=-0.3, calf=-2.0, over=0.6).home(over=0.8)
    return line if side == "right" else line.mirror()
