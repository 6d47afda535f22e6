"""Velocities and accelerations of a trajectory are the derivatives of what they belong to."""

from __future__ import annotations

import numpy as np
import pinocchio as pin
import pytest

from go2_wbc.robot.model import RobotModel
from go2_wbc.robot.rotations import log_rotation, rotation_from_rpy
from motions import Timeline, compile_timeline, deg
from motions.trajectory import SAMPLE_PERIOD, _body_rates, trajectory_of

STEP = 1e-5  # s; of the differences
# Of a third derivative of about 1e3 /s^3 times the sample period squared.
COARSE_V, COARSE_A = 0.02, 0.5


def angles(t: float) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Roll, pitch and yaw that all move at once, with both derivatives."""
    size, rate = np.array([0.4, -0.6, 0.9]), np.array([3.0, 2.0, 1.7])
    phase = rate * t + np.array([0.3, 0.9, 2.0])
    return size * np.sin(phase), size * rate * np.cos(phase), -size * rate**2 * np.sin(phase)


def turning(t: float) -> tuple[np.ndarray, np.ndarray]:
    w, dw = _body_rates(*(value[None] for value in angles(t)))
    return w[0], dw[0]


@pytest.mark.parametrize("t", np.linspace(0.0, 3.0, 7))
def test_angular_velocity_and_acceleration_are_those_of_the_turning_trunk(t: float) -> None:
    R, before, after = (rotation_from_rpy(*angles(t + d)[0]) for d in (0.0, -STEP, STEP))
    w = log_rotation(before.T @ after) / (2.0 * STEP)
    dw = (turning(t + STEP)[0] - turning(t - STEP)[0]) / (2.0 * STEP)
    assert turning(t)[0] == pytest.approx(w, abs=1e-6)
    assert turning(t)[1] == pytest.approx(dw, abs=1e-6)
    assert np.linalg.det(R) == pytest.approx(1.0)


def test_configuration_velocity_and_acceleration_of_a_lively_motion_fit_together() -> None:
    model = RobotModel()
    line = Timeline().body(x=0.03, y=0.02, z=-0.03, yaw=deg(12), over=0.6)
    line = line.body(roll=deg(10), pitch=deg(-8), yaw=deg(-10), over=0.6).home(over=0.6)
    path = trajectory_of(compile_timeline(line, model), model)
    two = 2.0 * SAMPLE_PERIOD
    for row in range(1, len(path.times) - 1, 3):
        moved = pin.difference(model.pin_model, path.q[row - 1], path.q[row + 1]) / two
        assert path.v[row] == pytest.approx(moved, abs=COARSE_V)
        gained = (path.v[row + 1] - path.v[row - 1]) / two
        assert path.a[row] == pytest.approx(gained, abs=COARSE_A)
