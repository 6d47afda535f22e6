"""Constraints: their rows mean what they say, for random motions, forces and joint states."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from go2_wbc.robot.model import RobotModel
from go2_wbc.robot.state import Snapshot
from go2_wbc.wbc.config import WbcConfig
from go2_wbc.wbc.constraints import (
    Constraints,
    FloatingBaseDynamics,
    FrictionPyramid,
    JointLimits,
    StanceFeetStill,
    TorqueLimits,
    friction_pyramid,
    torque_map,
)
from tests.engine_helpers import (
    FOUR_FEET,
    MODES,
    holding_reference,
    moved,
    random_reference,
    random_state,
    standing_q,
    state_of,
)

MODEL = RobotModel()
SEEDS = range(12)
STEP = 1e-5  # [s] of the central differences
DIFFERENCE = 1e-5  # [m/s^2] error of a first difference of a velocity; measured 1e-8
EXACT = 1e-9  # rounding of sums of numbers up to 1000
MU = 0.6
BRAKING, HORIZON = 200.0, 0.02
TICK = 0.002  # [s] the control period
STOP_TOLERANCE = 5e-3  # [rad] of a bound that is renewed every tick; measured 4.4e-3
AT_REST = 0.01  # [rad/s] after 4 s
NEARBY = 0.05  # [rad]


def scene(seed: int, legs: tuple = FOUR_FEET) -> tuple:
    rng = np.random.default_rng(seed)
    snapshot = MODEL.snapshot(random_state(rng))
    z = rng.normal(scale=5.0, size=30)
    z[18:] *= 10.0
    return snapshot, random_reference(snapshot, legs, 2.0, rng), z


@pytest.mark.parametrize("seed", SEEDS)
def test_base_rows_and_torques_are_the_inverse_dynamics_less_the_contact_forces(seed: int) -> None:
    snapshot, reference, z = scene(seed)
    state = snapshot.state
    generalised = MODEL.inverse_dynamics(state.q, state.v, z[:18])
    for J, force in zip(snapshot.J_contacts, z[18:].reshape(4, 3), strict=True):
        generalised = generalised - J.T @ force
    rows = FloatingBaseDynamics().rows(snapshot, reference)
    np.testing.assert_allclose(rows.A @ z - rows.b, generalised[:6], atol=EXACT)
    A, offset = torque_map(snapshot)
    np.testing.assert_allclose(A @ z + offset, generalised[6:], atol=EXACT)


@pytest.mark.parametrize("seed", SEEDS)
@pytest.mark.parametrize("damping", [0.0, 20.0])
def test_stance_rows_ask_the_contact_velocity_to_decay(seed: int, damping: float) -> None:
    snapshot, reference, z = scene(seed, MODES[seed % len(MODES)])
    before, after = (
        MODEL.snapshot(moved(MODEL, snapshot.state, z[:18], dt)) for dt in (-STEP, STEP)
    )
    rate = (after.v_world_contacts - before.v_world_contacts) / (2 * STEP)
    wanted = -damping * snapshot.v_world_contacts
    rows = StanceFeetStill(damping).rows(snapshot, reference)
    expected = (rate - wanted)[reference.stance].ravel()
    np.testing.assert_allclose(rows.A @ z - rows.b, expected, atol=DIFFERENCE)


@pytest.mark.parametrize("share", [-1.2, -0.7, 0.7, 1.2])
def test_torque_limits_follow_the_motors_line_at_the_measured_speed(share: float) -> None:
    snapshot, reference, z = scene(1)
    v = np.concatenate([snapshot.state.v[:6], share * MODEL.speed_limits])
    fast = MODEL.snapshot(replace(snapshot.state, v=v))
    bounds = TorqueLimits(MODEL.motor).bounds(fast, reference)
    A, offset = torque_map(fast)
    tau, value = A @ z + offset, bounds.C @ z
    lower, upper = MODEL.motor.limits(v[6:])
    np.testing.assert_allclose(bounds.upper - value, upper - tau, atol=EXACT)
    np.testing.assert_allclose(value - bounds.lower, tau - lower, atol=EXACT)
    assert ((upper if share > 0 else -lower) < 0.6 * MODEL.torque_limits).all()


SNAPSHOT = MODEL.snapshot(state_of(standing_q()))
newtons = st.floats(-200.0, 200.0)


@given(st.sampled_from(MODES), st.lists(newtons, min_size=12, max_size=12))
def test_a_force_meets_the_bounds_exactly_if_it_lies_in_the_pyramid(
    legs: tuple, values: list[float]
) -> None:
    least, greatest = np.array([0.0, 5.0, 10.0, 20.0]), np.array([50.0, 80.0, 120.0, 160.0])
    reference = replace(
        holding_reference(SNAPSHOT, legs), normal_force_min=least, normal_force_max=greatest
    )
    bounds = FrictionPyramid(MU).bounds(SNAPSHOT, reference)
    forces = np.array(values).reshape(4, 3)
    value = bounds.C @ np.concatenate([np.zeros(18), forces.ravel()])
    slack = np.minimum(bounds.upper - value, value - bounds.lower).reshape(-1, 5).min(axis=1)
    x, y, z = forces.T
    sideways = MU * z - np.maximum(np.abs(x), np.abs(y))
    expected = np.minimum(sideways, np.minimum(z - least, greatest - z))
    np.testing.assert_allclose(slack, expected[reference.stance], atol=EXACT)


@given(st.tuples(newtons, newtons), st.floats(-np.pi, np.pi))
def test_a_pyramid_in_the_cone_allows_most_along_the_planned_force(
    planned: tuple[float, float], direction: float
) -> None:
    f = np.array([*planned, 100.0])
    reference = replace(holding_reference(SNAPSHOT), f_world_feet=np.tile(f, (4, 1)))
    cone = FrictionPyramid(MU, keeps_cone=True)
    sides = cone.bounds(SNAPSHOT, replace(reference, force_weight=0.01)).C[:4, 18:21]
    f = np.array([np.cos(direction), np.sin(direction)])
    most = (-sides[:, 2]).min() / (sides[:, :2] @ f).max()
    assert MU / np.sqrt(2.0) - EXACT <= most <= MU + EXACT
    heading = np.arctan2(planned[1], planned[0])
    along = np.array([np.cos(heading), np.sin(heading)])
    assert (-sides[:, 2]).min() / (sides[:, :2] @ along).max() == pytest.approx(MU)


def test_only_planned_forces_are_kept_in_the_cone() -> None:
    f = np.tile([30.0, 20.0, 50.0], (4, 1))
    plain = holding_reference(SNAPSHOT, FOUR_FEET)
    planned = replace(plain, f_world_feet=f, force_weight=0.01)
    square, cone = FrictionPyramid(MU), FrictionPyramid(MU, keeps_cone=True)
    same = square.bounds(SNAPSHOT, planned).C
    np.testing.assert_array_equal(cone.bounds(SNAPSHOT, plain).C, same)
    np.testing.assert_array_equal(same[:5, 18:21], friction_pyramid(MU))
    other = cone.bounds(SNAPSHOT, planned).C
    assert (np.abs(other - same).reshape(4, 5, 30).max(axis=(1, 2)) > 0.1).all()


LIMITS = JointLimits(MODEL.q_lower, MODEL.q_upper, MODEL.speed_limits, BRAKING, HORIZON)
MIDDLE = (MODEL.q_lower + MODEL.q_upper) / 2


def test_joints_stop_a_margin_before_their_ends_and_go_a_share_of_their_speed() -> None:
    config = WbcConfig(joint_margin=0.05, speed_share=0.8)
    limits = Constraints.of(config, MODEL, MODEL.motor).joint
    np.testing.assert_allclose(limits.q_lower, MODEL.q_lower + 0.05)
    np.testing.assert_allclose(limits.q_upper, MODEL.q_upper - 0.05)
    np.testing.assert_allclose(limits.speed, 0.8 * MODEL.speed_limits)


def joint_snapshot(q: np.ndarray, v: np.ndarray) -> Snapshot:
    state = replace(
        SNAPSHOT.state, q=np.concatenate([standing_q()[:7], q]), v=np.concatenate([np.zeros(6), v])
    )
    return SNAPSHOT.replaced(state=state)


def joint_bounds(q: np.ndarray, v: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Least and greatest acceleration of each joint at angles ``q`` and speeds ``v``."""
    bounds = LIMITS.bounds(joint_snapshot(q, v), holding_reference(SNAPSHOT))
    np.testing.assert_array_equal(bounds.C, np.eye(30)[6:18])
    return bounds.lower, bounds.upper


joint_values = st.lists(st.floats(-1.5, 1.5), min_size=12, max_size=12).map(np.array)


@given(joint_values, joint_values)
def test_the_bounds_never_contradict_each_other_nor_ask_for_more_than_the_braking(
    where: np.ndarray, speed: np.ndarray
) -> None:
    q = MIDDLE + where * (MODEL.q_upper - MODEL.q_lower) / 2
    lower, upper = joint_bounds(q, speed * MODEL.speed_limits)
    assert (lower <= upper).all()
    assert (upper >= -BRAKING).all()
    assert (lower <= BRAKING).all()


@given(joint_values)
def test_beyond_a_limit_a_joint_that_rests_or_moves_out_has_to_come_back(speed: np.ndarray) -> None:
    out = np.abs(speed) * MODEL.speed_limits
    lower, upper = joint_bounds(MODEL.q_upper + 0.01, out)
    assert (upper < np.maximum(-out / HORIZON, -BRAKING + EXACT)).all()
    lower, upper = joint_bounds(MODEL.q_lower - 0.01, -out)
    assert (lower > np.minimum(out / HORIZON, BRAKING - EXACT)).all()


def test_a_joint_at_rest_far_from_its_limits_is_free_and_a_too_fast_one_slowed_down() -> None:
    lower, upper = joint_bounds(MIDDLE, np.zeros(12))
    assert (upper > BRAKING).all()
    assert (lower < -BRAKING).all()
    endless = replace(LIMITS, q_lower=MODEL.q_lower - 100.0, q_upper=MODEL.q_upper + 100.0)
    for sign in (1.0, -1.0):
        fast = joint_snapshot(MIDDLE, sign * (MODEL.speed_limits + 1.0))
        bounds = endless.bounds(fast, holding_reference(SNAPSHOT))
        slowing = bounds.upper if sign > 0 else -bounds.lower
        np.testing.assert_allclose(slowing, -1.0 / HORIZON, atol=EXACT)


def driven(direction: float, drive: float) -> tuple[np.ndarray, np.ndarray]:
    """How far [rad] every joint gets beyond its limit, driven by ``drive`` rad/s^2 for 4 s.

    Also the speeds [rad/s] at the end.
    """
    q, v = MIDDLE.copy(), np.zeros(12)
    limit = MODEL.q_upper if direction > 0 else MODEL.q_lower
    beyond = np.full(12, -np.inf)
    for _ in range(round(4.0 / TICK)):
        a = np.clip(np.full(12, direction * drive), *joint_bounds(q, v))
        q, v = q + v * TICK + a * TICK**2 / 2, v + a * TICK
        beyond = np.maximum(beyond, direction * (q - limit))
    return beyond, v


@pytest.mark.parametrize("direction", [1.0, -1.0])
@pytest.mark.parametrize("drive", [1.0, 20.0, 400.0])
def test_a_joint_that_is_driven_at_its_limit_stops_there(direction: float, drive: float) -> None:
    beyond, v = driven(direction, drive)
    assert (np.abs(v) < AT_REST).all()
    assert (beyond > -NEARBY).all()  # the whole range is used
    assert (beyond < STOP_TOLERANCE).all()
