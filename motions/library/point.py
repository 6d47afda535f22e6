"""Point."""

from typing import Annotated

from motions import Range, Timeline, motion


@motion
def point(
    x: Annotated[float, Range(0.8, 5.0, "m")] = 1.0,
    y: Annotated[float, Range(-0.4, 0.0, "m")] = -0.15,
    hold: Annotated[float, Range(0.3, 5.0, "s")] = 1.0,
) -> Timeline:
    """Point: look at a place on the ground ahead, and raise a paw towards it."""
    return (
        Timeline()
        .look_at(x, y, 0.2, over=0.9)
        .leg("FR", hip=-0.05, thigh=-0.2, calf=-1.9, over=0.7)
        .leg("FR", hip=-0.05, thigh=-0.75, calf=-1.2, over=0.6)
        .hold(hold, name="point")
        .leg("FR", hip=-0.05, thigh=-0.2, calf=-1.9, over=0.6)
        .home(over=1.1)
    )
