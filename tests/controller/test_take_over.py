"""``take_over``: a robot that stands already is balanced from how it stands, or an honest False."""

import re
from collections.abc import Callable

import numpy as np
import pinocchio as pin
import pytest
from jaxtyping import Float

from controller import GO2Controller, Mode
from go2_wbc.plant import MujocoPlant
from go2_wbc.robot.model import RobotModel
from motions.postures import standing_feet, standing_on
from tests.controller.plants import HANG_GUARD, in_thread

SLIDES = 0.01  #: m; a foot that stays moves by less: it rolls by a few mm as the trunk rises
OFF = np.random.default_rng(9600).uniform(-0.05, 0.05, (4, 2))  #: m; feet off square


def stance(
    model: RobotModel,
    height: float = 0.28,
    yaw: float = 0.0,
    off: Float[np.ndarray, "4 2"] | float = 0.0,
    raised: float = 0.0,
) -> Float[np.ndarray, "19"]:
    """A robot on four feet with its CoM at ``height`` [m], lifted as a whole by ``raised`` [m]."""
    feet, R = standing_feet(model), pin.rpy.rpyToMatrix(0.0, 0.0, yaw)
    feet[:, :2] += off
    p_base, q_joints = standing_on(feet @ R.T, np.array([0.0, 0.0, height]), R, model)
    p_base[2] += raised
    return np.concatenate([p_base, pin.Quaternion(R).coeffs(), q_joints])


STANCES = {"low": (0.24, 0.0, 0.0), "high": (0.31, -2.5, 0.0), "off square": (0.27, 1.0, OFF)}


@pytest.mark.parametrize("sensors", ["ideal", "noisy", "imu"])
@pytest.mark.parametrize("how", STANCES)
def test_a_robot_that_stands_is_balanced_where_it_stands(
    how: str, sensors: str, model: RobotModel
) -> None:
    plant = MujocoPlant(sensors=sensors, seed=9601)
    plant.place(stance(model, *STANCES[how]))
    before, yaw = plant.p_world_feet, plant.truth().rpy[2]
    with GO2Controller(plant=plant) as go2:
        assert go2.take_over(), go2.last_outcome.reason
        assert np.abs(plant.p_world_feet - before)[:, :2].max() < SLIDES
        turn = 0.02 if how != "off square" else 0.1  # the trunk looks where the feet do
        assert plant.truth().rpy[2] == pytest.approx(yaw, abs=turn)
        assert go2.recording().q[:, 2].min() > 0.24, "it did not lie down before"
        assert (go2.mode, go2.health.faults) == (Mode.STANDING, ())
        assert go2.take_over(), "one that it balances stands on"
        if how == "off square":
            assert go2.high_five(), go2.last_outcome.reason


def test_in_realtime_too_and_after_another_controller(model: RobotModel) -> None:
    plant = MujocoPlant(control_period=0.004)
    plant.place(stance(model))
    for _ in range(2):
        with GO2Controller(plant=plant, realtime=True) as go2:
            assert in_thread(go2.take_over).result(HANG_GUARD), go2.last_outcome.reason


def hung_up(plant: MujocoPlant, model: RobotModel) -> None:
    plant.place(stance(model, raised=0.1))


def sitting(plant: MujocoPlant, _: RobotModel) -> None:
    with GO2Controller(plant=plant) as go2:
        assert go2.sit()


def walking(plant: MujocoPlant, _: RobotModel) -> None:
    with GO2Controller(plant=plant) as go2:
        assert go2.walk()
        go2.move(0.8)
        go2.wait(1.0)


REFUSED: dict[str, Callable[[MujocoPlant, RobotModel], None]] = {
    r"it lies, its base 0\.\d\d m": lambda *_: None,
    "FL and FR and RL and RR in the air": hung_up,
    r"trunk is tilted by [34]\d deg": sitting,
    r"moves at 0\.\d\d m/s|F. and R. in the air": walking,
}


@pytest.mark.parametrize("reason", REFUSED)
@pytest.mark.parametrize("sensors", ["ideal", "imu"])
def test_one_that_does_not_stand_stays_limp_and_says_why(
    reason: str, sensors: str, model: RobotModel
) -> None:
    plant = MujocoPlant(sensors=sensors, seed=9602)
    REFUSED[reason](plant, model)
    with GO2Controller(plant=plant) as go2:
        mode = go2.mode
        assert not go2.take_over()
        assert go2.mode is mode
        assert set(go2.recording().labels) == {"lying"}, "nothing was tried"
        assert re.search(reason, go2.last_outcome.reason), go2.last_outcome.reason
