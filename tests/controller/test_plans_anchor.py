"""Where a plan is played, and how the robot gets from where it stands to where the plan starts."""

import numpy as np
import pytest
from jaxtyping import Float

from controller.behaviours.plans import APPROACH, FARTHEST, Approach, anchor_of
from go2_wbc.legs import Leg
from go2_wbc.motion_plan import MotionPlan
from go2_wbc.reference import Anchor, Target
from go2_wbc.robot.model import RobotModel
from go2_wbc.robot.profile import find_profile
from go2_wbc.robot.rotations import yaw_rotation
from go2_wbc.robot.state import RobotState
from motions import compile_motion

FOOT_RADIUS = find_profile().foot_radius

Feet = Float[np.ndarray, "4 3"]
STEP = 1e-4
"""Time [s] of finite differences; the curve's fourth derivative makes them 1e-4 m/s^2 wrong."""


@pytest.fixture(scope="module")
def pair(model: RobotModel) -> MotionPlan:
    """Two diagonal feet up, then the others."""
    return compile_motion("paw_pair", model)


def feet_beside(plan: MotionPlan, size: float) -> Feet:
    """Somewhere, and up to ``size`` [m] beside their planned places."""
    rng = np.random.default_rng(5)
    feet = plan.at(0.0).placed(Anchor(np.array([0.3, -0.2, 0.0]), 0.7)).p_world_feet
    feet[:, :2] += rng.uniform(-size, size, (4, 2))
    return feet


def beside_line(plan: MotionPlan, anchor: Anchor, feet: Feet, pair: list[Leg]) -> float:
    """Distance [m] of the planned line between two feet from the one on which they stand."""
    planned = plan.at(0.0).placed(anchor).p_world_feet
    x, y = feet[pair[0], :2] - feet[pair[1], :2]
    normal = np.array([-y, x]) / np.hypot(x, y)
    return float(normal @ (planned[pair, :2] - feet[pair, :2]).mean(axis=0))


def test_above_two_feet_a_plan_is_played_over_their_line(pair: MotionPlan) -> None:
    feet = feet_beside(pair, 0.008)
    anchor, of_feet = anchor_of(pair, feet, FOOT_RADIUS), Anchor.of_feet(feet, FOOT_RADIUS)
    for legs in ([Leg.FR, Leg.RL], [Leg.FL, Leg.RR]):
        assert abs(beside_line(pair, of_feet, feet, legs)) > 1e-4
        assert beside_line(pair, anchor, feet, legs) == pytest.approx(0.0, abs=1e-9)
    assert anchor.yaw == of_feet.yaw
    assert anchor.p_world[2] == of_feet.p_world[2]


def test_feet_far_from_their_places_move_a_plan_no_farther_than_feet_stand_beside(
    pair: MotionPlan,
) -> None:
    feet = feet_beside(pair, 0.2)
    moved = anchor_of(pair, feet, FOOT_RADIUS).p_world - Anchor.of_feet(feet, FOOT_RADIUS).p_world
    assert np.linalg.norm(moved) == pytest.approx(FARTHEST)


@pytest.mark.parametrize("name", ["wave", "jump_up"])
def test_what_never_stands_on_two_feet_is_played_in_the_frame_of_the_feet(
    model: RobotModel, name: str
) -> None:
    plan = compile_motion(name, model)
    feet = feet_beside(plan, 0.008)
    anchor, of_feet = anchor_of(plan, feet, FOOT_RADIUS), Anchor.of_feet(feet, FOOT_RADIUS)
    np.testing.assert_array_equal(anchor.p_world, of_feet.p_world)


def approach_from(model: RobotModel, plan: MotionPlan) -> tuple[Approach, Float[np.ndarray, "3"]]:
    """The approach of a robot that stands anywhere, and how far its CoM is from its place."""
    anchor = Anchor(np.array([0.1, 0.2, 0.0]), 0.4)
    q = np.array([0.1, 0.21, 0.3, 0.0, 0.0, np.sin(0.2), np.cos(0.2), *[0.0, 0.8, -1.6] * 4])
    still, off = np.zeros(12), np.zeros(4)
    state = RobotState(0.0, q, np.zeros(18), still, off, off.astype(bool))
    snapshot = model.snapshot(state)
    wanted = plan.at(0.0).placed(anchor).body.p_world
    away = yaw_rotation(anchor.yaw).T @ (snapshot.p_world_com - wanted)
    return Approach.of(plan, anchor, snapshot), away


def test_the_approach_leads_from_the_robot_to_the_plan(model: RobotModel, pair: MotionPlan) -> None:
    approach, away = approach_from(model, pair)

    def added(t: float) -> list[Float[np.ndarray, "3"]]:
        target = Target()
        approach.add_to(target, t)
        return [target.p_world, target.v_world, target.a_world]

    np.testing.assert_allclose(added(0.0)[0], away, atol=1e-12)
    assert not np.any(added(APPROACH))
    for t in (0.05, 0.12, 0.2):
        before, (p, v, a), after = added(t - STEP), added(t), added(t + STEP)
        np.testing.assert_allclose(v, (after[0] - before[0]) / (2 * STEP), rtol=1e-4, atol=1e-7)
        np.testing.assert_allclose(a, (after[1] - before[1]) / (2 * STEP), rtol=1e-3, atol=1e-4)
        assert np.linalg.norm(p) < np.linalg.norm(away)


def test_a_motion_that_is_not_dynamic_is_left_to_feedback(model: RobotModel) -> None:
    approach, _ = approach_from(model, compile_motion("wave", model))
    assert not approach.p_start.any()
