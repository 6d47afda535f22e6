"""The ways between postures start where the robot is and end where they say."""

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from go2_wbc.curves import Curve, Ease
from go2_wbc.motion_plan import MotionPlan, Posture
from go2_wbc.reference import LegTask, TrackedPoint
from go2_wbc.robot.description import find_profile
from go2_wbc.robot.model import RobotModel
from go2_wbc.robot.rotations import rotation_from_rpy, yaw_rotation
from motions.postures import (
    NORMAL_FORCE_MAX,
    PosturePlan,
    lean,
    lie_down,
    rise,
    sit_down,
    sit_raise,
)
from tests.engine_helpers import angular_velocity_from_rpy

STAND_POSE = find_profile().stand_pose
SIT_POSE = find_profile().sit_pose
LIE_POSE = find_profile().lie_pose

LEAST_REACH = 0.025  # m, of a leg in its plane
ROUNDING = 1e-10
START = np.array([0.02, -0.01, 0.25, 0.05, -0.1, 0.2])
WAYS: list[tuple[Callable[[np.ndarray], MotionPlan], np.ndarray, Posture]] = [
    (lambda pose: rise(pose, Posture.LIE), STAND_POSE, Posture.STAND),
    (sit_down, SIT_POSE, Posture.SIT),
    (lie_down, LIE_POSE, Posture.LIE),
]


@pytest.mark.parametrize(("make", "goal", "stance"), WAYS)
def test_a_way_leads_from_the_measured_pose_to_its_posture_at_rest_on_four_feet(
    make: Callable[[np.ndarray], MotionPlan], goal: np.ndarray, stance: Posture
) -> None:
    plan = make(START)
    first, last = plan.at(0.0), plan.at(plan.duration)
    assert first.body.p_world == pytest.approx(START[:3])
    assert last.body.p_world == pytest.approx(goal[:3])
    assert not np.concatenate([first.body.v_world, last.body.v_world]).any()
    assert plan.exit is stance
    way = [plan.at(float(t)) for t in np.linspace(0.0, plan.duration, 50)]
    assert all(asked.stance.all() for asked in way)
    rises = np.diff([asked.body.p_world[2] for asked in way]) * np.sign(goal[2] - START[2])
    assert rises.min() > -1e-9  # it does not overshoot


@pytest.mark.parametrize("inward", [0.0, 0.01, 0.014])
def test_a_sitting_robot_keeps_its_rear_legs_off_the_singularity_of_their_hips(
    inward: float,
) -> None:
    # Where the foot comes as close to the axis of abduction as the hip is wide, the leg is
    # singular: lower, or on feet further inward, calves fold onto their stops and rattle.
    model, yaw = RobotModel(), 0.8
    feet = model.p_base_feet_nominal.copy()
    feet[:, 1] -= inward * np.sign(feet[:, 1])
    feet[:, 2] = model.foot_radius
    raised = sit_raise(feet @ yaw_rotation(yaw).T + [3.0, -2.0, 0.4], model)
    assert (raised > 0.0) is (inward > 0.0)
    pose = sit_down(START, raised=raised).at(10.0).body
    p_hips_feet = (feet - pose.p_world) @ rotation_from_rpy(*SIT_POSE[3:]) - model.p_base_hips
    distance = np.linalg.norm(p_hips_feet[2:, 1:], axis=1)
    assert np.sqrt(distance.min() ** 2 - model.hip_width**2) > LEAST_REACH


def test_a_posture_is_that_of_the_robot_that_takes_it() -> None:
    tall = replace(find_profile(), stand_height=0.35, sit=(0.3, -0.4), lie_height=0.12)
    plans = (
        rise(START, Posture.LIE, profile=tall),
        lean(START, np.zeros(3), profile=tall),
        sit_down(START, profile=tall),
        lie_down(START, profile=tall),
    )
    ends = [plan.at(plan.duration).body.p_world[2] for plan in plans]
    assert ends == pytest.approx([0.35, 0.35, 0.3, 0.12])


def test_the_stance_in_which_a_rise_starts_is_the_one_that_was_given() -> None:
    for stance in Posture:
        assert rise(START, stance).entry is stance


@pytest.mark.parametrize("point", TrackedPoint)
def test_a_posture_asks_for_its_way_on_four_feet(point: TrackedPoint) -> None:
    rng = np.random.default_rng(4)
    start, end = rng.normal(size=(2, 6))
    way = Curve((0.0, 0.7), (start, end), Ease.CUBIC)
    plan = PosturePlan("odd", Posture.LIE, Posture.SIT, point, way)
    for t in rng.uniform(-0.2, 0.9, size=200).tolist():
        asked, now = plan.at(t), way.at(t)
        assert asked.body.point is point
        assert asked.body.p_world == pytest.approx(now.value[:3], abs=ROUNDING)
        assert asked.body.v_world == pytest.approx(now.rate[:3], abs=ROUNDING)
        assert asked.body.a_world == pytest.approx(now.acceleration[:3], abs=ROUNDING)
        R = Rotation.from_euler("xyz", now.value[3:]).as_matrix()
        assert asked.body.R_world_base == pytest.approx(R, abs=ROUNDING)
        w, dw = angular_velocity_from_rpy(now.value[3:], now.rate[3:], now.acceleration[3:])
        assert asked.body.w_world == pytest.approx(w, abs=ROUNDING)
        assert asked.body.dw_world == pytest.approx(dw, abs=ROUNDING)
        assert set(asked.legs) == {LegTask.STANCE}
        assert (asked.normal_force_max == NORMAL_FORCE_MAX).all()
        assert not np.concatenate([asked.q_joints, asked.p_world_feet.ravel()]).any()
