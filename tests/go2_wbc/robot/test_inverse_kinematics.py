"""Whole-body poses: reached as asked, or refused with numbers."""

from dataclasses import replace

import numpy as np
import pinocchio as pin
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from go2_wbc.errors import IkError
from go2_wbc.geometry import support_margin
from go2_wbc.legs import Leg
from go2_wbc.robot import inverse_kinematics
from go2_wbc.robot.inverse_kinematics import PoseTargets, _residuals, solve_pose
from go2_wbc.robot.model import RobotModel
from go2_wbc.robot.rotations import rotation_from_rpy

MODEL = RobotModel()
FEET = np.array(
    [
        [0.1934, 0.142, 0.022],
        [0.1934, -0.142, 0.022],
        [-0.1934, 0.142, 0.022],
        [-0.1934, -0.142, 0.022],
    ]
)
START = np.concatenate([[0.0, 0.0, 0.3, 0.0, 0.0, 0.0, 1.0], np.tile([0.0, 0.8, -1.6], 4)])
STAND = PoseTargets(p_world_feet=FEET, rpy=(0.0, 0.0, 0.0), height=0.3)
UP = (-0.28, -1.36, -1.15)
PAW_START = np.concatenate([START[:10], UP, START[13:]])
PAW = PoseTargets(
    p_world_feet=FEET, rpy=(-0.07, -0.30, -0.05), height=0.335, raised=Leg.FR, com_margin=0.085
)
"""A paw held twice as high as the shoulder, on three feet, from ``PAW_START``."""

EXACT = 1e-6  # [m, rad] converged targets; measured 1e-12
MIRRORED = 1e-5  # [m, rad] two iterations stop at 1e-7 steps on either side


def mirrored(targets: PoseTargets) -> PoseTargets:
    roll, pitch, yaw = targets.rpy
    feet = targets.p_world_feet[[1, 0, 3, 2]] * [1.0, -1.0, 1.0]
    raised = None if targets.raised is None else targets.raised.mirror
    return replace(targets, p_world_feet=feet, rpy=(-roll, pitch, -yaw), raised=raised)


def mirrored_q(q: np.ndarray) -> np.ndarray:
    x, y, z, qx, qy, qz, qw = q[:7]
    joints = q[7:].reshape(4, 3)[[1, 0, 3, 2]] * [-1.0, 1.0, 1.0]
    return np.concatenate([[x, -y, z, -qx, qy, -qz, qw], joints.ravel()])


def reserve(q: np.ndarray) -> float:
    joints = q[7:]
    return float(min((joints - MODEL.q_lower).min(), (MODEL.q_upper - joints).min()))


def test_a_stand_puts_feet_and_trunk_where_asked_the_same_every_time() -> None:
    q = solve_pose(MODEL, STAND, START)
    _, feet = MODEL.forward_kinematics(q)
    np.testing.assert_allclose(feet, FEET, atol=EXACT)
    np.testing.assert_allclose(q[2:7], [0.3, 0.0, 0.0, 0.0, 1.0], atol=EXACT)
    first, second = (solve_pose(MODEL, PAW, PAW_START) for _ in range(2))
    np.testing.assert_array_equal(first, second)


def test_a_paw_is_raised_with_the_asked_margins() -> None:
    q = solve_pose(MODEL, PAW, PAW_START)
    com, feet = MODEL.forward_kinematics(q)
    assert feet[Leg.FR, 2] > 0.6
    np.testing.assert_allclose(q[7:][Leg.FR.joints], UP, atol=EXACT)
    np.testing.assert_allclose(feet[[0, 2, 3]], FEET[[0, 2, 3]], atol=EXACT)
    assert support_margin(FEET[[0, 2, 3], :2], com[:2]) >= PAW.com_margin - EXACT
    assert reserve(q) >= PAW.joint_margin


@pytest.mark.parametrize(
    ("targets", "named"),
    [
        (replace(PAW, p_world_feet=FEET + np.eye(4)[:, :3] * [0.5, 0.0, 0.0]), "FL_foot"),
        (replace(PAW, height=0.45), "height"),
        (replace(PAW, com_margin=0.12), "infeasible"),
        (replace(PAW, joint_margin=0.4), "raised joints"),
        (replace(STAND, height=0.5), "height"),
        (replace(STAND, height=0.3, rpy=(0.0, -1.2, 0.0)), "orientation"),
        (replace(STAND, joint_margin=0.9), "joint limits"),
    ],
    ids=[
        "foot too far",
        "trunk too high",
        "margin beyond the incircle",
        "raised leg beyond its limits",
        "tall",
        "tilted",
        "joints",
    ],
)
def test_what_cannot_be_reached_is_refused_with_the_numbers(
    targets: PoseTargets, named: str
) -> None:
    with pytest.raises(IkError, match=r"no pose meets the targets") as caught:
        solve_pose(MODEL, targets, START if targets.raised is None else PAW_START)
    assert named.lower() in str(caught.value).lower()
    assert "limit" in str(caught.value)


@pytest.mark.parametrize(
    ("targets", "start"), [(STAND, START), (PAW, PAW_START)], ids=["stand", "paw"]
)
def test_left_and_right_poses_mirror_each_other(targets: PoseTargets, start: np.ndarray) -> None:
    right = solve_pose(MODEL, targets, start)
    left = solve_pose(MODEL, mirrored(targets), mirrored_q(start))
    np.testing.assert_allclose(left, mirrored_q(right), atol=MIRRORED)


def test_too_few_iterations_are_not_mistaken_for_a_solution_and_counted_in_both_phases(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr(inverse_kinematics, "MAX_ITERATIONS", 1)
    with pytest.raises(IkError, match="after 2 steps"):
        solve_pose(MODEL, PAW, PAW_START)


small = st.floats(-0.15, 0.15)


@settings(max_examples=40)
@given(small, small, small, st.floats(0.24, 0.32))
def test_any_moderate_trunk_pose_is_met_or_refused(
    roll: float, pitch: float, yaw: float, height: float
) -> None:
    targets = replace(STAND, rpy=(roll, pitch, yaw), height=height, com_margin=0.05)
    try:
        q = solve_pose(MODEL, targets, START)
    except IkError:
        return
    com, feet = MODEL.forward_kinematics(q)
    tolerance = inverse_kinematics.POSITION_TOLERANCE
    assert np.linalg.norm(feet - FEET, axis=1).max() <= tolerance
    assert abs(q[2] - height) <= tolerance
    R = pin.Quaternion(q[3:7]).matrix()
    np.testing.assert_allclose(R, rotation_from_rpy(roll, pitch, yaw), atol=2e-3)
    assert support_margin(FEET[:, :2], com[:2]) >= 0.05 - 1e-4
    assert reserve(q) >= targets.joint_margin - 1e-4


@pytest.mark.parametrize(("joint", "moved"), [(16, 0.0), (16, -1.4), (17, 3.8), (18, -1.2)])
def test_a_pose_misses_each_target_by_what_it_is_off(joint: int, moved: float) -> None:
    q = START.copy()
    q[joint] += moved
    com, feet = MODEL.forward_kinematics(q)
    shifts = np.array([[0.03, 0.0, 0.04], [0.0] * 3, [0.0, -0.1, 0.0], [1.0, 1.0, 1.0]])
    rpy, most = (0.1, 0.0, 0.0), 0.05
    targets = PoseTargets(
        p_world_feet=feet + shifts, rpy=rpy, height=0.34, raised=Leg.RR, com_margin=0.5
    )
    rows = {row.name: (row.norm, row.unit) for row, _ in _residuals(MODEL, targets, START, q)}
    over = np.array([MODEL.q_lower + most - q[7:], q[7:] - MODEL.q_upper + most]).max()
    margin = support_margin(targets.polygon, com[:2])
    assert rows == {
        "FL_foot": (pytest.approx(0.05), "m"),
        "FR_foot": (pytest.approx(0.0), "m"),
        "RL_foot": (pytest.approx(0.1), "m"),
        "height": (pytest.approx(0.04), "m"),
        "orientation": (pytest.approx(0.1), "rad"),
        "raised joints": (pytest.approx(abs(moved)), "rad"),
        "CoM margin short by": (pytest.approx(0.5 - margin), "m"),
        "joint limits beyond": (pytest.approx(max(over, 0.0)), "rad"),
    }
    assert (over > 0.0) == (moved != 0.0)
