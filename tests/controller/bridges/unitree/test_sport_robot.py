"""The robot behind the sport service, in simulation at the pace of the wall clock; needs no DDS."""

from collections.abc import Iterator
from contextlib import closing

import numpy as np
import pytest

from controller.behaviours.plans import ChangePosture
from controller.bridges.unitree import sport_robot
from controller.bridges.unitree.sport_api import Api
from controller.bridges.unitree.sport_robot import SportRobot
from controller.modes import Mode
from go2_wbc.config import Config
from go2_wbc.planning.command import VelocityCommand
from go2_wbc.planning.trunk import LEVEL, BodyPose
from go2_wbc.plant import MujocoPlant
from go2_wbc.robot.model import RobotModel
from tests.controller.bridges.processes import wait_until
from tests.controller.plants import HANG_GUARD

PUSH, PUSH_TIME = 300.0, 0.1  # N, s: feet in place do not hold it
POSE = BodyPose(-0.03, 0.1, -0.1, 0.0)
OFF = 0.05  # rad, with the sway of a stride


@pytest.fixture
def plant() -> Iterator[MujocoPlant]:
    plant = MujocoPlant(friction=0.8)
    yield plant
    plant.close()


@pytest.fixture
def robot(plant: MujocoPlant, monkeypatch: pytest.MonkeyPatch) -> Iterator[SportRobot]:
    """One that stands, without the motions of the library: they take seconds to compile."""
    monkeypatch.setattr(sport_robot, "playable_plans", lambda _model: {})
    robot = SportRobot(plant, Config())
    robot.begin()
    robot.perform(Api.BALANCE_STAND)
    yield robot
    robot.close()


def test_motions_are_for_the_motors_that_are_driven(
    plant: MujocoPlant, monkeypatch: pytest.MonkeyPatch
) -> None:
    models: list[RobotModel] = []
    monkeypatch.setattr(sport_robot, "playable_plans", lambda model: models.append(model) or {})
    with closing(SportRobot(plant, Config(motor="ideal"))) as robot:
        models.append(robot._checker.model)
    assert [np.isinf(model.motor.no_load_speed).all() for model in models] == [True, True]


def test_a_lean_waits_for_steps_for_balance(robot: SportRobot, plant: MujocoPlant) -> None:
    # It leaned in the middle of a step.
    robot._runner.between_ticks(lambda: plant.push(np.array([PUSH, 0.0, 0.0]), PUSH_TIME))
    assert wait_until(lambda: robot.mode is Mode.MOVING, HANG_GUARD)
    were_stepping: list[bool] = []
    run = robot._runner.run

    def watched(behaviour: ChangePosture, limit: float) -> None:
        were_stepping.append(robot._runner.is_stepping)
        run(behaviour, limit)

    robot._runner.run = watched  # type: ignore[method-assign,assignment]
    robot.begin()
    robot.lean_to((0.1, 0.1, 0.0))
    assert were_stepping == [False]
    assert robot.state.rpy[:2] == pytest.approx([0.1, 0.1], abs=OFF)


def test_an_attitude_and_a_height_are_kept_on_the_way_and_end_with_it(robot: SportRobot) -> None:
    before = robot.state.q[2]
    robot.pose = POSE
    assert robot.can_hold(POSE)
    assert not robot.can_hold(BodyPose(roll=0.6))
    robot.begin()
    robot.perform(Api.MOVE)
    robot.steer(VelocityCommand(0.3), 1.0)
    robot._runner.let_pass(2.5)
    assert robot.state.rpy[:2] == pytest.approx([POSE.roll, POSE.pitch], abs=OFF)
    assert robot.state.q[2] - before == pytest.approx(POSE.height, abs=0.015)
    robot.begin()
    robot.perform(Api.BALANCE_STAND)
    assert robot.pose == BodyPose(POSE.height)
    robot.damp()
    assert robot.pose == LEVEL
