"""Footing: the places of the feet between and after steps, and the frame that the trunk follows."""

import numpy as np
import pytest

from go2_wbc.legs import Leg
from go2_wbc.robot.model import RobotModel
from go2_wbc.robot.rotations import yaw_rotation
from motions import Timeline, deg
from motions.language.footing import Footing
from motions.plan.quasi_static import compile_quasi_static
from motions.postures import standing_feet

MODEL = RobotModel()
NOMINAL = standing_feet(MODEL)
EXACT = 1e-9
RIPPLE = 0.08  # share of the speed; minimum jerk over a round, pairs half a round apart, has 6 %


def test_a_swing_begins_and_ends_at_rest_and_rises_to_its_height() -> None:
    footing = Footing(Timeline(balance=False).step("FL", 0.1, over=0.4, height=0.06), NOMINAL)
    times, dt = np.linspace(0.0, 0.4, 401), 0.001
    way = footing.place(Leg.FL, times)
    assert (way[:, 2] - NOMINAL[Leg.FL, 2]).max() == pytest.approx(0.06, abs=EXACT)
    assert np.abs(np.diff(way, axis=0)[[0, -1]]).max() < 1e-6
    assert np.abs(np.diff(way, 2, axis=0)[[0, -1]]).max() / dt**2 < 1.0  # m/s^2, of 30
    assert way[-1] - NOMINAL[Leg.FL] == pytest.approx([0.1, 0.0, 0.0], abs=EXACT)


def test_the_frame_goes_evenly_and_turns_on_beyond_half_a_turn() -> None:
    line = Timeline().walk(0.96, gait="trot")
    times = np.linspace(0.0, line.end, 2000)
    x = Footing(line, NOMINAL).frames(times)[:, 0]
    speed = np.gradient(x, times)[(x > 0.24) & (x < 0.72)]
    assert np.ptp(speed) / 2 < RIPPLE * speed.mean()
    line = Timeline().turn(deg(270), gait="trot")
    yaw = Footing(line, NOMINAL).frames(np.linspace(0.0, line.end, 500))[:, 2]
    assert yaw[-1] == pytest.approx(deg(270))
    assert np.diff(yaw).min() > -EXACT


def test_a_stretch_may_start_from_feet_anywhere() -> None:
    start = NOMINAL @ yaw_rotation(deg(40)).T + np.array([1.0, -0.5, 0.0])
    plan = compile_quasi_static(Timeline().walk(0.1, gait="trot"), MODEL, start)
    ahead = yaw_rotation(deg(40)) @ np.array([0.1, 0.0, 0.0])
    assert plan.at(0.0).p_world_feet == pytest.approx(start, abs=1e-6)
    assert plan.end_pose == pytest.approx((1.0 + ahead[0], -0.5 + ahead[1], deg(40)), abs=1e-6)
    assert plan.at(0.0).body.p_world[:2] == pytest.approx([1.0, -0.5], abs=1e-3)
