"""Side shuffle."""

from typing import Annotated

from motions import Range, Timeline, motion


@motion
def side_shuffle(
    width: Annotated[float, Range(0.08, 0.4, "m")] = 0.2,
    times: Annotated[int, Range(1, 4)] = 2,
) -> Timeline:
    """Side shuffle: quick steps to the left, quick steps to the right."""
    line = Timeline()
    for _ in range(times):
        for side in (1.0, -1.0):
            line = line.side_step(side * width, gait="trot").hold(0.2)
    return line
