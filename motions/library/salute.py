"""Salute."""

from typing import Annotated

from motions import Choice, Range, Timeline, deg, motion


@motion
def salute(
    side: Annotated[str, Choice("left", "right")] = "right",
    hold: Annotated[float, Range(0.3, 5.0, "s")] = 1.0,
) -> Timeline:
    """Salute: a paw to the brow, chest out, hold, and down smartly."""
    line = (
        Timeline()
        .leg("FR", hip=-0.05, thigh=-0.3, calf=-2.0, over=0.6)
        .also()
        .body(pitch=deg(-8.0), over=0.6)
        .leg("FR", hip=0.15, thigh=-1.1, calf=-1.7, over=0.5)
        .also()
        .body(pitch=deg(-12.0), z=0.01, over=0.5)
        .hold(hold, name="salute")
        .leg("FR", hip=-0.05, thigh=-0.3, calf=-2.0, over=0.5)
        .home(over=0.7)
    )
    return line if side == "right" else line.mirror()
