"""What the robot is not told of, and other people's robots: what a run counts."""

from dataclasses import replace
from functools import partial

import pytest

from benchmarks import unknown_world
from benchmarks.study import IDEAL, IMU, TrialResult
from benchmarks.unknown_world import (
    CALLS,
    ROBOTS,
    WORLDS,
    Robot,
    Unknown,
    measure_robot,
    measure_world,
)
from go2_wbc.plant.mujoco.model import JointDynamics
from go2_wbc.plant.terrain import Stairs

TUNING_SEED = 7500
QUICK = Unknown("any", "level ground", time=0.6)


def measured(world: Unknown) -> TrialResult:
    """Of one trial of the seeds for tuning."""
    measure = partial(measure_world, unknown=world, first_seed=0)
    return replace(world.study, measure=measure).run(0)


def asked(robot: Robot, sensors: str = IDEAL) -> TrialResult:
    """The same of a robot."""
    measure = partial(measure_robot, robot=robot, first_seed=TUNING_SEED)
    return replace(robot.study, measure=measure, sensors=sensors).run(0)


def test_a_run_is_done_by_a_robot_that_walks_and_stands_again_and_by_none_at_a_wall() -> None:
    done = measured(QUICK)
    assert done.values["any.done"] == 1.0
    assert set(done.values) == {metric.name for metric in QUICK.study.metrics}
    wall = replace(QUICK, settings={"terrain": Stairs(height=0.4, count=1, start=0.5)}, time=1.5)
    failed = measured(wall)
    assert failed.values["any.done"] == 0.0
    assert failed.failures == {"any.done": failed.reason}


def test_a_payload_is_judged_by_the_height_and_tilt_of_the_trunk() -> None:
    aside = replace(QUICK, settings={"payload": 1.0, "payload_place": (0.0, 0.1, 0.1)})
    done = measured(aside)
    assert set(done.values) == {metric.name for metric in aside.study.metrics}
    assert done.values["any.tilt"] > 0.05


def test_every_trial_has_a_plant_of_its_own(monkeypatch: pytest.MonkeyPatch) -> None:
    seen = []
    monkeypatch.setattr(unknown_world, "MujocoPlant", lambda **settings: seen.append(settings))
    boxes = next(world for world in WORLDS if world.name == "boxes")
    for seed in (1, 2):
        boxes.plant(seed)
    first, second = seen
    assert all(first[name] != second[name] for name in ("friction", "mass_scale", "terrain"))


def test_on_its_own_sensors_a_robot_is_not_given_the_truth() -> None:
    plant = QUICK.plant(0, IMU)
    assert plant.read().q[2] != plant.truth().q[2]
    assert QUICK.plant(0).read().q[2] == QUICK.plant(0).truth().q[2]
    names = {scenario.name for scenario in unknown_world.STUDIES}
    assert {f"sensed-{one.name}" for one in (*WORLDS, *ROBOTS)} < names


@pytest.fixture
def short(monkeypatch: pytest.MonkeyPatch) -> None:
    """Trots of a second."""
    monkeypatch.setattr(unknown_world, "ROBOT_RAMP_UP", 0.6)
    monkeypatch.setattr(unknown_world, "ROBOT_TROT", 0.5)


@pytest.mark.usefixtures("short")
def test_what_comes_after_a_call_that_fails_is_not_done_and_all_that_was_has_its_value() -> None:
    robot = Robot("any", "as the controller knows it", JointDynamics())
    found = asked(robot, IMU)
    assert found.reason == ""
    assert set(found.values) == {metric.name for metric in robot.study.metrics}
    assert all(found.values[f"any.{call}"] == 1.0 for call in CALLS)
    stuck = Robot("any", "joints that hardly move", JointDynamics(friction_loss=(12.0, 12.0, 12.0)))
    found = asked(stuck)
    assert found.reason != ""
    assert found.values["any.high-five"] == 0.0
