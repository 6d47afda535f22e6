"""What a robot that lives on its own sensors is given: late, in steps, biased."""

import numpy as np
import pytest

from go2_wbc.errors import ConfigError
from go2_wbc.plant import MujocoPlant
from go2_wbc.plant.sensors import SensorErrors
from go2_wbc.robot.state import JointCommand
from tests.go2_wbc.plant.helpers import STAND

NONE = dict.fromkeys(SensorErrors.__slots__, 0.0)
SERVO = JointCommand.servo(STAND, np.zeros(12), 60.0, 3.0)
TICKS = 30


def test_a_negative_error_is_refused() -> None:
    with pytest.raises(ConfigError, match="gyro_bias"):
        SensorErrors(gyro_bias=-0.1)


def test_what_is_read_is_as_old_as_the_latency_says() -> None:
    plant = MujocoPlant(sensors="imu", errors=SensorErrors(**{**NONE, "latency": 0.006}))
    true, seen = [], []
    for _ in range(TICKS):
        plant.write(SERVO)
        true.append(plant.truth().q[7:])
        seen.append(plant.read().q[7:])
        assert plant.read().time == plant.time
    assert np.array_equal(seen[3:], true[:-3])
    assert not np.array_equal(seen[3:], true[3:])


def test_encoders_read_in_steps() -> None:
    plant = MujocoPlant(sensors="imu", errors=SensorErrors(**{**NONE, "angle_step": 0.01}))
    for _ in range(TICKS):
        plant.write(SERVO)
    q = plant.read().q[7:]
    assert q == pytest.approx(0.01 * np.rint(q / 0.01), abs=1e-12)
    assert np.abs(q - plant.truth().q[7:]).max() <= 0.005 + 1e-12
    assert not np.array_equal(q, plant.truth().q[7:])


def test_its_world_begins_where_it_lies_and_anew_where_it_is_placed() -> None:
    plant = MujocoPlant(sensors="imu", initial_yaw=2.0, errors=SensorErrors(**NONE))
    state = plant.read()
    assert state.q[:2] == pytest.approx([0.0, 0.0], abs=1e-6)
    assert state.yaw == pytest.approx(0.0, abs=1e-3)
    assert plant.truth().yaw == pytest.approx(2.0, abs=0.05)
    assert state.rpy[:2] == pytest.approx(plant.truth().rpy[:2], abs=0.01)
    plant = MujocoPlant(sensors="imu")
    q = plant.truth().q
    q[:3] += [1.0, 2.0, 0.0]
    plant.place(q)
    assert np.abs(plant.read().q[:2]).max() < 0.01
    assert plant.truth().q[:2] == pytest.approx(q[:2])
