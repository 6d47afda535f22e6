"""Nod."""

from typing import Annotated

from motions import Range, Timeline, deg, motion


@motion
def nod(times: Annotated[int, Range(1, 6)] = 3) -> Timeline:
    """Nod: yes, yes, yes."""
    line = Timeline()
    for _ in range(times):
        line = line.body(pitch=deg(12.0), over=0.4).body(pitch=deg(-4.0), over=0.4)
    return line.home(over=0.4)
