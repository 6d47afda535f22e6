"""What a robot that lives on its own sensors is given: late, in steps, biased."""

from dataclasses import replace

import numpy as np
import pinocchio as pin
import pytest

from go2_wbc.errors import ConfigError
from go2_wbc.plant import MujocoPlant
from go2_wbc.plant.sensors import ImuSample, SensorErrors, SensorNoise
from go2_wbc.robot.rotations import log_rotation, rotation_from_rpy
from go2_wbc.robot.state import JointCommand
from tests.engine_helpers import standing_q, state_of
from tests.go2_wbc.plant.helpers import STAND

NONE = dict.fromkeys(SensorErrors.__slots__, 0.0)
SERVO = JointCommand.servo(STAND, np.zeros(12), 60.0, 3.0)
TICKS = 30


def test_noise_has_no_mean_and_the_deviation_that_is_given() -> None:
    noise, rng, n = SensorNoise(), np.random.default_rng(0), 600
    q = standing_q()
    q[3:7] = pin.Quaternion(rotation_from_rpy(0.3, -0.2, 2.5)).coeffs()
    true = replace(state_of(q), foot_forces=np.full(4, 40.0))
    imu = ImuSample(q[3:7], np.array([0.1, 0.2, -0.3]), np.array([0.0, 1.0, 9.8]))
    seen = [noise.corrupt_state(true, rng) for _ in range(n)]
    felt = [noise.corrupt_imu(imu, rng) for _ in range(n)]
    q_off, v_off = (np.array([getattr(s, x) - getattr(true, x) for s in seen]) for x in "qv")
    off = np.array([[s.gyro - imu.gyro, s.accelerometer - imu.accelerometer] for s in felt])
    attitudes = [s.q[3:7] for s in seen], [s.quaternion for s in felt]
    for found in attitudes:
        turns = [pin.Quaternion(xyzw).matrix() for xyzw in found]
        turned = [log_rotation(true.R_world_base.T @ R) for R in turns]
        assert_deviates(np.array(turned), noise.orientation)
        np.testing.assert_allclose(np.linalg.norm(found, axis=1), 1.0)
    assert_deviates(q_off[:, :3], noise.position)
    assert_deviates(q_off[:, 7:], noise.joint_position)
    assert_deviates(v_off[:, :3], noise.linear_velocity)
    assert_deviates(v_off[:, 3:6], noise.gyro)
    assert_deviates(v_off[:, 6:], noise.joint_velocity)
    assert_deviates(off[:, 0], noise.gyro)
    assert_deviates(off[:, 1], noise.accelerometer)
    assert_deviates(np.array([s.foot_forces for s in seen]) - 40.0, noise.foot_force)


def assert_deviates(errors: np.ndarray, deviation: float) -> None:
    """Within five deviations of what a sample of that size finds itself."""
    n = len(errors)
    assert np.abs(errors.mean(axis=0)).max() < 5.0 * deviation / np.sqrt(n)
    assert errors.std(axis=0) == pytest.approx(deviation, rel=5.0 / np.sqrt(2.0 * n))


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
