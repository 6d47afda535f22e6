"""The MPC is held to the program with stacked matrices, solved by another solver."""

import numpy as np
import pytest

from go2_wbc.algebra.active_set import SINGULAR, SOLVED
from go2_wbc.compilation import kernel
from go2_wbc.planning.mpc import NODES, Horizon, MpcConfig, solve_mpc
from go2_wbc.records import packed
from go2_wbc.wbc.solvers import DenseQp, solve_dense_qp
from tests.go2_wbc.planning.stacked_mpc import formulate

MASS, GRAVITY = 15.7, 9.79
AGREEMENT = 1e-4  # [N] between two solvers, of forces up to 250 N; measured 4e-6
IDENTITY = 1e-9
ODD = MpcConfig(
    angle_weights=(21.0, 17.0, 11.0),
    position_weights=(5.0, 6.0, 83.0),
    angular_weights=(0.3, 0.4, 0.5),
    linear_weights=(3.1, 2.7, 2.2),
    force_weight=3e-5,
    friction=0.47,
    force_max=170.0,
    least_share=0.05,
)
"""No two numbers alike, so that one in another's place is seen."""
HIPS = np.array([[0.19, 0.14], [0.19, -0.14], [-0.19, 0.14], [-0.19, -0.14]])
BELOW = np.tile(np.column_stack([HIPS, np.full(4, -0.3)]), (NODES, 1, 1))


def random_horizon(rng: np.random.Generator, haste: float) -> Horizon:
    """Any feet, in any part of any node; ``haste`` scales how far the goals are."""
    share = np.clip(rng.uniform(-1.0, 1.5, size=(NODES, 4)), 0.0, 1.0)
    down = -0.3 + 0.03 * rng.normal(size=(NODES, 4, 1))
    arms = np.concatenate([HIPS + 0.05 * rng.normal(size=(NODES, 4, 2)), down], axis=2)
    spread = np.repeat([0.05, 0.02, 0.5, 0.2], 3)
    half = 0.1 * rng.normal(size=(3, 3))
    return Horizon(
        state=haste * spread * rng.normal(size=12),
        goals=haste * spread * rng.normal(size=(NODES, 12)),
        share=share,
        arms=arms,
        inertia=np.diag([0.13, 0.35, 0.4]) + half @ half.T,
        mass=MASS,
        gravity=GRAVITY,
    )


compiled = kernel(solve_mpc)


def solved(config: MpcConfig, horizon: Horizon) -> tuple[int, np.ndarray]:
    horizon.friction = config.friction
    horizon.forces[:] = np.nan
    return compiled(packed(config), horizon), horizon.forces


@pytest.mark.parametrize("config", [MpcConfig(), ODD], ids=["default", "odd"])
def test_forces_are_those_of_the_stacked_program(config: MpcConfig) -> None:
    rng = np.random.default_rng(30)
    bounded = 0
    for index in range(24):
        horizon = random_horizon(rng, haste=(0.3, 1.0, 3.0)[index % 3])
        outcome, ours = solved(config, horizon)
        program = formulate(horizon, config)
        qp = DenseQp(program.H, program.g, program.C, program.lower, program.upper)
        theirs = program.forces(solve_dense_qp(qp, "daqp"))
        assert outcome == SOLVED
        np.testing.assert_allclose(ours, theirs, atol=AGREEMENT, rtol=0)
        free = program.forces(np.linalg.solve(program.H, -program.g))
        bounded += bool(np.abs(free - ours).max() > 1.0)
    assert bounded >= 8, "the bounds must count in a third of the problems"


def test_forces_keep_the_friction_pyramid_and_their_bounds() -> None:
    rng = np.random.default_rng(31)
    for _ in range(20):
        horizon = random_horizon(rng, haste=5.0)
        outcome, f = solved(ODD, horizon)
        assert outcome == SOLVED
        assert (np.abs(f[..., :2]).max(axis=2) <= ODD.friction * f[..., 2] + IDENTITY).all()
        assert (f[..., 2] >= -IDENTITY).all()
        assert (f[..., 2] <= ODD.force_max * horizon.share + 1e-7).all()
        assert not f[horizon.share < ODD.least_share].any()


def test_a_body_at_rest_where_it_shall_be_is_held_by_its_weight() -> None:
    horizon = random_horizon(np.random.default_rng(32), haste=0.0)
    horizon.share[:], horizon.arms[:] = 1.0, BELOW
    outcome, f = solved(MpcConfig(), horizon)
    assert outcome == SOLVED
    np.testing.assert_allclose(f[..., 2], MASS * GRAVITY / 4, atol=1e-6)
    np.testing.assert_allclose(f[..., :2], 0.0, atol=1e-6)


def test_forces_are_planned_before_a_flight_to_be_at_the_goal_after_it() -> None:
    rest = random_horizon(np.random.default_rng(33), haste=0.0)
    rest.share[:], rest.arms[:] = 1.0, BELOW
    rest.share[4:8] = 0.0
    outcome, f = solved(MpcConfig(), rest)
    assert outcome == SOLVED
    assert not f[4:8].any()
    assert f[:4, :, 2].sum(axis=1).mean() > 1.2 * MASS * GRAVITY


def test_a_horizon_without_any_foot_and_one_without_inertia_are_told() -> None:
    horizon = random_horizon(np.random.default_rng(34), haste=1.0)
    horizon.share[:] = 0.0
    outcome, f = solved(MpcConfig(), horizon)
    assert outcome == SOLVED
    assert not f.any()
    horizon.inertia[:] = 0.0
    assert solved(MpcConfig(), horizon)[0] == SINGULAR
