"""The active-set method, on QPs so small that the conditions of optimality say it all."""

import numpy as np
import pytest
from scipy.optimize import nnls

from go2_wbc.algebra.active_set import BAD_BOUNDS, INFEASIBLE, SINGULAR, SOLVED, solve_qp

N, M = 4, 9
EXACT = 1e-9  # of numbers of order one
NONE = np.empty((0, N)), np.empty(0)
NO_Y = np.empty(0)
Qp = tuple[np.ndarray, ...]


def random_qp(seed: int, equalities: int) -> Qp:
    """H, g, E, e, C, lower, upper: feasible, with bounds in the way and some open sides."""
    rng = np.random.default_rng(seed)
    root, inside = rng.normal(size=(N + 2, N)), rng.normal(size=N)
    C, E = rng.normal(size=(M, N)), rng.normal(size=(equalities, N))
    lower, upper = C @ inside - rng.uniform(0.0, 1.0, M), C @ inside + rng.uniform(0.0, 1.0, M)
    lower[:3], upper[3:5] = -np.inf, np.inf
    return root.T @ root, 5.0 * rng.normal(size=N), E, E @ inside, C, lower, upper


def solved(*qp: np.ndarray) -> np.ndarray:
    x = np.empty(N)
    H, g, E, e, C, lower, upper = qp
    assert solve_qp(H, g, E, e, C, lower, upper, x, NO_Y) == SOLVED
    return x


@pytest.mark.parametrize("equalities", [0, 1, 2])
def test_the_answer_meets_the_conditions_of_optimality(equalities: int) -> None:
    active = 0
    for seed in range(40):
        H, g, E, e, C, lower, upper = qp = random_qp(seed, equalities)
        x = solved(*qp)
        value = C @ x
        assert ((lower - value < EXACT) & (value - upper < EXACT)).all()
        np.testing.assert_allclose(E @ x, e, atol=EXACT)
        # H x + g = C' (u_lower - u_upper) + E' w with u >= 0, and only of bounds that are met
        normals = np.concatenate([C[value - lower < EXACT], -C[upper - value < EXACT], E, -E])
        _, left = nnls(normals.T, H @ x + g)
        assert left < EXACT
        active += len(normals) - 2 * equalities
    assert active > 40


@pytest.mark.parametrize("equalities", [0, 1, 2])
def test_its_multipliers_balance_the_gradient(equalities: int) -> None:
    binding = 0
    for seed in range(40):
        H, g, E, e, C, lower, upper = random_qp(seed, equalities)
        x, y = np.empty(N), np.full(M, np.nan)
        assert solve_qp(H, g, E, e, C, lower, upper, x, y) == SOLVED
        value = C @ x
        assert ((y <= 0.0) | (upper - value < EXACT)).all()
        assert ((y >= 0.0) | (value - lower < EXACT)).all()
        gradient = H @ x + g + C.T @ y
        w = np.linalg.lstsq(-E.T, gradient, rcond=None)[0]
        np.testing.assert_allclose(gradient + E.T @ w, 0.0, atol=EXACT)
        binding += np.count_nonzero(y)
    assert binding > 40


@pytest.mark.parametrize("scale", [1e-5, 1e5])
def test_in_what_unit_a_row_is_written_changes_nothing(scale: float) -> None:
    for seed in range(10):
        H, g, E, e, C, lower, upper = random_qp(seed, 1)
        scaled = H, g, scale * E, scale * e, scale * C, scale * lower, scale * upper
        wanted = solved(H, g, E, e, C, lower, upper)
        np.testing.assert_allclose(solved(*scaled), wanted, atol=1e-4)  # 1e-10 of a row counts


def test_an_equality_that_others_imply_is_left_out_and_one_that_contradicts_them_is_not() -> None:
    H, g, E, e, C, lower, upper = random_qp(3, 2)
    twice, told = np.concatenate([E, E.sum(axis=0, keepdims=True)]), [*e, e.sum()]
    wanted = solved(H, g, E, e, C, lower, upper)
    found = solved(H, g, twice, np.array(told), C, lower, upper)
    np.testing.assert_allclose(found, wanted, atol=EXACT)
    told[-1] += 1e-6
    x = np.empty(N)
    assert solve_qp(H, g, twice, np.array(told), C, lower, upper, x, NO_Y) == INFEASIBLE


def test_what_has_no_answer_is_told() -> None:
    one, x = np.eye(1, N), np.empty(N)
    H, g, least, most = np.eye(N), np.zeros(N), np.array([1.0]), np.array([2.0])
    assert solve_qp(H, g, *NONE, one, most, least, x, NO_Y) == BAD_BOUNDS
    assert solve_qp(H, g, *NONE, one, np.array([np.nan]), most, x, NO_Y) == BAD_BOUNDS
    assert solve_qp(np.diag([1.0, 1.0, 1.0, 0.0]), g, *NONE, one, least, most, x, NO_Y) == SINGULAR
    both, apart = np.concatenate([one, one]), np.array([1.0, 3.0])
    assert solve_qp(H, g, *NONE, both, apart, apart + 0.5, x, NO_Y) == INFEASIBLE
    np.testing.assert_allclose(solved(H, g, *NONE, one, least, most), [1.0, 0.0, 0.0, 0.0])
    np.testing.assert_allclose(solved(H, g, *NONE, one, -most, -least), [-1.0, 0.0, 0.0, 0.0])
