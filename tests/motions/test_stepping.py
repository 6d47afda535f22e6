"""Steps: where feet land, what counts from there, and that the robot does it."""

from __future__ import annotations

import numpy as np
import pytest

from controller import GO2Controller
from go2_wbc.errors import TimelineError
from go2_wbc.legs import LEGS, Leg
from go2_wbc.reference import Anchor
from go2_wbc.robot.model import RobotModel
from motions import FeasibilityChecker, Timeline, compile_timeline, deg
from motions.footing import standing_feet
from motions.trajectory import trajectory_of

MODEL = RobotModel()
NOMINAL = standing_feet(MODEL)
EXACT = 1e-6  # m, rad; of a spline through samples
PLACED = 0.015  # m; how near its place a foot lands in simulation


def last_feet(line: Timeline) -> np.ndarray:
    return trajectory_of(compile_timeline(line, MODEL), MODEL).p_feet[-1]


def test_a_foot_that_steps_lands_where_the_step_says_and_the_others_stay() -> None:
    feet = last_feet(Timeline().step("FL", 0.06, 0.03, over=0.6).home(over=0.8))
    assert feet - NOMINAL == pytest.approx(
        np.array([[0.06, 0.03, 0], *np.zeros((3, 3))]), abs=EXACT
    )


def test_a_robot_that_steps_lands_the_foot_where_the_step_says() -> None:
    line = Timeline().step("FL", 0.06, 0.03, over=0.6).home(over=0.8)
    plan = FeasibilityChecker().plan(line)
    with GO2Controller() as go2:
        go2.stand()
        anchor = Anchor.of_feet(MODEL.snapshot(go2.state).p_world_feet, MODEL.foot_radius)
        assert go2.play(plan)
        landed = MODEL.snapshot(go2.state).p_world_feet[Leg.FL]
    planned = plan.at(plan.duration).placed(anchor).p_world_feet[Leg.FL]
    assert np.linalg.norm((landed - planned)[:2]) < PLACED


def test_home_is_above_the_feet_as_they_stand_by_then() -> None:
    line = Timeline()
    for leg in LEGS:
        line = line.step(leg, 0.05, over=0.4)
    plan = compile_timeline(line.home(over=0.8), MODEL)
    start, end = plan.at(0.0).body.p_world, plan.at(plan.duration).body.p_world
    assert plan.end_pose == pytest.approx((0.05, 0.0, 0.0), abs=EXACT)
    assert end - start == pytest.approx([0.05, 0.0, 0.0], abs=EXACT)


def test_a_foot_that_has_stepped_is_put_down_where_it_stands_by_then() -> None:
    line = Timeline().step("FR", 0.05, -0.02, over=0.5)
    line = line.foot("FR", x=0.03, z=0.08, over=0.5).down("FR", over=0.5).home(over=0.8)
    assert last_feet(line)[Leg.FR] - NOMINAL[Leg.FR] == pytest.approx([0.05, -0.02, 0], abs=EXACT)


def test_a_step_may_go_round_the_middle_of_the_feet() -> None:
    line = Timeline().step("RR", yaw=deg(10), over=0.5).home(over=0.8)
    p, turned = NOMINAL[Leg.RR], last_feet(line)[Leg.RR]
    assert np.arctan2(turned[1], turned[0]) - np.arctan2(p[1], p[0]) == pytest.approx(deg(10))


def test_a_raised_foot_does_not_step() -> None:
    line = Timeline().foot("FL", z=0.05, over=0.5)
    with pytest.raises(TimelineError, match=r"step\(\): foot FL is raised: put it down\(\) before"):
        line.step("FL", 0.05, over=0.5)
