"""What the comparison with the documented filter (``test_estimator_equations``) does not tell."""

import numpy as np
import pinocchio as pin

from go2_wbc.robot.estimator_config import EstimatorConfig
from go2_wbc.robot.state_filter import (
    ERROR,
    FEET,
    FORCE_BIAS,
    GYRO_BIAS,
    HEADING,
    THETA,
    VELOCITY,
    EstimateError,
    Filter,
    process_noise,
    turn_world_about_robot,
)

STEP = 0.002
EXACT = 1e-12


def somewhere(seed: int) -> Filter:
    """A filter in the middle of something, and unsure."""
    rng, f = np.random.default_rng(seed), Filter()
    f.x.row[:] = rng.normal(size=len(f.x.row))
    f.x.quaternion[:] = pin.Quaternion(pin.exp3(rng.normal(size=3))).coeffs()
    root = rng.normal(size=(ERROR, ERROR))
    f.P[:] = root @ root.T / ERROR
    return f


def test_parts_of_the_error_are_where_they_are_said_to_be() -> None:
    assert (VELOCITY, THETA, GYRO_BIAS, FORCE_BIAS, FEET) == (3, 6, 9, 12, 15)
    assert (HEADING, ERROR) == (8, 27)


def test_the_noise_is_that_of_the_sensors() -> None:
    c, noise = EstimatorConfig(), np.full(ERROR, np.nan)
    process_noise(c, STEP, noise)
    expected = EstimateError()
    expected.p[:] = 0.5 * c.acceleration * STEP**2
    expected.v[:], expected.theta[:] = c.acceleration * STEP, c.gyro * STEP
    expected.gyro_bias[:] = c.gyro_bias_walk * STEP**0.5
    expected.force_bias[:] = c.accelerometer_bias_walk * STEP**0.5
    np.testing.assert_allclose(noise, expected.row**2, rtol=1e-12)


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
