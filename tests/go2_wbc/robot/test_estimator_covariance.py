"""How sure the estimator is of the base: its algebra by finite differences, and against truth."""

import numpy as np
import pinocchio as pin
import pytest

from controller import GO2Controller
from go2_wbc.plant import MujocoPlant
from go2_wbc.plant.mujoco.ground_truth import GroundTruth
from go2_wbc.plant.sensors import EXACT, SensorNoise
from go2_wbc.robot.estimator import EstimatorConfig, StateEstimator
from go2_wbc.robot.model import RobotModel
from go2_wbc.robot.state_filter import Estimate
from tests.engine_helpers import standing_reading

P_BASE_IMU = np.array([-0.02557, 0.0, 0.04232])  # m; the URDF's imu_joint
GYRO_READING = np.array([0.4, -0.3, 0.5])
NUDGE = 1e-6
DERIVED = 1e-6  # of covariances of order 1
LEAST, MOST = 0.1, 2.5  # of an error's root mean square over the deviation that is stated


def base(x: Estimate, error: np.ndarray, gyro: np.ndarray) -> tuple[np.ndarray, ...]:
    """Position, orientation, linear and angular velocity of the base if ``x`` is off by that."""
    R = pin.exp3(error[6:9]) @ pin.Quaternion(x.quaternion).toRotationMatrix()
    w = gyro - (x.gyro_bias + error[9:12])
    v = R.T @ (x.v + error[3:6])
    return x.p + error[:3] - R @ P_BASE_IMU, R, v - np.cross(w, P_BASE_IMU), w


def test_the_covariance_of_the_base_is_that_of_the_errors_of_the_filter() -> None:
    rng, estimator = np.random.default_rng(3), StateEstimator(RobotModel())
    estimator.update(standing_reading(gyro=GYRO_READING, foot_forces=np.zeros(4)))
    saved = estimator.save()
    root = rng.normal(size=(27, 27))
    P, x = saved["state"].filter.P, saved["state"].filter.x
    P[:], x.v[:] = root @ root.T / 27, rng.normal(size=3)
    x.quaternion[:] = pin.Quaternion(pin.exp3(rng.normal(size=3))).coeffs()
    estimator.restore(saved)
    p, R, v, w = base(x, np.zeros(27), GYRO_READING)
    of_pose, of_twist, of_noise = np.empty((6, 27)), np.empty((6, 27)), np.empty((6, 3))
    for i in range(27):
        p_i, R_i, v_i, w_i = base(x, NUDGE * np.eye(27)[i], GYRO_READING)
        of_pose[:, i] = np.concatenate([p_i - p, pin.log3(R_i @ R.T)]) / NUDGE
        of_twist[:, i] = np.concatenate([v_i - v, w_i - w]) / NUDGE
    for i in range(3):
        _, _, v_i, w_i = base(x, np.zeros(27), GYRO_READING + NUDGE * np.eye(3)[i])
        of_noise[:, i] = np.concatenate([v_i - v, w_i - w]) / NUDGE
    gyro = EstimatorConfig().gyro ** 2 * of_noise @ of_noise.T
    covariance = estimator.covariance()
    np.testing.assert_allclose(covariance.pose, of_pose @ P @ of_pose.T, atol=DERIVED)
    expected = of_twist @ P @ of_twist.T + gyro
    np.testing.assert_allclose(covariance.twist, expected, atol=DERIVED)


@pytest.mark.slow
def test_the_deviations_stated_are_of_the_size_of_the_errors_of_a_trot() -> None:
    plant = MujocoPlant(sensors="imu", seed=6)
    recorder = GroundTruth(plant)
    errors, deviations = [], []

    def note() -> None:
        seen, true, stated = plant.read(), plant.truth(), plant.odometry_covariance
        turn = pin.log3(seen.R_world_base @ true.R_world_base.T)[:2]
        errors.append([*(seen.v[:6] - true.v[:6]), *turn])
        twist, pose = np.diag(stated.twist), np.diag(stated.pose)
        deviations.append(np.sqrt([*twist, *pose[3:5]]))

    with GO2Controller(plant=recorder) as go2:
        assert go2.stand()
        assert go2.walk()
        go2.move(0.5)
        go2.wait(1.5)
        recorder.on_tick = note
        go2.wait(3.0)
    plant.close()
    ratio = np.sqrt(np.mean(np.square(errors), axis=0) / np.mean(np.square(deviations), axis=0))
    assert (ratio > LEAST).all(), ratio
    assert (ratio < MOST).all(), ratio


def test_a_plant_says_how_sure_its_reading_is() -> None:
    plants = {kind: MujocoPlant(sensors=kind) for kind in ("ideal", "noisy", "imu")}
    exact, noisy, estimated = (plant.odometry_covariance for plant in plants.values())
    np.testing.assert_allclose(exact.pose, EXACT**2 * np.eye(6))
    np.testing.assert_allclose(exact.twist, EXACT**2 * np.eye(6))
    noise = SensorNoise()
    pose, twist = (noise.position, noise.orientation), (noise.linear_velocity, noise.gyro)
    np.testing.assert_allclose(np.diag(noisy.pose), np.repeat(pose, 3) ** 2)
    np.testing.assert_allclose(np.diag(noisy.twist), np.repeat(twist, 3) ** 2)
    for part in (estimated.pose, estimated.twist):
        np.testing.assert_allclose(part, part.T, atol=1e-15)
        assert (np.linalg.eigvalsh(part) > 0.0).all()
    for plant in plants.values():
        plant.close()
