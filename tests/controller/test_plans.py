"""Where a plan is placed, how the robot comes to it, and what it weighs, felt by its joints."""

from dataclasses import replace

import numpy as np
import pytest
from jaxtyping import Float

from controller import GO2Controller
from controller.behaviours.plans import (
    APPROACH,
    DOUBT,
    FARTHEST,
    LEAST_WEIGHT,
    FeltWeight,
    anchor_of,
    approach,
    offset_of,
    vertical_force,
)
from go2_wbc.legs import Leg
from go2_wbc.motion_plan import MotionPlan
from go2_wbc.plant import MujocoPlant
from go2_wbc.reference import Anchor, LegTask, Target
from go2_wbc.robot.description import find_profile
from go2_wbc.robot.model import RobotModel
from go2_wbc.robot.motor import JointFriction
from go2_wbc.robot.rotations import yaw_rotation
from go2_wbc.robot.state import RobotState, Snapshot
from motions import compile_motion
from tests.engine_helpers import random_state

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


def test_above_two_feet_a_plan_is_played_over_their_line_but_not_far_beside_it(
    pair: MotionPlan,
) -> None:
    feet = feet_beside(pair, 0.008)
    anchor, of_feet = anchor_of(pair, feet, FOOT_RADIUS), Anchor.of_feet(feet, FOOT_RADIUS)
    for legs in ([Leg.FR, Leg.RL], [Leg.FL, Leg.RR]):
        assert abs(beside_line(pair, of_feet, feet, legs)) > 1e-4
        assert beside_line(pair, anchor, feet, legs) == pytest.approx(0.0, abs=1e-9)
    assert anchor.yaw == of_feet.yaw
    assert anchor.p_world[2] == of_feet.p_world[2]
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


def offset_from(model: RobotModel, plan: MotionPlan) -> tuple[Float[np.ndarray, "3"], ...]:
    """The offset of a robot that stands anywhere, and how far its CoM is from its place."""
    anchor = Anchor(np.array([0.1, 0.2, 0.0]), 0.4)
    q = np.array([0.1, 0.21, 0.3, 0.0, 0.0, np.sin(0.2), np.cos(0.2), *[0.0, 0.8, -1.6] * 4])
    still, off = np.zeros(12), np.zeros(4)
    state = RobotState(0.0, q, np.zeros(18), still, off, off.astype(bool))
    snapshot = model.snapshot(state)
    wanted = plan.at(0.0).placed(anchor).body.p_world
    away = yaw_rotation(anchor.yaw).T @ (snapshot.p_world_com - wanted)
    return offset_of(plan, anchor, snapshot), away


def test_the_approach_leads_from_the_robot_to_the_plan(model: RobotModel, pair: MotionPlan) -> None:
    p_start, away = offset_from(model, pair)

    def added(t: float) -> list[Float[np.ndarray, "3"]]:
        target = Target()
        approach(target, p_start, t)
        return [target.p_world, target.v_world, target.a_world]

    np.testing.assert_allclose(added(0.0)[0], away, atol=1e-12)
    assert not np.any(added(APPROACH))
    for t in (0.05, 0.12, 0.2):
        before, (p, v, a), after = added(t - STEP), added(t), added(t + STEP)
        np.testing.assert_allclose(v, (after[0] - before[0]) / (2 * STEP), rtol=1e-4, atol=1e-7)
        np.testing.assert_allclose(a, (after[1] - before[1]) / (2 * STEP), rtol=1e-3, atol=1e-4)
        assert np.linalg.norm(p) < np.linalg.norm(away)


def test_a_motion_that_is_not_dynamic_is_left_to_feedback(model: RobotModel) -> None:
    p_start, _ = offset_from(model, compile_motion("wave", model))
    assert not p_start.any()


GRAVITY, DT = 9.81, 0.002
NO_FRICTION = JointFriction.none()


def pressed(model: RobotModel, state: RobotState, share: float) -> tuple[Snapshot, float]:
    """The robot at ``state``, whose joints balance random forces; and their vertical sum [N].

    The sum is ``share`` of the model's weight.
    """
    rng = np.random.default_rng(4)
    forces = rng.uniform(-20.0, 20.0, (4, 3))
    forces[:, 2] = share * model.mass * GRAVITY * rng.dirichlet(np.full(4, 3.0))
    snapshot = model.snapshot(state)
    pushed = np.einsum("lfj,lf->j", snapshot.J_contacts, forces)
    tau = snapshot.bias[6:] - pushed[6:]
    return model.snapshot(replace(state, tau=tau)), float(forces[:, 2].sum())


def at_rest(seed: int) -> RobotState:
    state = random_state(np.random.default_rng(seed))
    return replace(state, v=np.zeros(18))


def planned(a_z: float = 0.0, legs: tuple[LegTask, ...] = (LegTask.STANCE,) * 4) -> Target:
    """A target that is accelerated upwards."""
    return Target(a_world=[0.3, -0.2, a_z], legs=legs)


@pytest.mark.parametrize("seed", range(5))
def test_the_joints_tell_the_force_of_the_ground(model: RobotModel, seed: int) -> None:
    snapshot, force = pressed(model, at_rest(seed), 1.1)
    assert vertical_force(snapshot, NO_FRICTION) == pytest.approx(force, rel=1e-9)


def test_what_the_ground_gives_is_felt_without_friction_and_in_flight(model: RobotModel) -> None:
    friction = JointFriction(dry=(0.4,) * 12)
    moving = random_state(np.random.default_rng(3))
    snapshot, force = pressed(model, moving, 1.0)
    asked = friction.torque(moving.joint_velocities, np.zeros(12))
    told = replace(snapshot.state, tau=snapshot.state.tau + asked)
    assert vertical_force(model.snapshot(told), friction) == pytest.approx(force, rel=1e-9)
    assert vertical_force(model.snapshot(told), NO_FRICTION) != pytest.approx(force, rel=1e-3)
    weight = FeltWeight(NO_FRICTION)
    weight.ratio = 1.3
    target = planned(-GRAVITY, (LegTask.SWING,) * 4)
    weight.add_to(target, model.snapshot(at_rest(2)), DT)
    assert target.a_world[2] == pytest.approx(-GRAVITY)
    snapshot, _ = pressed(model, at_rest(1), 0.0)
    weight = FeltWeight(NO_FRICTION)
    for _ in range(200):
        weight.add_to(planned(), snapshot, DT)
    assert weight.ratio == LEAST_WEIGHT


@pytest.mark.parametrize("share", [0.9, 1.0, 1.15])
def test_a_plan_asks_for_the_force_that_the_felt_mass_takes(
    model: RobotModel, share: float
) -> None:
    a_z = 2.0
    snapshot, _ = pressed(model, at_rest(1), share * (1.0 + a_z / GRAVITY))
    weight, target = FeltWeight(NO_FRICTION), planned(a_z)
    for _ in range(1000):
        weight.add_to(planned(a_z), snapshot, DT)
    weight.add_to(target, snapshot, DT)
    assert weight.ratio == pytest.approx(share, abs=2e-3)
    asked = target.a_world + [0.0, 0.0, GRAVITY]
    assert asked == pytest.approx(share * np.array([0.3, -0.2, a_z + GRAVITY]), rel=3e-3)


def test_what_was_felt_before_the_first_foot_left_the_ground_stays(model: RobotModel) -> None:
    snapshot, _ = pressed(model, at_rest(1), 0.9)
    legs = [LegTask.STANCE] * 4
    legs[Leg.FR] = LegTask.SWING
    weight = FeltWeight(NO_FRICTION)
    for _ in range(round(DOUBT / DT)):
        weight.add_to(planned(), snapshot, DT)
    felt = weight.ratio
    assert felt == pytest.approx(0.95, abs=1e-6)  # half of it is believed
    heavier, _ = pressed(model, at_rest(1), 1.3)
    for target in (planned(0.0, tuple(legs)), planned()):
        weight.add_to(target, heavier, DT)
        assert weight.ratio == felt


@pytest.mark.slow
@pytest.mark.parametrize("mass_scale", [0.91, 1.09])
def test_a_robot_of_another_mass_rears_up_as_planned(mass_scale: float) -> None:
    """It was 7 deg off its plan on the average with 9 % more mass."""
    plant = MujocoPlant(friction=0.8, mass_scale=mass_scale, seed=901, initial_joint_noise=0.05)
    with GO2Controller(plant=plant) as go2:
        assert go2.stand()
        assert go2.play("rear_up"), go2.last_outcome.reason
        assert go2.last_outcome.measured["mean attitude off plan [deg]"] < 5.5
