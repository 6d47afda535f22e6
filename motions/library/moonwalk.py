"""Moonwalk."""

from typing import Annotated

from motions import Range, Timeline, deg, motion


@motion
def moonwalk(length: Annotated[float, Range(0.2, 1.5, "m")] = 0.6) -> Timeline:
    """Moonwalk: leaning ahead as if to go on, and gliding backwards."""
    lean = Timeline().body(pitch=deg(7.0), x=0.015, z=-0.02, over=0.7)
    glide = Timeline().walk(x=-length, gait="trot")
    up = lean.together(glide).body(pitch=deg(-8.0), x=0.0, z=0.0, over=0.6)
    return up.hold(0.4).home(over=0.7)
