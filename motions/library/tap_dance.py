"""Tap dance."""

from typing import Annotated

from motions import Range, Timeline, motion


@motion
def tap_dance(
    tempo: Annotated[float, Range(40.0, 100.0, "beats/min")] = 80.0,
    bars: Annotated[int, Range(1, 4)] = 2,
) -> Timeline:
    """Tap dance: two taps right, two taps left, to the beat."""
    line = Timeline().bpm(tempo)
    for _ in range(bars):
        for foot in ("FR", "FL"):
            line = line.unweight(foot, over=1.0)
            for _ in range(2):
                line = line.foot(foot, z=0.05, over=0.5).down(foot, over=0.5)
    return line.home(over=1.0)
