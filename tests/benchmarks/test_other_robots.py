"""The benchmark of other people's robots: what a run counts."""

from __future__ import annotations

import pytest

from benchmarks import other_robots
from benchmarks.other_robots import CALLS, ROBOTS, SENSED, Robot, measure
from controller.sweeps.trials import Trial
from go2_wbc.plant.mujoco.model import JointDynamics

TUNING_SEED = 7500


@pytest.fixture
def short(monkeypatch: pytest.MonkeyPatch) -> None:
    """Trots of a second."""
    monkeypatch.setattr(other_robots, "RAMP_UP", 0.6)
    monkeypatch.setattr(other_robots, "TROT", 0.5)


@pytest.mark.usefixtures("short")
def test_a_robot_that_does_it_all_has_every_value() -> None:
    robot = Robot("any", "as the controller knows it", JointDynamics(), "imu")
    measured = measure(Trial(0), robot, TUNING_SEED)
    assert measured.reason == ""
    assert set(measured.values) == {metric.name for metric in robot.metrics}
    assert all(measured.values[f"any.{call}"] == 1.0 for call in CALLS)


@pytest.mark.usefixtures("short")
def test_what_comes_after_a_call_that_fails_is_not_done() -> None:
    stuck = Robot("any", "joints that hardly move", JointDynamics(friction_loss=(12.0, 12.0, 12.0)))
    measured = measure(Trial(0), stuck, TUNING_SEED)
    assert measured.reason != ""
    assert measured.values["any.high-five"] == 0.0


def test_every_robot_is_tried_on_its_own_sensors_too() -> None:
    assert [robot.joints for robot in SENSED] == [robot.joints for robot in ROBOTS]
    assert all(robot.sensors == "imu" for robot in SENSED)
