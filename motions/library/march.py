"""March."""

from typing import Annotated

from motions import Range, Timeline, deg, motion


@motion
def march(
    tempo: Annotated[float, Range(90.0, 140.0, "bpm")] = 110.0,
    length: Annotated[float, Range(0.1, 1.0, "m")] = 0.4,
) -> Timeline:
    """March: ahead on the beat with the head up, about turn, back, about turn."""
    up = Timeline().bpm(tempo).body(pitch=deg(-6.0), over=2)
    out = up.walk(x=length, gait="trot").turn(deg(180), gait="trot")
    back = out.walk(x=length, gait="trot").turn(deg(180), gait="trot")
    return back.home(over=2)
