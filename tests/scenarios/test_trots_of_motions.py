"""A trot of a motion stays on its plan while the trunk moves, as MuJoCo's truth tells."""

import math

import pytest

from benchmarks.robots import checker
from benchmarks.validation_set.physics import play
from controller.motion_measurement import failures_of
from motions import Timeline, deg

OFF, TURNED = 0.009, math.radians(5.0)  # [m], [rad]; 30 mm and 8 deg count as failed

BACKWARD = Timeline().walk(-0.41, turn=deg(-93.0), gait="trot")
ROLLING = Timeline().hold(0.66).body(roll=deg(-26.0), over=1.5).body(roll=deg(22.0), over=1.5)
AHEAD = Timeline().walk(0.43, -0.14, turn=deg(-43.0), gait="trot")
TOSSED = Timeline().hold(0.56).body(roll=deg(31.0), over=0.35).body(roll=deg(-32.0), over=0.35)


@pytest.mark.parametrize(
    ("way", "leans", "home"),
    [(BACKWARD, ROLLING, 1.5), (AHEAD, TOSSED, 0.35)],
    ids=["slowly", "fast"],
)
def test_a_trot_whose_trunk_rolls_stays_near_its_plan(
    way: Timeline, leans: Timeline, home: float
) -> None:
    """The slow one came aside, and once fell; friction made the fast one's trunk lag by 9 deg."""
    plan = checker().plan(Timeline().together(way, leans.home(over=home)))
    run = play(plan, checker().model, 0)
    assert not failures_of(run, plan)
    assert run.trunk_off < OFF
    assert run.turned_off < TURNED
