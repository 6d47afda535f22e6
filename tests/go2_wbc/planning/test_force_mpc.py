"""What the MPC looks at: where the feet will be of a robot that a push has thrown."""

import numpy as np
import pinocchio as pin
import pytest

from go2_wbc.contacts import GAITS
from go2_wbc.planning.command import VelocityCommand
from go2_wbc.planning.footholds import is_thrown
from go2_wbc.planning.force_mpc import (
    excess_velocity,
    fill_contacts,
    inertia_about_com,
    look_ahead,
    turn_from,
)
from go2_wbc.planning.gait_clock import Clock
from go2_wbc.planning.locomotion import LocomotionConfig, LocomotionPlanner
from go2_wbc.planning.mpc import INTERVAL, NODES, STEP, Horizon
from go2_wbc.planning.trunk import Trunk
from go2_wbc.planning.walk import Planner, Walk
from go2_wbc.robot.rotations import yaw_rotation
from go2_wbc.robot.state import Snapshot
from tests.engine_helpers import standing_q, state_of
from tests.go2_wbc.planning.squared import MODEL, at, moving, resting

CONFIG = LocomotionConfig()
COMMAND = VelocityCommand(0.5)
ARC = VelocityCommand(0.5, -0.1, 0.4)
FARTHEST = 0.65  # m, a foot from the CoM at 3.7 m/s: 0.60


def test_feet_of_a_thrown_robot_come_down_below_it() -> None:
    """With the wanted way they were 1.03 m from it; forces planned for these tipped it over."""
    planner, thrown = LocomotionPlanner(MODEL, GAITS["trot"], CONFIG), resting()
    planner.start(thrown)
    for tick in range(30):
        thrown = at(moving(resting(), np.array([3.7, 0.0, 0.0])), 0.01 * tick)
        planner.update(thrown, COMMAND)
    look_ahead(thrown, planner._state, planner._walk, planner._command)
    seen = planner._state.horizon
    presses = seen.share >= CONFIG.mpc.least_share
    assert presses.any(axis=0).all()
    assert np.linalg.norm(seen.arms[presses][:, :2], axis=1).max() <= FARTHEST


@pytest.mark.parametrize("seed", range(3))
def test_the_inertia_and_the_turn_are_those_of_rigid_body_dynamics(seed: int) -> None:
    """Centroidal inertia: Pinocchio's Ig, of the composite body; the turn: log(R R_ref')."""
    rng, q = np.random.default_rng(seed), standing_q()
    q[3:7] = pin.Quaternion(pin.exp3(rng.uniform(-0.8, 0.8, 3))).coeffs()
    q[7:] += rng.uniform(-0.3, 0.3, 12)
    now, inertia, turn = MODEL.snapshot(state_of(q)), np.empty((3, 3)), np.empty(3)
    data = MODEL.pin_model.createData()
    pin.ccrba(MODEL.pin_model, data, q, np.zeros(18))
    inertia_about_com(now, inertia)
    np.testing.assert_allclose(inertia, data.Ig.inertia, atol=1e-9)
    turn_from(now, 0.7, turn)
    np.testing.assert_allclose(turn, pin.log3(now.R_world_base @ yaw_rotation(0.7).T), atol=1e-9)


@pytest.mark.parametrize("duty", [0.4, 0.5, 0.8, 1.0])
@pytest.mark.parametrize("time", [0.0, 0.07, 0.13, 0.29])
def test_the_contacts_ahead_are_those_of_the_clock_looked_at_finely(
    duty: float, time: float
) -> None:
    """Share: integral over the node; landings: strides until it stands for the node's beginning."""
    period, offsets, fine = 0.36, np.array([0.0, 0.5, 0.25, 0.75]), 2000
    horizon = Horizon()
    fill_contacts(Clock(time=time, period=period, duty=duty, offsets=offsets), horizon)
    for leg, k in np.ndindex(4, NODES):
        instants = time + STEP * (k + (np.arange(fine) + 0.5) / fine)
        stands = (instants / period - offsets[leg]) % 1.0 < duty
        assert horizon.share[k, leg] == pytest.approx(stands.mean(), abs=2.0 / fine)
        now, then = ((t / period - offsets[leg]) for t in (time, time + k * STEP))
        if duty >= 1.0 or (then % 1.0 < duty and np.floor(then) == np.floor(now)):
            assert horizon.landings[k, leg] <= 0.0
        else:  # the stride's beginning, counted from now
            begin = np.floor(then) + (0.0 if then % 1.0 < duty else 1.0)
            assert horizon.landings[k, leg] == pytest.approx(begin - now)


def steady(yaw: float, command: VelocityCommand = ARC) -> tuple[Snapshot, LocomotionPlanner]:
    """A robot that trots with ``command``, and has for long, in the heading ``yaw``."""
    way = yaw_rotation(yaw) @ [command.linear_x, command.linear_y, 0.0]
    planner, now = LocomotionPlanner(MODEL, GAITS["trot"], CONFIG), moving(resting(0.0, yaw), way)
    now = now.replaced(p_world_com=now.p_world_com + [0.03, -0.02, 0.0])
    planner.start(now)
    planner._state.trunk.velocity[:] = command.linear_x, command.linear_y, command.angular_z
    planner.update(now, command)
    look_ahead(now, planner._state, planner._walk, planner._command)
    return now, planner


def test_a_steady_command_is_integrated_along_its_arc() -> None:
    _, planner = steady(0.6)
    trunk, goals = planner._state.trunk, planner._state.horizon.goals
    yaw = trunk.yaw + ARC.angular_z * STEP * np.arange(1, NODES + 1)
    c, s, (x, y) = np.cos(yaw), np.sin(yaw), (ARC.linear_x, ARC.linear_y)
    way = np.column_stack([c * x - s * y, s * x + c * y])
    np.testing.assert_allclose(goals[:, 9:11], way, atol=1e-12)
    np.testing.assert_allclose(goals[:, 3:5], trunk.position[:2] + STEP * way.cumsum(0), atol=1e-12)
    np.testing.assert_allclose(goals[:, 2], yaw - trunk.yaw, atol=1e-12)
    np.testing.assert_allclose(goals[:, 8], ARC.angular_z, atol=1e-12)
    assert np.ptp(goals[:, 5]) == pytest.approx(0.0, abs=1e-12)
    assert np.abs(goals[:, [0, 1, 11]]).max() == pytest.approx(0.0, abs=1e-12)


def test_on_a_straight_way_arms_reach_to_feet_that_stay_and_to_those_below_the_hips() -> None:
    """A foot that lands once more is below its hip in the middle of its stance."""
    now, planner = steady(0.4, VelocityCommand(0.5, -0.1))
    h, clock, v = planner._state.horizon, planner._state.clock, now.v_world_com[:2]
    hips = (planner._walk.p_base_feet_nominal * [1.0, clock.width, 1.0]) @ yaw_rotation(0.4).T
    base = now.q[:2] + now.com_shift[:2]
    kinds = np.zeros(3, dtype=int)
    for k, leg in np.ndindex(NODES, 4):
        found = now.p_world_com[:2] + v * STEP * (k + 0.5) + h.arms[k, leg, :2]
        landing = h.landings[k, leg]
        if landing == 0.0:
            kind, wanted = 0, now.p_world_feet[leg, :2]
        elif landing < 1.0 - clock.duty:
            kind, wanted = 1, now.p_world_com[:2] + v * STEP * 0.5 + h.arms[0, leg, :2]
        else:
            middle = (landing + clock.duty / 2) * clock.period
            kind, wanted = 2, base + hips[leg, :2] + v * middle
        np.testing.assert_allclose(found, wanted, atol=1e-9)
        kinds[kind] += 1
    assert kinds.min() >= 4, "of each kind"
    np.testing.assert_allclose(now.p_world_com[2] + h.arms[..., 2], 0.0, atol=2e-3)


def test_the_accelerations_are_those_that_the_planned_forces_make() -> None:
    """Newton and Euler, about the CoM, of the forces of the feet that stand."""
    now, planner = steady(0.3)
    plan, h = (
        [planner.update(at(now, k * INTERVAL), ARC) for k in range(17)][-1],
        planner._state.horizon,
    )
    assert np.abs(h.share[0] - h.share[1]).min() > 0.5, "feet land and leave in the first nodes"
    stood = np.maximum(h.share[0], CONFIG.mpc.least_share)[:, None]
    forces = np.where(plan.stance[:, None], h.forces[0] / stood, 0.0)
    np.testing.assert_allclose(plan.f_world_feet, forces, atol=1e-12)
    contacts = now.p_world_feet - [0.0, 0.0, MODEL.foot_radius]
    inertia, moment = np.empty((3, 3)), np.cross(contacts - now.p_world_com, forces).sum(axis=0)
    inertia_about_com(now, inertia)
    weight = [0.0, 0.0, -MODEL.gravity]
    np.testing.assert_allclose(plan.body.a_world, forces.sum(0) / MODEL.mass + weight, atol=1e-9)
    np.testing.assert_allclose(inertia @ plan.body.dw_world, moment, atol=1e-9)


def test_within_the_margin_the_wanted_way_counts() -> None:
    walk, wanted = Walk.of(MODEL, GAITS["trot"], CONFIG), np.array([0.3, 0.1])
    planner, margin = Planner(trunk=Trunk(velocity=np.array([*wanted, 0.0]))), CONFIG.stride_margin
    for beyond, left in (((0.6, -0.8), 0.0), ((0.0, 1.0 + 1.0 / margin), 1.0), ((0.0, 0.0), 0.0)):
        velocity = wanted + margin * np.array(beyond)
        found = excess_velocity(moving(resting(), np.array([*velocity, 0.0])), planner, walk)
        np.testing.assert_allclose(found, [0.0, left], atol=1e-12)


@pytest.mark.parametrize(
    ("beyond", "thrown"),
    [
        ((1.1, 0.0), True),
        ((0.9, 0.0), False),
        ((0.0, 1.6), True),
        ((-0.9, 0.0), False),
        ((0.0, 0.0), False),
    ],
)
def test_who_is_slower_than_it_shall_be_is_not_thrown(
    beyond: tuple[float, float], thrown: bool
) -> None:
    walk, wanted, yaw = Walk.of(MODEL, GAITS["trot"], CONFIG), np.array([0.4, 0.0]), 0.7
    planner = Planner(trunk=Trunk(velocity=np.array([*wanted, 0.0]), yaw=yaw))
    velocity = wanted + CONFIG.stride_margin * np.array(beyond)
    world = yaw_rotation(yaw) @ np.array([*velocity, 0.0])
    assert is_thrown(moving(resting(), world), planner, walk) == thrown


def test_the_attitude_of_a_thrown_robot_weighs_less() -> None:
    """Kept with all its weight, feet in the air were swung 0.2 m off to turn the trunk."""
    planner = LocomotionPlanner(MODEL, GAITS["trot"], CONFIG)
    planner.start(resting())
    margin, unit, discounts = CONFIG.stride_margin, CONFIG.mpc.throw_speed, []
    for tick, aside in enumerate((0.0, 0.9 * margin, margin + unit, margin + 4.0 * unit), 1):
        thrown = at(moving(resting(), np.array([0.0, aside, 0.0])), 0.001 * tick)
        discounts.append(planner.update(thrown, COMMAND).orientation_discount)
    np.testing.assert_allclose(discounts, [0.0, 0.0, 1.0, 4.0], atol=1e-3)
