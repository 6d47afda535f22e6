"""Shares of the load along a trajectory: balance, contact Jacobians, and compiled against plain."""

from __future__ import annotations

import numpy as np
import pytest

from go2_wbc.records import packed
from go2_wbc.robot.leg_kinematics import leg_table
from go2_wbc.robot.model import RobotModel
from go2_wbc.wbc.constraints import friction_pyramid
from go2_wbc.wbc.trajectory_loads import (
    LoadNumbers,
    accelerate,
    lag,
    least_friction,
    share_loads,
    slide,
)
from tests.compiled import assert_plain_is_compiled
from tests.engine_helpers import random_state, standing_q, state_of

COUNT = 20
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
