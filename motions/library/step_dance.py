"""Step dance."""

from typing import Annotated

from motions import Range, Timeline, deg, motion


@motion
def step_dance(
    tempo: Annotated[float, Range(90.0, 140.0, "bpm")] = 120.0,
    bars: Annotated[int, Range(1, 8)] = 2,
) -> Timeline:
    """Step dance: two steps aside and back on the beat, rolling into them, a turn and a paw."""
    line = Timeline().bpm(tempo)
    for _ in range(bars):
        for side in (1.0, -1.0):
            aside = Timeline().bpm(tempo).side_step(0.08 * side, gait="trot")
            beats = aside.end * tempo / 60.0
            lean = Timeline().bpm(tempo).body(roll=deg(-5.0 * side), over=beats / 2.0)
            line = line.together(aside, lean.body(roll=0.0, over=beats / 2.0))
    line = line.turn(deg(45), gait="trot").turn(deg(-45), gait="trot")
    return line.foot("FR", x=0.06, z=0.12, over=2).down("FR", over=2).home(over=2)
