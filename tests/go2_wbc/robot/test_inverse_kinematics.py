"""Whole-body poses: reached as asked, or refused with numbers."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pinocchio as pin
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from go2_wbc.errors import IkError
from go2_wbc.geometry import support_margin
from go2_wbc.legs import Leg
from go2_wbc.robot.inverse_kinematics import IkConfig, PoseSolution, PoseTargets, solve_pose
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
PAW_PLACE = (0.37, -0.06, 0.64)
PAW = PoseTargets(
    p_world_feet=FEET,
    rpy=(-0.07, -0.30, -0.05),
    height=0.335,
    raised=Leg.FR,
    p_world_paw=PAW_PLACE,
    com_margin=0.085,
)
"""A paw held twice as high as the shoulder, on three feet."""

EXACT = 1e-6  # [m, rad] converged targets; measured 1e-12
MIRRORED = 1e-5  # [m, rad] two iterations stop at 1e-7 steps on either side


def mirrored(targets: PoseTargets) -> PoseTargets:
    roll, pitch, yaw = targets.rpy
    feet = targets.p_world_feet[[1, 0, 3, 2]] * [1.0, -1.0, 1.0]
    raised = None if targets.raised is None else targets.raised.mirror
    paw = targets.p_world_paw
    return replace(
        targets,
        p_world_feet=feet,
        rpy=(-roll, pitch, -yaw),
        raised=raised,
        p_world_paw=None if paw is None else (paw[0], -paw[1], paw[2]),
    )


def mirrored_q(q: np.ndarray) -> np.ndarray:
    x, y, z, qx, qy, qz, qw = q[:7]
    joints = q[7:].reshape(4, 3)[[1, 0, 3, 2]] * [-1.0, 1.0, 1.0]
    return np.concatenate([[x, -y, z, -qx, qy, -qz, qw], joints.ravel()])


def reserve(solution: PoseSolution) -> float:
    joints = solution.q[7:]
    return float(min((joints - MODEL.q_lower).min(), (MODEL.q_upper - joints).min()))


def test_a_stand_puts_the_feet_and_the_trunk_where_asked() -> None:
    solution = solve_pose(MODEL, STAND, START)
    com, feet = MODEL.forward_kinematics(solution.q)
    np.testing.assert_allclose(feet, FEET, atol=EXACT)
    np.testing.assert_allclose(solution.q[2:7], [0.3, 0.0, 0.0, 0.0, 1.0], atol=EXACT)
    np.testing.assert_allclose(solution.p_world_com, com)
    assert solution.com_margin == support_margin(FEET[:, :2], com[:2])
    assert all(row.norm < EXACT for row in solution.residuals)


def test_the_steps_of_both_phases_are_counted() -> None:
    found = solve_pose(MODEL, STAND, START)
    again = solve_pose(MODEL, STAND, found.q)
    assert again.iterations == 2  # it is there, so each phase takes the step that says so
    assert found.iterations > again.iterations


def test_a_paw_is_raised_with_the_asked_margins() -> None:
    solution = solve_pose(MODEL, PAW, START)
    com, feet = MODEL.forward_kinematics(solution.q)
    np.testing.assert_allclose(feet[Leg.FR], PAW_PLACE, atol=EXACT)
    np.testing.assert_allclose(feet[[0, 2, 3]], FEET[[0, 2, 3]], atol=EXACT)
    assert support_margin(FEET[[0, 2, 3], :2], com[:2]) >= PAW.com_margin - EXACT
    assert reserve(solution) >= PAW.joint_margin


def test_the_body_may_shift_over_three_feet_while_four_stand() -> None:
    three = (Leg.FL, Leg.RL, Leg.RR)
    shifted = solve_pose(MODEL, replace(STAND, support=three, com_margin=0.07), START)
    assert support_margin(FEET[[0, 2, 3], :2], shifted.p_world_com[:2]) >= 0.07 - EXACT
    centred = solve_pose(MODEL, STAND, START)
    assert support_margin(FEET[[0, 2, 3], :2], centred.p_world_com[:2]) < 0.07


def test_a_raised_leg_may_be_given_by_its_joints() -> None:
    joints = (-0.1, -0.3, -2.0)
    targets = replace(PAW, p_world_paw=None, q_raised=joints, rpy=(0.0, -0.1, 0.0), height=0.32)
    solution = solve_pose(MODEL, targets, START)
    np.testing.assert_allclose(solution.q[7:][Leg.FR.joints], joints, atol=EXACT)


@pytest.mark.parametrize(
    ("targets", "named"),
    [
        (replace(PAW, p_world_paw=(0.9, -0.1, 0.6)), "FR_foot"),
        (replace(PAW, p_world_paw=(0.37, -0.06, 0.75)), "height"),
        (replace(PAW, com_margin=0.12), "infeasible"),
        (replace(STAND, height=0.5), "height"),
        (replace(STAND, height=0.3, rpy=(0.0, -1.2, 0.0)), "orientation"),
        (replace(PAW, joint_margin=0.3), "orientation"),
    ],
    ids=["paw too far", "paw too high", "margin beyond the incircle", "tall", "tilted", "joints"],
)
def test_what_cannot_be_reached_is_refused_with_the_numbers(
    targets: PoseTargets, named: str
) -> None:
    with pytest.raises(IkError, match=r"no pose meets the targets") as caught:
        solve_pose(MODEL, targets, START)
    assert named.lower() in str(caught.value).lower()
    assert "limit" in str(caught.value)


def test_a_soft_trunk_gives_way_where_a_hard_one_is_refused() -> None:
    place = (0.37, -0.06, 0.67)
    high = replace(PAW, p_world_paw=place)
    with pytest.raises(IkError):
        solve_pose(MODEL, high, START)
    solution = solve_pose(MODEL, replace(high, is_body_hard=False), START)
    _, feet = MODEL.forward_kinematics(solution.q)
    np.testing.assert_allclose(feet[Leg.FR], place, atol=EXACT)


@pytest.mark.parametrize("targets", [STAND, PAW], ids=["stand", "paw"])
def test_left_and_right_poses_mirror_each_other(targets: PoseTargets) -> None:
    right = solve_pose(MODEL, targets, START)
    left = solve_pose(MODEL, mirrored(targets), mirrored_q(START))
    np.testing.assert_allclose(left.q, mirrored_q(right.q), atol=MIRRORED)
    assert left.com_margin == pytest.approx(right.com_margin, abs=MIRRORED)


@pytest.mark.parametrize(
    "targets",
    [
        replace(PAW, p_world_paw=None),
        replace(PAW, q_raised=(0.0, 0.0, -1.0)),
        replace(STAND, p_world_paw=(0.3, 0.0, 0.5)),
    ],
    ids=["no target", "two targets", "target without a raised leg"],
)
def test_contradicting_targets_are_refused(targets: PoseTargets) -> None:
    with pytest.raises(ValueError, match="p_world_paw"):
        solve_pose(MODEL, targets, START)


def test_too_few_iterations_are_not_mistaken_for_a_solution() -> None:
    with pytest.raises(IkError):
        solve_pose(MODEL, PAW, START, IkConfig(max_iterations=2))


def test_the_same_targets_give_the_same_pose() -> None:
    first, second = solve_pose(MODEL, PAW, START), solve_pose(MODEL, PAW, START)
    np.testing.assert_array_equal(first.q, second.q)


small = st.floats(-0.15, 0.15)


@settings(max_examples=40, deadline=None)
@given(small, small, small, st.floats(0.24, 0.32))
def test_any_moderate_trunk_pose_is_met_or_refused(
    roll: float, pitch: float, yaw: float, height: float
) -> None:
    targets = replace(STAND, rpy=(roll, pitch, yaw), height=height, com_margin=0.05)
    try:
        solution = solve_pose(MODEL, targets, START)
    except IkError:
        return
    com, feet = MODEL.forward_kinematics(solution.q)
    tolerance = IkConfig().position_tolerance
    assert np.linalg.norm(feet - FEET, axis=1).max() <= tolerance
    assert abs(solution.q[2] - height) <= tolerance
    R = pin.Quaternion(solution.q[3:7]).matrix()
    np.testing.assert_allclose(R, rotation_from_rpy(roll, pitch, yaw), atol=2e-3)
    assert support_margin(FEET[:, :2], com[:2]) >= 0.05 - 1e-4
    assert reserve(solution) >= targets.joint_margin - 1e-4
