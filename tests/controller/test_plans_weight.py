"""What a robot weighs, felt by its joints, and what a dynamic plan makes of it."""

from dataclasses import replace

import numpy as np
import pytest

from controller import GO2Controller
from controller.behaviours.plans import LEAST_WEIGHT, FeltWeight, vertical_force
from go2_wbc.legs import Leg
from go2_wbc.plant import MujocoPlant
from go2_wbc.reference import LegTask, Target
from go2_wbc.robot.model import RobotModel
from go2_wbc.robot.motor import JointFriction
from go2_wbc.robot.state import RobotState, Snapshot
from tests.engine_helpers import random_state

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


def test_what_friction_takes_is_no_force_of_the_ground(model: RobotModel) -> None:
    friction = JointFriction(dry=(0.4,) * 12)
    moving = random_state(np.random.default_rng(3))
    snapshot, force = pressed(model, moving, 1.0)
    asked = friction.torque(moving.joint_velocities, np.zeros(12))
    told = replace(snapshot.state, tau=snapshot.state.tau + asked)
    assert vertical_force(model.snapshot(told), friction) == pytest.approx(force, rel=1e-9)
    assert vertical_force(model.snapshot(told), NO_FRICTION) != pytest.approx(force, rel=1e-3)


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


def test_in_flight_nothing_is_added_to_gravity(model: RobotModel) -> None:
    weight = FeltWeight(NO_FRICTION)
    weight.ratio = 1.3
    target = planned(-GRAVITY, (LegTask.SWING,) * 4)
    weight.add_to(target, model.snapshot(at_rest(2)), DT)
    assert target.a_world[2] == pytest.approx(-GRAVITY)


def test_what_was_felt_before_the_first_foot_left_the_ground_stays(model: RobotModel) -> None:
    snapshot, _ = pressed(model, at_rest(1), 0.9)
    legs = [LegTask.STANCE] * 4
    legs[Leg.FR] = LegTask.SWING
    weight = FeltWeight(NO_FRICTION)
    for _ in range(200):
        weight.add_to(planned(), snapshot, DT)
    felt = weight.ratio
    heavier, _ = pressed(model, at_rest(1), 1.3)
    for target in (planned(0.0, tuple(legs)), planned()):
        weight.add_to(target, heavier, DT)
        assert weight.ratio == felt


def test_feet_that_carry_nothing_do_not_make_the_robot_weightless(model: RobotModel) -> None:
    snapshot, _ = pressed(model, at_rest(1), 0.0)
    weight = FeltWeight(NO_FRICTION)
    for _ in range(200):
        weight.add_to(planned(), snapshot, DT)
    assert weight.ratio == LEAST_WEIGHT


@pytest.mark.slow
@pytest.mark.parametrize("mass_scale", [0.91, 1.09])
def test_a_robot_of_another_mass_rears_up_as_planned(mass_scale: float) -> None:
    """It was 7 deg off its plan on the average with 9 % more mass."""
    plant = MujocoPlant(friction=0.8, mass_scale=mass_scale, seed=901, initial_joint_noise=0.05)
    with GO2Controller(plant=plant) as go2:
        assert go2.stand()
        assert go2.play("rear_up"), go2.last_outcome.reason
        assert go2.last_outcome.measured["mean attitude off plan [deg]"] < 5.5
