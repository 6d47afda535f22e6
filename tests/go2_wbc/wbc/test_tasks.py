"""Tasks: A z - b is the acceleration of what they track, minus the one their law asks for."""

from dataclasses import replace

import numpy as np
import pinocchio as pin
import pytest

from go2_wbc.legs import LEGS
from go2_wbc.reference import LegTask, Reference, Target, TrackedPoint
from go2_wbc.robot.model import RobotModel
from go2_wbc.robot.rigid_body import Payload
from go2_wbc.robot.rotations import log_rotation
from go2_wbc.robot.state import Snapshot
from go2_wbc.wbc.tasks import (
    BodyOrientation,
    BodyPosition,
    ForceRegularisation,
    Gains,
    LegPosture,
    SwingFoot,
    Task,
    orientation_error,
)
from go2_wbc.wbc.trajectory_loads import plan_loads
from tests.engine_helpers import (
    JO,
    MODES,
    ST,
    SW,
    moved,
    random_reference,
    random_state,
    with_planned_forces,
)

MODEL = RobotModel()
SEEDS = range(12)
STEP = 1e-5  # [s] of the central differences
DIFFERENCE = 1e-5  # [m/s^2, rad/s^2] error of a first difference of a velocity; measured 1e-8
EXACT = 1e-10  # rounding of numbers up to 100
LOGARITHM = 1e-12  # [rad] measured 7e-15, next to 3 rad
GAINS = Gains((60.0, 50.0, 40.0), (15.0, 14.0, 13.0))
KP, KD = GAINS.arrays
LEGS_OF_ALL_KINDS = (ST, SW, JO, SW)


def scene(seed: int) -> tuple[Snapshot, Reference, np.ndarray]:
    """A snapshot, a reference with every kind of leg, and a decision vector."""
    rng = np.random.default_rng(seed)
    snapshot = MODEL.snapshot(random_state(rng))
    reference = random_reference(snapshot, LEGS_OF_ALL_KINDS, 2.0, rng)
    return snapshot, reference, rng.normal(scale=3.0, size=30)


def residual(task: Task, snapshot: Snapshot, reference: Reference, z: np.ndarray) -> np.ndarray:
    rows = task.rows(snapshot, reference)
    return rows.A @ z - rows.b


def neighbours(snapshot: Snapshot, z: np.ndarray) -> tuple[Snapshot, Snapshot]:
    """Just before and just after, along the motion with the accelerations of ``z``."""
    before, after = (moved(MODEL, snapshot.state, z[:18], dt) for dt in (-STEP, STEP))
    return MODEL.snapshot(before), MODEL.snapshot(after)


def balanced(snapshot: Snapshot, reference: Reference, z: np.ndarray) -> np.ndarray:
    """The same, with the acceleration of the base that joints and standing feet lead to."""
    forces = np.where(reference.stance[:, None], z[18:].reshape(4, 3), 0.0)
    M, h, J = snapshot.mass_matrix[:6], snapshot.bias[:6], snapshot.J_contacts[:, :, :6]
    pushed = np.einsum("fai,fa->i", J, forces) - h - M[:, 6:] @ z[6:18]
    return np.concatenate([np.linalg.solve(M[:, :6], pushed), z[6:18], forces.ravel()])


@pytest.mark.parametrize("point", list(TrackedPoint))
@pytest.mark.parametrize("seed", SEEDS)
def test_body_position_compares_the_points_acceleration_with_the_law(
    seed: int, point: TrackedPoint
) -> None:
    snapshot, reference, z = scene(seed)
    target = replace(reference.body, point=point)
    reference = replace(reference, body=target)
    z = balanced(snapshot, reference, z)
    before, after = neighbours(snapshot, z)
    if point is TrackedPoint.COM:
        p, v = snapshot.p_world_com, snapshot.v_world_com
        rate = (after.v_world_com - before.v_world_com) / (2 * STEP)
    else:
        p, v = snapshot.state.p_world_base, snapshot.R_world_base @ snapshot.state.v[:3]
        ends = [s.R_world_base @ s.state.v[:3] for s in (before, after)]
        rate = (ends[1] - ends[0]) / (2 * STEP)
    wanted = target.a_world + KD * (target.v_world - v) + KP * (target.p_world - p)
    weight = MODEL.mass * MODEL.gravity
    found = residual(BodyPosition(GAINS, weight), snapshot, reference, z)
    np.testing.assert_allclose(found, rate - wanted, atol=DIFFERENCE)


@pytest.mark.parametrize("seed", SEEDS)
def test_body_orientation_compares_the_angular_acceleration_in_base_axes(seed: int) -> None:
    snapshot, reference, z = scene(seed)
    target, R = reference.body, snapshot.R_world_base
    before, after = neighbours(snapshot, z)
    w_world = [s.R_world_base @ s.state.v[3:6] for s in (before, after)]
    rate = R.T @ (w_world[1] - w_world[0]) / (2 * STEP)
    error = log_rotation(R.T @ target.R_world_base)
    w = R @ snapshot.state.v[3:6]
    wanted = R.T @ target.dw_world + KD * (R.T @ (target.w_world - w)) + KP * error
    found = residual(BodyOrientation(GAINS), snapshot, reference, z)
    np.testing.assert_allclose(found, rate - wanted, atol=DIFFERENCE)


@pytest.mark.parametrize("angle", [0.0, 1e-7, 1e-3, 1.0, 2.9, 2.999, 3.001, 3.1, np.pi - 1e-6])
@pytest.mark.parametrize("seed", range(4))
def test_the_attitudes_error_is_the_logarithm_up_to_a_turn_by_pi(seed: int, angle: float) -> None:
    snapshot, reference, _ = scene(seed)
    axis = np.random.default_rng(seed).normal(size=3)
    turn = angle * axis / np.linalg.norm(axis)
    R_des = snapshot.R_world_base @ pin.exp3(turn)
    reference = replace(reference, body=replace(reference.body, R_world_base=R_des))
    error = orientation_error(snapshot, Target.of(reference.row))
    np.testing.assert_allclose(error, turn, atol=LOGARITHM)


def test_a_payload_falls_with_the_robot_and_is_borne_evenly_by_its_feet() -> None:
    """The CoM's acceleration is that of all mass, under all weight."""
    bare, reference, z = scene(3)
    snapshot = MODEL.snapshot(bare.state, Payload(4.0, (0.05, 0.08, 0.1)))
    target = replace(reference.body, point=TrackedPoint.COM)
    reference = replace(reference, body=target)
    z = balanced(snapshot, reference, z)
    a_com = snapshot.J_com @ z[:18] + snapshot.drift_com
    wanted = (
        target.a_world
        + KD * (target.v_world - snapshot.v_world_com)
        + KP * (target.p_world - snapshot.p_world_com)
    )
    task = BodyPosition(GAINS, MODEL.mass * MODEL.gravity)
    np.testing.assert_allclose(residual(task, snapshot, reference, z), a_com - wanted, atol=1e-9)
    reference = replace(reference, legs=(ST, SW, ST, ST))
    found = residual(ForceRegularisation(160.0), snapshot, reference, z).reshape(3, 3)
    share = (160.0 + 4.0 * MODEL.gravity) / 3.0
    np.testing.assert_allclose(found[:, 2], z[[20, 26, 29]] - share, atol=EXACT)


def test_the_attitude_weighs_less_in_flight_and_by_a_discount() -> None:
    """It weighed ten times as much, and feet landed 0.1 m behind their footholds."""
    _, reference, _ = scene(1)
    flying = replace(reference, legs=(LegTask.SWING,) * 4)
    task = BodyOrientation(GAINS, weight=10.0, flight_weight=0.05)
    assert task.weight_at(reference) == 10.0
    assert task.weight_at(flying) == 0.05
    assert BodyOrientation(GAINS, weight=0.0).weight_at(flying) == 0.0, "a task that is off"
    _, reference, _ = scene(0)
    task = BodyOrientation(Gains.uniform(1.0, 1.0), weight=10.0, flight_weight=3.0)
    discounted = replace(reference, orientation_discount=4.0)
    assert (task.weight_at(reference), task.weight_at(discounted)) == (10.0, 2.0)
    flying = replace(discounted, legs=(SW,) * 4, orientation_discount=1.0)
    assert task.weight_at(flying) == 3.0


@pytest.mark.parametrize("seed", SEEDS)
def test_swing_feet_compare_the_foot_centres_acceleration_with_the_law(seed: int) -> None:
    snapshot, reference, z = scene(seed)
    before, after = neighbours(snapshot, z)
    rate = (after.v_world_feet - before.v_world_feet) / (2 * STEP)
    wanted = (
        reference.a_world_feet
        + KD * (reference.v_world_feet - snapshot.v_world_feet)
        + KP * (reference.p_world_feet - snapshot.p_world_feet)
    )
    found = residual(SwingFoot(GAINS), snapshot, reference, z).reshape(-1, 3)
    np.testing.assert_allclose(found, (rate - wanted)[[1, 3]], atol=DIFFERENCE)


@pytest.mark.parametrize("seed", SEEDS)
def test_leg_posture_compares_joint_accelerations_with_the_law(seed: int) -> None:
    snapshot, reference, z = scene(seed)
    state = snapshot.state
    wanted = (
        reference.a_joints
        + np.tile(KD, 4) * (reference.v_joints - state.joint_velocities)
        + np.tile(KP, 4) * (reference.q_joints - state.joint_positions)
    )
    found = residual(LegPosture(GAINS), snapshot, reference, z)
    np.testing.assert_allclose(found, (z[6:18] - wanted)[6:9], atol=EXACT)


@pytest.mark.parametrize("legs", MODES)
def test_the_forces_are_regularised_around_an_even_share_of_the_weight(legs: tuple) -> None:
    snapshot, reference, z = scene(0)
    stance = np.array([task is ST for task in legs])
    reference = replace(reference, legs=legs)
    found = residual(ForceRegularisation(160.0), snapshot, reference, z)
    wanted = (z[18:].reshape(4, 3) - [0.0, 0.0, 160.0 / max(stance.sum(), 1)])[stance]
    if stance.any():
        loads = np.empty(4)
        plan_loads(snapshot, Target.of(reference.row), 160.0, loads)
        wanted[:, :2] /= np.sqrt(loads[stance])[:, None]
    np.testing.assert_allclose(found, wanted.ravel(), atol=EXACT)


@pytest.mark.parametrize("legs", MODES)
def test_planned_forces_and_their_weight_take_the_place_of_the_even_share(legs: tuple) -> None:
    snapshot, reference, z = scene(0)
    task, stance = ForceRegularisation(160.0), np.array([kind is ST for kind in legs])
    reference = replace(reference, legs=legs)
    assert task.weight_at(reference) == task.weight
    planned = with_planned_forces(reference, np.random.default_rng(1))
    assert task.weight_at(planned) == planned.force_weight
    found = residual(task, snapshot, planned, z)
    wanted = (z[18:].reshape(4, 3) - planned.f_world_feet)[stance].ravel()
    np.testing.assert_allclose(found, wanted, atol=EXACT)


@pytest.mark.parametrize("legs", MODES)
def test_each_leg_has_rows_in_the_task_it_is_given_and_in_no_other(legs: tuple) -> None:
    snapshot, reference, _ = scene(0)
    reference = replace(reference, legs=legs)
    tasks = {SW: SwingFoot(GAINS), JO: LegPosture(GAINS), ST: ForceRegularisation(160.0)}
    for kind, task in tasks.items():
        rows = task.rows(snapshot, reference)
        assert rows.A.shape == (3 * legs.count(kind), 30)
        used = np.abs(rows.A).sum(axis=0)
        for leg in LEGS:
            columns = used[18:].reshape(4, 3)[leg] if kind is ST else used[leg.velocities]
            assert columns.any() == (legs[leg] is kind)


def test_uniform_gains_are_the_same_on_each_axis() -> None:
    kp, kd = Gains.uniform(500.0, 40.0).arrays
    np.testing.assert_array_equal(kp, [500.0] * 3)
    np.testing.assert_array_equal(kd, [40.0] * 3)
