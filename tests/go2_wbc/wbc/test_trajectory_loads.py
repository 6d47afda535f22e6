"""Shares of the load along a trajectory: balance, contact Jacobians, and compiled against plain."""

import numpy as np
import pinocchio as pin
import pytest

from go2_wbc.records import packed
from go2_wbc.robot.leg_kinematics import leg_table
from go2_wbc.robot.model import RobotModel
from go2_wbc.wbc.constraints import friction_pyramid
from go2_wbc.wbc.solvers import DenseQp, solve_dense_qp
from go2_wbc.wbc.trajectory_loads import (
    LEAST_PRESSURE,
    LoadNumbers,
    accelerate,
    lag,
    least_friction,
    share_load,
    share_loads,
    slide,
)
from tests.compiled import assert_plain_is_compiled
from tests.engine_helpers import random_state, standing_q, state_of

COUNT = 20
OPTIMUM = 1e-5  # N; what the solvers leave
BALANCE = 1e-2  # N, N m; what the evenness of the load takes off the wrench
MODEL = RobotModel()
WEIGHT = MODEL.mass * MODEL.gravity
NUMBERS = packed(LoadNumbers(1e-4, WEIGHT, 400.0, MODEL.foot_radius))
SCALE = np.array([1.0, 1.0, 1.0, 5.0, 5.0, 5.0])
PYRAMID = friction_pyramid(0.6)


def standing(seed: int) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """Joints, attitudes, M a + h and shares of the load of robots that stand somehow."""
    rng = np.random.default_rng(seed)
    states = [random_state(rng) for _ in range(COUNT)]
    snapshots = [MODEL.snapshot(state_of(state.q)) for state in states]
    needed = np.array([snapshot.bias for snapshot in snapshots])
    needed[COUNT // 2 :] += rng.normal(scale=10.0, size=(COUNT - COUNT // 2, 18))
    R = np.array([snapshot.R_world_base for snapshot in snapshots])
    return (
        np.array([state.q[7:] for state in states]),
        R,
        needed,
        rng.choice([0, 0.5, 1], (COUNT, 4)),
    )


def test_a_standing_robot_is_in_balance() -> None:
    snapshot = MODEL.snapshot(state_of(standing_q()))
    contact, tau, missing = np.zeros((1, 4, 3)), snapshot.bias[None, 6:].copy(), np.empty((1, 2))
    given = (standing_q()[None, 7:].copy(), np.eye(3)[None], snapshot.bias[None, :6].copy())
    tables = (np.ones((1, 4)), leg_table(MODEL), PYRAMID, SCALE, NUMBERS)
    share_loads(*given, *tables, contact, tau, missing)
    assert contact[0].sum(axis=0) == pytest.approx([0.0, 0.0, WEIGHT], abs=BALANCE)
    arms = snapshot.p_world_feet - snapshot.p_world_com - [0.0, 0.0, MODEL.foot_radius]
    assert np.cross(arms, contact[0]).sum(axis=0) == pytest.approx(np.zeros(3), abs=BALANCE)
    J = snapshot.J_contacts.reshape(12, 18)
    assert tau[0] == pytest.approx(snapshot.bias[6:] - J[:, 6:].T @ contact[0].ravel(), abs=1e-9)
    assert missing.max() < BALANCE


def optimum(
    A: np.ndarray, wrench: np.ndarray, shares: np.ndarray, places: np.ndarray, turned: np.ndarray
) -> np.ndarray:
    """The forces by another solver, of contacts at ``places``; ``turned``: along the world's axes.

    ``wrench`` is along the trunk's.
    """
    k, force, moment = len(shares), turned[:3], turned[3:]
    pressure = max(force[2], LEAST_PRESSURE * WEIGHT)
    depth = -places[:, 2].mean()
    point = [-(moment[1] + depth * force[0]), moment[0] - depth * force[1]] / pressure
    loads, (x, y) = np.empty(k), point
    share_load(places[:, :2].copy(), x, y, 400.0 * shares * k / pressure, loads)
    weights = 1e-4 * np.column_stack([1.0 / loads, 1.0 / loads, np.ones(k)]).ravel()
    even = np.zeros((k, 3))
    even[:, 2] = WEIGHT * shares / shares.sum()
    SA = SCALE[:, None] * A
    H, g = SA.T @ SA + np.diag(weights), -SA.T @ (SCALE * wrench) - 1e-4 * even.ravel()
    upper = np.zeros((k, 5))
    upper[:, 4] = 400.0 * shares
    lower = np.tile([-np.inf] * 4 + [0.0], k)
    return solve_dense_qp(DenseQp(H, g, np.kron(np.eye(k), PYRAMID), lower, upper.ravel()), "daqp")


def test_forces_are_the_optimum_and_torques_what_they_leave() -> None:
    joints, R, needed, shares = standing(5)
    contact, tau, missing = np.zeros((COUNT, 4, 3)), needed[:, 6:].copy(), np.empty((COUNT, 2))
    tables = (shares, leg_table(MODEL), PYRAMID, SCALE, NUMBERS)
    share_loads(joints, R, needed[:, :6].copy(), *tables, contact, tau, missing)
    for row in range(COUNT):
        q = np.concatenate([np.zeros(3), pin.Quaternion(R[row]).coeffs(), joints[row]])
        snapshot, stands = MODEL.snapshot(state_of(q)), shares[row] > 0.0
        J, f = snapshot.J_contacts[stands].reshape(-1, 18), contact[row, stands].ravel()
        turn = np.kron(np.eye(2), R[row])  # what the trunk needs is given along its own axes
        if stands.any():
            places = snapshot.p_world_feet[stands] - [0.0, 0.0, MODEL.foot_radius]
            A, w = J[:, :6].T, needed[row, :6]
            expected = optimum(A, w, shares[row, stands], places, turn @ w)
            np.testing.assert_allclose(f, expected, atol=OPTIMUM)
        left = needed[row] - J.T @ f
        np.testing.assert_allclose(tau[row], left[6:], atol=1e-9)
        lengths = [np.linalg.norm(left[:3]), np.linalg.norm(left[3:6])]
        np.testing.assert_allclose(missing[row], lengths, atol=1e-9)
        assert not contact[row, ~stands].any()


def test_a_foot_slides_ahead_and_creeps_besides() -> None:
    """By hand: in the first tick a force of 10 N more than friction holds, and then none."""
    forces, creep = np.zeros((3, 4, 3)), np.zeros((3, 4, 2))
    forces[:, :, 2], forces[0, :, :2] = 20.0, [[18.0, 0.0], [0.0, -18.0], [7.9, 0.0], [0.0, 0.0]]
    creep[:, 0], creep[:, 1], creep[:, 3] = (0.5, 0.0), (0.0, 0.25), (0.0, 0.3)
    ways, dt = np.zeros((3, 4)), 0.1
    slide(forces, creep, np.ones((3, 4), dtype=bool), 0.4, 2.0, dt, ways)
    # 10 N on 2 kg for 0.1 s: 0.5 m/s, which friction takes away at 4 m/s^2: 0.1 m/s, then rest
    np.testing.assert_allclose(ways[:, 0], np.cumsum([dt * 1.0, dt * 0.6, dt * 0.5]))
    np.testing.assert_allclose(ways[:, 1], np.abs(np.cumsum([-dt * 0.25, dt * 0.15, dt * 0.25])))
    assert not ways[:, 2].any()
    np.testing.assert_allclose(ways[:, 3], 0.3 * dt * np.arange(1, 4))


def test_accelerations_of_the_contacts_are_those_of_the_snapshots_jacobians() -> None:
    rng = np.random.default_rng(2)
    for _ in range(COUNT):
        state, a, feet = random_state(rng), rng.normal(size=(1, 18)), np.empty((1, 4, 2))
        snapshot = MODEL.snapshot(state)
        given = (state.q[None, 7:].copy(), snapshot.R_world_base[None].copy(), a)
        accelerate(*given, leg_table(MODEL), MODEL.foot_radius, feet)
        np.testing.assert_allclose(feet[0], (snapshot.J_contacts @ a[0])[:, :2], atol=1e-12)
        assert_plain_is_compiled(accelerate, *given, leg_table(MODEL), MODEL.foot_radius, feet)


def test_compiled_is_plain() -> None:
    rng = np.random.default_rng(3)
    joints, R, needed, shares = standing(4)
    given = (joints, R, needed[:, :6].copy(), shares, leg_table(MODEL))
    made = (np.zeros((COUNT, 4, 3)), needed[:, 6:].copy(), np.empty((COUNT, 2)))
    assert_plain_is_compiled(share_loads, *given, PYRAMID, SCALE, NUMBERS, *made, tolerance=1e-7)
    asked = (np.full(COUNT, 1.0), 0.05, np.zeros(COUNT))
    assert_plain_is_compiled(least_friction, *given, friction_pyramid(1.0), SCALE, NUMBERS, *asked)
    forces, creep = 30.0 * rng.normal(size=(99, 4, 3)), rng.normal(size=(99, 4, 2))
    counts = rng.random((99, 4)) < 0.9
    assert_plain_is_compiled(slide, forces, creep, counts, 0.4, 2.0, 0.01, np.zeros((99, 4)))
    pushes, gains = rng.normal(size=(99, 3)), np.array([90.0, 100.0, 110.0])
    assert_plain_is_compiled(lag, pushes, gains, 0.2 * gains, 0.01, np.empty((99, 3)))
