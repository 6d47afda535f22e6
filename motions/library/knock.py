"""Knock."""

from typing import Annotated

from motions import Choice, Range, Timeline, motion


@motion
def knock(
    side: Annotated[str, Choice("left", "right")] = "right",
    times: Annotated[int, Range(1, 6)] = 3,
) -> Timeline:
    """Knock: a raised paw beats three times from the knee, and waits for an answer."""
    line = Timeline().leg("FR", hip=0.0, thigh=-0.5, calf=-1.9, over=0.8)
    for _ in range(times):
        line = line.joint("FR", "calf", -1.55, over=0.25).joint("FR", "calf", -1.9, over=0.25)
    line = line.hold(0.4).home(over=0.8)
    return line if side == "right" else line.mirror()
