"""Patrol."""

from typing import Annotated

from motions import Range, Timeline, deg, motion
from motions.library.look_around import look_around


@motion
def patrol(length: Annotated[float, Range(0.3, 2.0, "m")] = 0.8) -> Timeline:
    """Patrol: ahead, a look around, about turn, and back to where it was."""
    way = Timeline().walk(x=length, gait="trot")
    about = Timeline().turn(deg(180.0), gait="trot")
    return way.then(look_around(), about, way, about)
