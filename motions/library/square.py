"""Square."""

from typing import Annotated

from motions import Choice, Range, Timeline, deg, motion


@motion
def square(
    edge: Annotated[float, Range(0.2, 1.0, "m")] = 0.4,
    side: Annotated[str, Choice("left", "right")] = "left",
) -> Timeline:
    """Square: four edges, four corners, and back at the start."""
    line = Timeline()
    for _ in range(4):
        line = line.walk(x=edge, gait="trot").turn(deg(90.0), gait="trot")
    return line if side == "left" else line.mirror()
