"""The filter's steps against matrices, and its Jacobian against finite differences."""

from __future__ import annotations

import numpy as np
import pinocchio as pin
import pytest

from go2_wbc.robot.estimator_config import EstimatorConfig
from go2_wbc.robot.state_filter import (
    ERROR,
    FEET,
    FORCE_BIAS,
    GYRO_BIAS,
    HEADING,
    THETA,
    VELOCITY,
    Estimate,
    EstimateError,
    Filter,
    correct,
    learn_in_part,
    predict,
    process_noise,
    take_in,
    take_in_one,
    turn_world_about_robot,
)

STEP, GRAVITY = 0.002, 9.81
NUDGE = 1e-6
DERIVED = 3e-5  # of a Jacobian of order 1: R in the middle of the step is taken for constant
EXACT = 1e-12


def somewhere(seed: int) -> Filter:
    """A filter in the middle of something, and unsure."""
    rng, f = np.random.default_rng(seed), Filter()
    f.x.row[:] = rng.normal(size=len(f.x.row))
    f.x.quaternion[:] = pin.Quaternion(pin.exp3(rng.normal(size=3))).coeffs()
    root = rng.normal(size=(ERROR, ERROR))
    f.P[:] = root @ root.T / ERROR
    return f


def orientation(x: Estimate) -> np.ndarray:
    return pin.Quaternion(x.quaternion).toRotationMatrix()


def off(a: Estimate, b: Estimate) -> np.ndarray:
    """The error by which ``a`` is off ``b``."""
    error = EstimateError(theta=pin.log3(orientation(a) @ orientation(b).T))
    for name in ("p", "v", "gyro_bias", "force_bias", "p_feet"):
        getattr(error, name)[:] = getattr(a, name) - getattr(b, name)
    return error.row


def moved_by(f: Filter, error: np.ndarray) -> Filter:
    """The same with the estimate corrected by ``error``."""
    other = Filter.of(f.row.copy())
    other.error[:] = error
    correct(other)
    return other


def predicted(f: Filter, gyro: np.ndarray, force: np.ndarray, noise: np.ndarray) -> Filter:
    other = Filter.of(f.row.copy())
    predict(other, STEP, gyro - other.x.gyro_bias, force, GRAVITY, np.empty((3, 3)), noise)
    return other


def test_parts_of_the_error_are_where_they_are_said_to_be() -> None:
    assert (VELOCITY, THETA, GYRO_BIAS, FORCE_BIAS, FEET) == (3, 6, 9, 12, 15)
    assert (HEADING, ERROR) == (8, 27)


def test_a_correction_adds_the_error() -> None:
    f, error = somewhere(1), 0.1 * np.random.default_rng(2).normal(size=ERROR)
    np.testing.assert_allclose(off(moved_by(f, error).x, f.x), error, atol=EXACT)


def test_the_state_moves_as_an_imu_says() -> None:
    f, none = somewhere(3), np.zeros(ERROR)
    gyro, force = np.array([0.4, -0.3, 0.5]), np.array([1.0, -2.0, 9.0])
    turning, R = gyro - f.x.gyro_bias, orientation(f.x)
    middle = R @ pin.exp3(0.5 * STEP * turning)
    a = middle @ (force - f.x.force_bias) - [0.0, 0.0, GRAVITY]
    x = predicted(f, gyro, force, none).x
    np.testing.assert_allclose(orientation(x), R @ pin.exp3(STEP * turning), atol=EXACT)
    np.testing.assert_allclose(x.v, f.x.v + STEP * a, atol=EXACT)
    np.testing.assert_allclose(x.p, f.x.p + STEP * f.x.v + 0.5 * STEP**2 * a, atol=EXACT)
    for name in ("gyro_bias", "force_bias", "p_feet"):
        np.testing.assert_array_equal(getattr(x, name), getattr(f.x, name))


def test_the_covariance_moves_by_the_jacobian_and_the_noise() -> None:
    f, noise = somewhere(4), np.random.default_rng(5).uniform(0.1, 1.0, size=ERROR)
    gyro, force = np.array([0.4, -0.3, 0.5]), np.array([1.0, -2.0, 9.0])
    ends = [
        [predicted(moved_by(f, way * e), gyro, force, noise).x for way in (1.0, -1.0)]
        for e in NUDGE * np.eye(ERROR)
    ]
    F = np.column_stack([off(*pair) / (2.0 * NUDGE) for pair in ends])
    P = predicted(f, gyro, force, noise).P
    np.testing.assert_allclose(P, F @ f.P @ F.T + np.diag(noise), atol=DERIVED)
    np.testing.assert_array_equal(P, P.T)
    assert np.abs(F - np.eye(ERROR)).max() > 1e-2


def test_the_noise_is_that_of_the_sensors() -> None:
    c, noise = EstimatorConfig(), np.full(ERROR, np.nan)
    process_noise(c, STEP, noise)
    expected = EstimateError()
    expected.p[:] = 0.5 * c.acceleration * STEP**2
    expected.v[:], expected.theta[:] = c.acceleration * STEP, c.gyro * STEP
    expected.gyro_bias[:] = c.gyro_bias_walk * STEP**0.5
    expected.force_bias[:] = c.accelerometer_bias_walk * STEP**0.5
    np.testing.assert_allclose(noise, expected.row**2, rtol=1e-12)


def test_numbers_are_taken_in_as_by_the_matrices() -> None:
    f, rng = somewhere(6), np.random.default_rng(7)
    H, innovations, variances = np.zeros((3, ERROR)), rng.normal(size=3), np.array([0.1, 0.4, 2.0])
    H[0, [15, 0, 7, 8]], H[1, [3, 7, 8]], H[2, 11] = rng.normal(size=4), rng.normal(size=3), 1.0
    K = f.P @ H.T @ np.linalg.inv(H @ f.P @ H.T + np.diag(variances))
    error, P = K @ innovations, f.P - K @ H @ f.P
    for row, innovation, variance in zip(H[:2], innovations, variances, strict=False):
        places = np.flatnonzero(row)
        take_in(f, places, row[places], len(places), innovation, variance)
    take_in_one(f, 11, innovations[2], variances[2])
    np.testing.assert_allclose(f.error, error, atol=1e-10)
    np.testing.assert_allclose(f.P, P, atol=1e-10)


@pytest.mark.parametrize("share", [0.0, 0.3, 1.0])
def test_a_share_of_what_the_biases_learn_is_taken_back(share: float) -> None:
    """Their covariance is as if the correction had been scaled: (1 - s)^2 of what it gained."""
    f, biases = somewhere(8), slice(GYRO_BIAS, FEET)
    f.error[:] = np.arange(ERROR)
    before, learnt, error = 2.0 * f.P[biases, biases], f.P.copy(), f.error.copy()
    learn_in_part(f, before, share)
    error[biases] *= share
    np.testing.assert_allclose(f.error, error)
    learnt[biases, biases] += (1.0 - share) ** 2 * (before - learnt[biases, biases])
    np.testing.assert_allclose(f.P, learnt)


def test_the_heading_no_longer_moves_the_robot_which_is_as_unsure_as_before() -> None:
    f = somewhere(9)
    before = f.P.copy()
    gain = before[HEADING, :2] / before[HEADING, HEADING]
    turn_world_about_robot(f.P)
    np.testing.assert_allclose(f.P, f.P.T, atol=EXACT)
    np.testing.assert_allclose(f.P[HEADING, :2], 0.0, atol=EXACT)
    np.testing.assert_allclose(np.diag(f.P)[:2], np.diag(before)[:2], atol=EXACT)
    for leg in range(4):
        feet = slice(FEET + 3 * leg, FEET + 3 * leg + 2)
        moved = before[HEADING, feet] - gain * before[HEADING, HEADING]
        np.testing.assert_allclose(f.P[HEADING, feet], moved, atol=EXACT)
    others = np.r_[2:15, 17, 20, 23, 26]
    np.testing.assert_array_equal(f.P[np.ix_(others, others)], before[np.ix_(others, others)])
    unsure = Filter()
    turn_world_about_robot(unsure.P)
    assert not unsure.P.any()
