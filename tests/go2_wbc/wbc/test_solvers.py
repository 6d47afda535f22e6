"""Dense QP solvers: each meets the optimality conditions on its own, and they agree."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
import qpsolvers
from scipy.optimize import nnls

from go2_wbc.errors import QpInfeasible, SolverUnavailable
from go2_wbc.wbc import solvers
from go2_wbc.wbc.solvers import SOLVERS, DenseQp, check_solver, solve_dense_qp

FEASIBLE = 1e-8  # of rows of order one; ProxQP's tolerance is 1e-9, the others reach 1e-13
STATIONARY = 1e-10  # gradient over the largest multiplier; measured 1e-14
AGREEMENT = 1e-7  # of minimisers of order one; measured 2e-9
SEEDS = range(20)


def random_qp(seed: int, equalities: int) -> DenseQp:
    """A feasible, strictly convex QP with active bounds, and some rows with one open side."""
    rng = np.random.default_rng(seed)
    n, m = 12, 24
    root = rng.normal(size=(n + 4, n))
    C, inside = rng.normal(size=(m, n)), rng.normal(size=n)
    lower, upper = C @ inside - rng.uniform(0.05, 1.0, m), C @ inside + rng.uniform(0.05, 1.0, m)
    lower[:6], upper[6:10] = -np.inf, np.inf
    E = rng.normal(size=(equalities, n))
    qp = DenseQp(root.T @ root, 5.0 * rng.normal(size=n), C, lower, upper)
    return replace(qp, E=E, e=E @ inside) if equalities else qp


def check_optimality(qp: DenseQp, x: np.ndarray) -> int:
    """Assert the conditions of Karush, Kuhn and Tucker; returns how many bounds are active."""
    G, h = qp.one_sided()
    E, e = qp.equalities
    np.testing.assert_allclose(E @ x, e, atol=FEASIBLE)
    slack = h - G @ x
    assert (slack >= -FEASIBLE).all()
    active = G[slack < FEASIBLE]
    gradient = -(qp.H @ x + qp.g)
    multipliers, left = nnls(np.concatenate([active, E, -E]).T, gradient)
    assert left < STATIONARY * max(1.0, multipliers.max())
    return int((multipliers[: len(active)] > 1e-3).sum())


@pytest.mark.parametrize("equalities", [0, 5])
def test_every_solver_finds_the_same_minimum_and_meets_the_optimality_conditions(
    equalities: int,
) -> None:
    active = 0
    for seed in SEEDS:
        qp = random_qp(seed, equalities)
        found = {solver: solve_dense_qp(qp, solver) for solver in SOLVERS}
        for x in found.values():
            active += check_optimality(qp, x)
            np.testing.assert_allclose(x, found["active_set"], atol=AGREEMENT)
    assert active > len(SEEDS) * len(SOLVERS)


def test_the_optimality_check_notices_a_wrong_answer() -> None:
    qp = random_qp(0, 0)
    right, feasible = (solve_dense_qp(replace(qp, g=g), "daqp") for g in (qp.g, -qp.g))
    for wrong in (right + 1e-3, feasible, np.linalg.solve(qp.H, -qp.g)):
        with pytest.raises(AssertionError):
            check_optimality(qp, wrong)


@pytest.mark.parametrize("solver", SOLVERS)
def test_a_solver_keeps_no_memory_of_the_last_problem(solver: str) -> None:
    first, second = random_qp(1, 0), random_qp(2, 0)
    alone = solve_dense_qp(first, solver)
    solve_dense_qp(second, solver)
    np.testing.assert_array_equal(solve_dense_qp(first, solver), alone)


def contradiction() -> DenseQp:
    C = np.array([[1.0, 0.0], [1.0, 0.0]])
    return DenseQp(np.eye(2), np.zeros(2), C, np.array([1.0, -np.inf]), np.array([np.inf, -1.0]))


@pytest.mark.parametrize("solver", SOLVERS)
def test_contradicting_bounds_are_infeasible_and_name_the_solver(solver: str) -> None:
    with pytest.raises(QpInfeasible, match=f"{solver} found no solution") as caught:
        solve_dense_qp(contradiction(), solver)
    assert caught.value.solver == solver
    assert caught.value.status


@pytest.mark.parametrize("solver", SOLVERS)
@pytest.mark.parametrize("part", ["H", "g", "C", "lower", "upper"])
def test_a_nan_is_refused_at_once(solver: str, part: str) -> None:
    """ProxQP took seconds to give up, and a nan bound was taken for an open side."""
    qp = random_qp(3, 0)
    values = getattr(qp, part).copy()
    values.ravel()[11] = np.nan
    with pytest.raises(QpInfeasible, match="holds a nan"):
        solve_dense_qp(replace(qp, **{part: values}), solver)


def test_an_answer_that_is_not_finite_or_breaks_the_bounds_counts_as_none(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    nan = SimpleNamespace(found=True, x=np.full(12, np.nan), z=np.zeros(38), y=None)
    monkeypatch.setattr(qpsolvers, "solve_problem", lambda *_, **__: nan)
    with pytest.raises(QpInfeasible, match="no feasible point"):
        solve_dense_qp(random_qp(1, 0), "daqp")
    # Told of an impossible goal, daqp has returned 1e300 as solved.
    huge = SimpleNamespace(found=True, x=np.full(12, 1e300), z=np.zeros(38), y=None)
    monkeypatch.setattr(qpsolvers, "solve_problem", lambda *_, **__: huge)
    with pytest.raises(QpInfeasible, match="breaks the constraints"):
        solve_dense_qp(random_qp(1, 0), "daqp")


@pytest.mark.parametrize("solver", SOLVERS)
def test_every_valid_solver_is_installed(solver: str) -> None:
    assert check_solver(solver) == solver


def test_a_solver_that_is_unknown_or_not_tuned_is_answered_with_the_valid_names(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    with pytest.raises(
        SolverUnavailable, match=r"QP solver 'gurobi'; valid: active_set, daqp, proxqp, quad"
    ):
        check_solver("gurobi")
    monkeypatch.setattr(qpsolvers, "available_solvers", [*solvers.SOLVERS, "osqp"])
    with pytest.raises(SolverUnavailable, match="unknown QP solver 'osqp'"):
        check_solver("osqp")


@pytest.mark.parametrize(
    ("solver", "package"), [("daqp", "daqp"), ("proxqp", "proxsuite"), ("quadprog", "quadprog")]
)
def test_an_uninstalled_solver_is_answered_with_the_install_line(
    monkeypatch: pytest.MonkeyPatch, solver: str, package: str
) -> None:
    others = [name for name in SOLVERS if name != solver]
    monkeypatch.setattr(qpsolvers, "available_solvers", others)
    expected = f"'{solver}' is not installed: pip install {package}; installed: {', '.join(others)}"
    with pytest.raises(SolverUnavailable, match=expected):
        check_solver(solver)
