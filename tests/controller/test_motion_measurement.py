"""What is measured of a played motion is what happened in it, and nothing beside it."""

from contextlib import closing

import numpy as np
import pytest

from controller.go2_controller import GO2Controller
from controller.modes import Mode
from controller.motion_measurement import FELL, SETTLED_CONTACT, _slip, failures_of, measure_motion
from go2_wbc.legs import Leg
from go2_wbc.motion_plan import MotionPlan
from go2_wbc.plant import MujocoPlant
from go2_wbc.plant.mujoco.ground_truth import GroundTruth
from go2_wbc.robot.model import RobotModel
from motions import CompiledPlan, Timeline, compile_timeline, deg
from tests.controller.test_motion_measurement_written import PERIOD, touchdown
from tests.go2_wbc.plant.helpers import empty_recording

SKID = 0.5  # m/s


def slip(plan: MotionPlan, start: float, end: float) -> float:
    """What counts as slip if the right front foot slides between two times [s]."""
    n = round(plan.duration / PERIOD) + 1
    velocity = np.zeros((n, 4, 3))
    velocity[round(start / PERIOD) : round(end / PERIOD), Leg.FR, 0] = SKID
    return _slip(empty_recording(n, velocity), plan, PERIOD)


def test_a_standing_foot_that_slides_counts_by_its_way(raised: CompiledPlan) -> None:
    start = PERIOD * touchdown(raised) + SETTLED_CONTACT + 5 * PERIOD
    assert slip(raised, start, start + 0.02) == pytest.approx(SKID * 0.02)


def test_a_foot_in_the_air_or_just_landed_may_move(raised: CompiledPlan) -> None:
    landed = PERIOD * touchdown(raised)
    assert slip(raised, landed - 0.1, landed + SETTLED_CONTACT - PERIOD) == 0.0


def test_a_played_motion_is_measured_from_its_begin_to_its_end(
    raised: CompiledPlan, model: RobotModel
) -> None:
    with closing(GroundTruth(MujocoPlant())) as truth, GO2Controller(plant=truth) as go2:
        assert go2.stand()
        found = measure_motion(go2, truth, raised, model)
    assert found.ok, found.reason
    assert 0.0 < found.slip < 0.005
    assert 0.0 < found.tracking < 0.02
    assert 0.0 < found.torque < 1.0
    assert found.touched == found.stopped == 0.0
    assert 0.0 < found.trunk_off < 0.02
    assert 0.0 < found.turned_off < 0.1
    assert 0.0 < found.paw_off < 0.03
    assert 0.0 < found.landed_off < 0.01
    assert found.as_dict() == {
        "ok": True,
        **{name: getattr(found, name) for name in found.__slots__},
    }
    assert [unit for _, _, unit in found.lines()] == ["mm", "mm", "%", "%", "rad"]


def test_a_robot_that_goes_limp_has_fallen_before_it_lies(
    model: RobotModel, monkeypatch: pytest.MonkeyPatch
) -> None:
    """`play` returns as it lets go: tilted, but not yet on the ground."""
    head_down = Timeline(name="head down").body(pitch=deg(28.0), z=-0.1, over=1.0).hold(0.6)
    plan = compile_timeline(head_down.home(over=1.0), model)
    monkeypatch.setattr(GroundTruth, "fall", lambda _truth: None)
    with (
        closing(GroundTruth(MujocoPlant(friction=0.5))) as truth,
        GO2Controller(plant=truth) as go2,
    ):
        assert go2.stand()
        found = measure_motion(go2, truth, plan, model)
        assert go2.mode in (Mode.FALLEN, Mode.DAMPED)
    assert found.fall == found.reason
    assert "fell" in str(found.fall)
    assert FELL in failures_of(found, plan)
