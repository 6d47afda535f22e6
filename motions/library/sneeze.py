"""Sneeze."""

from typing import Annotated

from motions import Range, Timeline, deg, motion


@motion
def sneeze(times: Annotated[int, Range(1, 4)] = 2) -> Timeline:
    """Sneeze: the head goes back, and back, and down at once; then a shake."""
    line = Timeline()
    for _ in range(times):
        line = (
            line.body(pitch=deg(-7.0), over=0.5)
            .body(pitch=deg(-11.0), z=0.01, over=0.4)
            .body(pitch=deg(9.0), z=-0.04, over=0.35)
            .body(pitch=0.0, z=0.0, over=0.5)
        )
    for roll in (6.0, -6.0, 4.0):
        line = line.body(roll=deg(roll), over=0.3)
    return line.home(over=0.5)
