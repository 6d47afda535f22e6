"""Velocities and accelerations of a trajectory are the derivatives of what they belong to."""

from dataclasses import replace
from unittest.mock import Mock

import numpy as np
import pinocchio as pin
import pytest

from go2_wbc.robot.model import RobotModel
from go2_wbc.robot.rotations import log_rotation
from motions import Timeline, compile_timeline, deg, load_motion
from motions.batch_kinematics import attitudes, configurations, rates
from motions.dynamics.solver import PlanTarget
from motions.plan.compiled_plan import DynamicSpan
from motions.plan.tracks import SAMPLE_PERIOD
from motions.plan.trajectory import are_within, as_written, trajectory_of

STEP = 1e-3  # s; of the differences
FINE_W, FINE_DW = 1e-4, 1e-3  # of a second derivative of about 1e2 /s^2 times the step squared
# Of a third derivative of about 1e3 /s^3 times the sample period squared.
COARSE_V, COARSE_A = 0.02, 0.5


def angles(t: float) -> np.ndarray:
    """Roll, pitch and yaw that all move at once."""
    return np.array([0.4, -0.6, 0.9]) * np.sin([3.0 * t + 0.3, 2.0 * t + 0.9, 1.7 * t + 2.0])


def test_angular_velocity_and_acceleration_are_those_of_the_turning_trunk() -> None:
    times = np.arange(0.0, 3.0, STEP)
    rpy = np.array([angles(float(t)) for t in times])
    R, still = attitudes(rpy), np.zeros((len(times), 12))
    poses = np.hstack([0.0 * rpy, rpy])
    v, a = rates(times, configurations(poses, still), rpy)
    for row in range(100, len(times) - 100, 100):
        w = log_rotation(R[row - 1].T @ R[row + 1]) / (2.0 * STEP)
        assert v[row, 3:6] == pytest.approx(w, abs=FINE_W)
        dw = (v[row + 1, 3:6] - v[row - 1, 3:6]) / (2.0 * STEP)
        assert a[row, 3:6] == pytest.approx(dw, abs=FINE_DW)


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


def test_what_was_written_differs_where_the_nearest_motion_was_planned_only(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    model = RobotModel()
    plan = compile_timeline(load_motion("jump_up"), model)
    first, *others = plan.dynamic
    near = replace(first, asked=object.__new__(PlanTarget))
    path, (start, end) = trajectory_of(plan, model), (first.start, first.end)
    monkeypatch.setattr(DynamicSpan, "written", lambda _, times: np.full((len(times), 19), 7.0))
    written = as_written(replace(plan, dynamic=(near, *others)), path)
    inside = (start <= path.times) & (path.times <= end)
    assert 0 < inside.sum() < len(inside)
    assert (written[inside] == 7.0).all()
    assert np.array_equal(written[~inside], path.q[~inside])
    assert np.array_equal(as_written(plan, path), path.q)


def test_a_solved_part_begins_with_its_start_and_its_end_is_no_part_of_it() -> None:
    span = Mock(spec=DynamicSpan, start=1.0, end=2.0)
    assert are_within(np.array([0.9, 1.0, 1.5, 2.0]), [span]).tolist() == [False, True, True, False]
