"""Sit pretty."""

from typing import Annotated

from go2_wbc.motion_plan import Posture
from motions import Choice, Timeline, deg, motion


@motion
def sit_pretty(side: Annotated[str, Choice("left", "right")] = "right") -> Timeline:
    """Sit pretty: sit down like a dog, tilt the head to one side and the other, stand up again."""
    line = (
        Timeline()
        .posture(Posture.SIT, over=1.8)
        .hold(0.4)
        .body(roll=deg(6.0), over=0.9)
        .hold(0.6)
        .body(roll=deg(-6.0), pitch=deg(-4.0), over=1.2)
        .hold(0.6)
        .home(over=0.9)
        .posture(Posture.STAND, over=1.6)
    )
    return line if side == "right" else line.mirror()
