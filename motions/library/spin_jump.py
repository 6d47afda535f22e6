"""Spin jump."""

from typing import Annotated

from motions import Choice, Timeline, deg, motion


@motion
def spin_jump(side: Annotated[str, Choice("left", "right")] = "left") -> Timeline:
    """Spin jump: jump up and turn by 90 degrees in the air."""
    line = Timeline().spin_jump(deg(90)).hold(0.3)
    return line if side == "left" else line.mirror()
