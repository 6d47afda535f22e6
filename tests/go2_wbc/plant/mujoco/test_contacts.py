"""Contact forces and pushes of the simulated Go2 obey Newton's laws, checked with Pinocchio."""

from typing import Any

import numpy as np
import pinocchio as pin
import pytest

from go2_wbc.errors import CommandError
from go2_wbc.legs import FOOT_NAMES, LEGS
from go2_wbc.plant import MujocoPlant
from go2_wbc.robot.description import find_profile
from go2_wbc.robot.state import JointCommand
from tests.go2_wbc.plant.contract import DAMPED
from tests.go2_wbc.plant.helpers import GRAVITY, STAND, fly, momentum, stand_up

FOOT_RADIUS = find_profile().foot_radius

# The contacts of a lying robot creep a little: dry friction and limits are soft constraints.
STATIC_TOLERANCE = 5e-3
# Identities that hold exactly for the integrator; rounding of sums of numbers of order one.
EXACT = 1e-9
SINKING = 3e-3  # m; contacts are soft
# Momentum is conserved by the continuous equations; 2 ms steps lose this share of it.
INTEGRATOR_TOLERANCE = 5e-3


def test_the_forces_on_a_lying_robot_sum_to_its_weight_below_its_feet_and_in_the_air_are_none(
    plant: MujocoPlant,
) -> None:
    for _ in range(500):
        plant.write(DAMPED)
    parts = plant.read().foot_forces.sum() + plant.base_contact_force + plant.limb_contact_force
    assert parts == pytest.approx(plant.total_mass * GRAVITY, rel=STATIC_TOLERANCE)
    stand_up(plant)
    contacts = plant.foot_contacts()
    below = contacts.p_world_contact - plant.p_world_feet
    assert below == pytest.approx(np.tile([0.0, 0.0, -FOOT_RADIUS], (4, 1)), abs=SINKING)
    fly(plant)
    plant.write(DAMPED)
    assert not plant.read().foot_forces.any()
    assert not plant.read().feet_in_contact.any()
    contacts = plant.foot_contacts()
    assert np.isnan(contacts.p_world_contact).all()
    assert not contacts.v_world_contact.any()


@pytest.mark.parametrize(
    ("settings", "mass"), [({}, 16.085), ({"payload": 4.0}, 20.085), ({"mass_scale": 1.2}, 19.302)]
)
def test_the_feet_of_a_standing_robot_carry_its_whole_weight(
    settings: dict[str, Any], mass: float
) -> None:
    plant = MujocoPlant(**settings)
    state = stand_up(plant)
    assert plant.total_mass == pytest.approx(mass)
    assert state.foot_forces.sum() == pytest.approx(mass * GRAVITY, rel=STATIC_TOLERANCE)
    assert state.feet_in_contact.all()
    assert plant.base_contact_force == plant.limb_contact_force == 0.0


def test_contact_velocity_is_that_of_the_feets_material(
    plant: MujocoPlant, robot: pin.Model
) -> None:
    stand_up(plant)
    plant.push(np.array([60.0, 80.0, 0.0]), 0.1)
    for _ in range(60):
        plant.write(JointCommand.servo(STAND, np.zeros(12), 60.0, 3.0))
    state, contacts = plant.read(), plant.foot_contacts()
    touching = np.isfinite(contacts.p_world_contact[:, 0])
    assert touching.any()
    data = robot.createData()
    pin.forwardKinematics(robot, data, state.q, state.v)
    pin.updateFramePlacements(robot, data)
    for leg in np.flatnonzero(touching):
        frame = robot.getFrameId(FOOT_NAMES[leg])
        twist = pin.getFrameVelocity(robot, data, frame, pin.ReferenceFrame.LOCAL_WORLD_ALIGNED)
        arm = contacts.p_world_contact[leg] - data.oMf[frame].translation
        expected = twist.linear + np.cross(twist.angular, arm)
        assert np.allclose(contacts.v_world_contact[leg, :2], expected[:2], atol=EXACT)
        assert contacts.v_world_contact[leg, 2] == pytest.approx(0.0, abs=EXACT)
        assert not np.allclose(contacts.v_world_contact[leg], twist.linear, atol=1e-3)


def test_low_friction_lets_the_feet_slide_and_high_friction_does_not() -> None:
    slid = []
    for friction in (0.05, 1.0):
        plant = MujocoPlant(friction=friction)
        stand_up(plant)
        plant.push(np.array([0.0, 25.0, 0.0]), 0.5)
        start = plant.p_world_feet
        for _ in range(250):
            plant.write(JointCommand.servo(STAND, np.zeros(12), 60.0, 3.0))
        slid.append(np.linalg.norm(plant.p_world_feet - start, axis=1).max())
    assert slid[0] > 0.1
    assert slid[1] < 0.01


@pytest.mark.parametrize("at", ["base", "FR_thigh", "RL_foot"])
def test_a_push_in_flight_changes_momentum_by_force_times_duration(
    plant: MujocoPlant, robot: pin.Model, at: str
) -> None:
    before = momentum(robot, fly(plant, speed=0.0))
    force, duration = np.array([30.0, -20.0, 40.0]), 0.1
    plant.push(force, duration, at=at)
    hold = JointCommand.servo(STAND, np.zeros(12), 50.0, 2.0)
    for _ in range(75):  # 50 steps of pushing and 25 after it
        plant.write(hold)
    weight = np.array([0.0, 0.0, -plant.total_mass * GRAVITY])
    expected = force * duration + weight * 0.15
    gained = momentum(robot, plant.read())[:3] - before[:3]
    assert np.linalg.norm(gained - expected) < INTEGRATOR_TOLERANCE * np.linalg.norm(expected)


def test_a_push_at_a_foot_turns_the_robot_by_its_lever(
    plant: MujocoPlant, robot: pin.Model
) -> None:
    state = fly(plant, speed=0.0)
    com = pin.centerOfMass(robot, robot.createData(), state.q)
    arm = plant.p_world_feet[LEGS[3]] - com
    force = np.array([5.0, 7.0, -3.0])
    plant.push(force, plant.control_period, at="RR_foot")
    plant.write(JointCommand.torque(np.zeros(12)))
    gained = momentum(robot, plant.read())[3:]
    expected = np.cross(arm, force) * plant.control_period
    assert np.linalg.norm(gained - expected) < INTEGRATOR_TOLERANCE * np.linalg.norm(expected)


def test_pushes_overlay(plant: MujocoPlant) -> None:
    saved = plant.save()
    results = []
    for forces in ([30.0, 30.0], [60.0], [60.0, 60.0]):
        plant.restore(saved)
        fly(plant, speed=0.0)
        for force in forces:
            plant.push(np.array([force, 0.0, 0.0]), 0.02)
        for _ in range(20):
            plant.write(DAMPED)
        results.append(plant.read().q)
    assert np.allclose(results[0], results[1], atol=EXACT)
    assert not np.allclose(results[0], results[2], atol=1e-3)


def test_a_push_at_an_unknown_body_lists_the_known_ones(plant: MujocoPlant) -> None:
    with pytest.raises(CommandError, match=r"'tail'; valid: .*FL_foot.*base"):
        plant.push(np.ones(3), 0.1, at="tail")


@pytest.mark.parametrize(
    ("force", "duration"),
    [([np.nan, 0, 0], 0.1), ([1, 0, np.inf], 0.1), ([1, 0, 0], 0.0), ([1, 0, 0], np.nan)],
)
def test_a_push_that_is_not_finite_or_lasts_no_time_is_refused(
    plant: MujocoPlant, force: list[float], duration: float
) -> None:
    with pytest.raises(CommandError, match="push"):
        plant.push(np.array(force, dtype=float), duration)
