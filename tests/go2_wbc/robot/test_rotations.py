"""Rotations against Pinocchio, and their derivatives against finite differences."""

import numpy as np
import pinocchio as pin
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from go2_wbc.robot.rotations import (
    log_rotation,
    quaternions_from_rpy,
    rotation_from_rpy,
    rotations_from_rpy,
    wrap_angle,
    yaw_rotation,
)
from tests.compiled import assert_plain_is_compiled

EXACT = 1e-12  # rounding of numbers of order one
STEP = 1e-5  # [s] of the central differences
DIFFERENCE = 1e-6  # their error: step^2 times third derivatives, and rounding / step
SEEDS = range(20)


def axis_rotation(axis: int, angle: float) -> np.ndarray:
    return pin.AngleAxis(angle, np.eye(3)[axis]).matrix()


def random_angles(rng: np.random.Generator) -> np.ndarray:
    return rng.uniform([-3.0, -1.4, -3.0], [3.0, 1.4, 3.0])


@pytest.mark.parametrize("seed", SEEDS)
def test_rpy_are_turns_about_x_then_y_then_z_of_the_world(seed: int) -> None:
    roll, pitch, yaw = random_angles(np.random.default_rng(seed))
    product = axis_rotation(2, yaw) @ axis_rotation(1, pitch) @ axis_rotation(0, roll)
    np.testing.assert_allclose(rotation_from_rpy(roll, pitch, yaw), product, atol=EXACT)
    np.testing.assert_allclose(yaw_rotation(yaw), axis_rotation(2, yaw), atol=EXACT)


@pytest.mark.parametrize("seed", SEEDS)
def test_the_logarithm_is_axis_times_angle_and_undone_by_exp(seed: int) -> None:
    rng = np.random.default_rng(seed)
    axis = rng.normal(size=3)
    axis /= np.linalg.norm(axis)
    angle = rng.uniform(0.0, 3.1)
    R = pin.AngleAxis(angle, axis).matrix()
    np.testing.assert_allclose(log_rotation(R), angle * axis, atol=1e-10)


@pytest.mark.parametrize("seed", SEEDS)
def test_near_the_target_the_error_shrinks_at_the_relative_angular_velocity(seed: int) -> None:
    """d log(R' R_des) / dt = w_des - w in base axes at R_des: what the orientation task assumes."""
    rng = np.random.default_rng(seed)
    R = rotation_from_rpy(*random_angles(rng))
    w, w_des = rng.normal(size=(2, 3))  # both in base axes

    def error(t: float) -> np.ndarray:
        return log_rotation((R @ pin.exp3(w * t)).T @ (R @ pin.exp3(w_des * t)))

    rate = (error(STEP) - error(-STEP)) / (2 * STEP)
    np.testing.assert_allclose(rate, w_des - w, atol=DIFFERENCE)


@given(st.floats(-100.0, 100.0))
def test_a_wrapped_angle_is_the_same_direction_within_half_a_turn(angle: float) -> None:
    wrapped = wrap_angle(angle)
    assert -np.pi <= wrapped <= np.pi
    assert np.cos(wrapped) == pytest.approx(np.cos(angle), abs=1e-9)
    assert np.sin(wrapped) == pytest.approx(np.sin(angle), abs=1e-9)


def test_rotations_and_quaternions_are_those_of_roll_pitch_yaw() -> None:
    rpy = np.random.default_rng(2).uniform(-4.0, 4.0, size=(1000, 3))
    expected = Rotation.from_euler("ZYX", rpy[:, ::-1])
    R, xyzw = np.empty((1000, 3, 3)), np.empty((1000, 4))
    rotations_from_rpy(rpy, R)
    quaternions_from_rpy(rpy, xyzw)
    assert pytest.approx(expected.as_matrix(), abs=1e-12) == R
    assert pytest.approx(expected.as_quat(), abs=1e-12) == xyzw
    assert_plain_is_compiled(rotations_from_rpy, rpy, R)
    assert_plain_is_compiled(quaternions_from_rpy, rpy, xyzw)
