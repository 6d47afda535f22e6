"""Hula."""

from typing import Annotated

from motions import Range, Timeline, deg, motion

RADIUS = 0.035
"""Radius [m] of the circle."""
LEAN = deg(5.0)
"""Angle [rad] by which the trunk leans inwards."""


@motion
def hula(rounds: Annotated[int, Range(1, 6)] = 2) -> Timeline:
    """Hula: the trunk goes round in circles, leaning inwards."""
    line = _lean(Timeline(), 0, over=0.6)
    for corner in range(1, 4 * rounds + 1):
        line = _lean(line, corner, over=0.45)
    return line.home(over=0.6)


def _lean(line: Timeline, corner: int, *, over: float) -> Timeline:
    """Move to one of the four corners of the circle: ahead, left, back, right."""
    ahead, left = ((1, 0), (0, 1), (-1, 0), (0, -1))[corner % 4]
    return line.body(
        x=RADIUS * ahead, y=RADIUS * left, pitch=-LEAN * ahead, roll=-LEAN * left, over=over
    )
