"""Breathe."""

from typing import Annotated

from motions import Range, Timeline, motion


@motion
def breathe(breaths: Annotated[int, Range(1, 10)] = 3) -> Timeline:
    """Breathe: calm, in and out."""
    line = Timeline()
    for _ in range(breaths):
        line = line.body(z=0.015, over=1.1).body(z=-0.015, over=1.3)
    return line.home(over=0.8)
