"""Lift a hind leg."""

from typing import Annotated

from motions import Choice, Timeline, motion


@motion
def lift_leg(side: Annotated[str, Choice("left", "right")] = "right") -> Timeline:
    """Lift a hind leg to the side, as dogs do, look innocent, put it down."""
    line = (
        Timeline()
        .foot("RR", x=-0.02, y=-0.07, z=0.13, over=0.9)
        .hold(1.2, name="lifted")
        .down("RR", over=0.8)
        .home(over=0.8)
    )
    return line if side == "right" else line.mirror()
