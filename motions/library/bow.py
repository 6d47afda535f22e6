"""Bow."""

from typing import Annotated

from motions import Range, Timeline, deg, motion


@motion
def bow(angle: Annotated[float, Range(0.1, 0.45, "rad")] = deg(20.0)) -> Timeline:
    """Bow: dip the chest over the front feet, stay a moment, come up again."""
    return Timeline().body(pitch=angle, z=-0.05, over=0.9).hold(0.6).home(over=0.9)
