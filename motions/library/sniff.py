"""Sniff."""

from typing import Annotated

from motions import Range, Timeline, deg, motion


@motion
def sniff(times: Annotated[int, Range(1, 6)] = 3) -> Timeline:
    """Sniff: nose to the ground, along a trail from side to side, and up again."""
    line = Timeline().body(pitch=deg(15.0), z=-0.06, x=0.02, over=0.9)
    for _ in range(times):
        for yaw in (9.0, -9.0):
            line = line.body(yaw=deg(yaw), over=0.5).also().body(pitch=deg(17.0), over=0.25)
            line = line.at(line.end - 0.25).body(pitch=deg(14.0), over=0.25)
    return line.body(yaw=0.0, pitch=deg(-8.0), z=0.0, over=0.8).hold(0.4).home(over=0.7)
