"""Pirouette."""

from typing import Annotated

from motions import Choice, Range, Timeline, deg, motion


@motion
def pirouette(
    side: Annotated[str, Choice("left", "right")] = "left",
    turns: Annotated[int, Range(1, 3)] = 1,
) -> Timeline:
    """Pirouette: head up, and once round on the spot."""
    line = Timeline().body(pitch=deg(-7.0), z=0.01, over=0.6)
    for _ in range(2 * turns):
        line = line.turn(deg(180.0), gait="trot")
    line = line.home(over=0.7)
    return line if side == "left" else line.mirror()
