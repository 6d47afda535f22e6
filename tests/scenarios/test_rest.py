"""A robot that has walked comes to rest, stays there, and does what it is asked next."""

import math

import numpy as np
import pytest

from controller.sweeps.trials import TrialRobot
from go2_wbc.plant import MujocoPlant
from go2_wbc.plant.mujoco.model import JointDynamics
from tests.scenarios.test_joint_friction import GYM_QUADRUPED

AT_REST = 0.02  #: Speed [m/s] of the CoM of a robot at rest
WATCHED = 2.0  #: Time [s] for which it is looked at


@pytest.mark.parametrize("sensors", ["ideal", "imu"])
@pytest.mark.parametrize(
    ("joints", "speed"), [(None, 0.8), (GYM_QUADRUPED, 0.8), (GYM_QUADRUPED, 1.2)]
)
def test_stop_says_true_of_a_robot_that_stays_at_rest_and_is_ready_for_more(
    joints: JointDynamics | None, speed: float, sensors: str
) -> None:
    """It said so while its trunk still moved at up to 45 mm/s, or never, as its feet were aside."""
    plant = MujocoPlant(joint_dynamics=joints, sensors=sensors)
    with TrialRobot(plant) as robot:
        robot.require(robot.go2.stand())
        robot.require(robot.go2.walk())
        robot.go2.move(speed)
        robot.wait(2.0)
        robot.go2.stop()
        robot.require(robot.go2.last_outcome.ok)
        robot.truth.clear()
        robot.wait(WATCHED)
        assert np.linalg.norm(robot.truth.recording().com_velocity, axis=1).max() < AT_REST
        for call in (robot.go2.high_five, lambda: robot.go2.turn_left(math.pi / 4), robot.go2.sit):
            robot.require(call())
