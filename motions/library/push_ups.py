"""Push-ups."""

from typing import Annotated

from motions import Range, Timeline, deg, motion


@motion
def push_ups(
    times: Annotated[int, Range(1, 10)] = 4,
    depth: Annotated[float, Range(0.04, 0.14, "m")] = 0.12,
) -> Timeline:
    """Push-ups: down and up, as often as you dare."""
    line = Timeline().body(pitch=deg(-4.0), over=0.5)
    for _ in range(times):
        line = line.body(z=-depth, over=0.5).body(z=0.0, over=0.45)
    return line.home(over=0.5)
