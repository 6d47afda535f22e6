"""Dense QP solvers by name, all started fresh.

active_set: our compiled dual active set (``algebra.active_set``), the default;
daqp: dual active set (Arnström, Bemporad & Axehill, IEEE Trans. Autom. Control 67(8), 2022);
quadprog: dual active set (Goldfarb & Idnani, Math. Programming 27, 1983); proxqp: proximal
augmented Lagrangian (Bambade et al., RSS 2022).

ProxQP is never warm-started: its warm start reports feasible problems as infeasible when the
contacts change. Tolerances are set so that torques agree to 1e-5 N m across solvers.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from jaxtyping import Float

from go2_wbc.errors import QpInfeasible, SolverUnavailable, unknown_name

TOLERANCE = 1e-4
"""By how much a solution may break a bound, relative to 1 + |bound|: a tenth of a newton, where the
solvers leave 1e-6 at most; daqp has returned 1e300 as solved."""


@dataclass(frozen=True, slots=True)
class DenseQp:
    """Minimise x'Hx/2 + g'x subject to E x = e and lower <= C x <= upper."""

    H: Float[np.ndarray, "n n"]
    g: Float[np.ndarray, " n"]
    C: Float[np.ndarray, "m n"]
    lower: Float[np.ndarray, " m"]
    upper: Float[np.ndarray, " m"]
    E: Float[np.ndarray, "k n"] | None = None
    e: Float[np.ndarray, " k"] | None = None

    @property
    def equalities(self) -> tuple[Float[np.ndarray, "k n"], Float[np.ndarray, " k"]]:
        """E and e, of no rows if there are none."""
        if self.E is None or self.e is None:
            return np.empty((0, len(self.g))), np.empty(0)
        return self.E, self.e

    @property
    def is_valid(self) -> bool:
        """Whether every number is finite, open sides aside."""
        are_bounds = (self.lower < np.inf).all() and (self.upper > -np.inf).all()
        parts = (self.H, self.g, self.C, *self.equalities)
        return bool(are_bounds) and all(np.isfinite(part).all() for part in parts)

    def is_met_by(self, x: Float[np.ndarray, " n"]) -> bool:
        """Whether ``x`` meets the constraints, with ``TOLERANCE`` relative to each bound."""
        value, (E, e) = self.C @ x, self.equalities
        is_inside = (value >= self.lower - TOLERANCE * (1 + np.abs(self.lower))) & (
            value <= self.upper + TOLERANCE * (1 + np.abs(self.upper))
        )
        is_equal = np.abs(E @ x - e) <= TOLERANCE * (1 + np.abs(e))
        return bool(is_inside.all() and is_equal.all())

    def one_sided(self) -> tuple[Float[np.ndarray, "r n"], Float[np.ndarray, " r"]]:
        """The inequality rows as G x <= h, infinite sides left out."""
        up, low = np.isfinite(self.upper), np.isfinite(self.lower)
        G = np.concatenate([self.C[up], -self.C[low]])
        h = np.concatenate([self.upper[up], -self.lower[low]])
        return G, h


QPSOLVERS_OPTIONS: dict[str, dict[str, Any]] = {
    "daqp": {"primal_tol": 1e-9, "dual_tol": 1e-12},
    "quadprog": {},
}
"""Solvers reached through qpsolvers, with the tolerances that make their torques agree."""

SOLVERS: tuple[str, ...] = ("active_set", "daqp", "proxqp", "quadprog")  #: Valid solver names

PROXQP_EPS = 1e-9
"""Greatest residual of the optimality conditions, absolute, in the units of the rows."""
PROXQP_EPS_INFEASIBLE = 1e-12  #: Residual of a certificate of infeasibility; the default is 1e-4
PROXQP_INFINITY = 1e20  #: What ProxQP takes for an open side
PROXQP_MAX_ITERATIONS = 50
"""Outer, and inner per outer. 3 000 solvable problems needed at most 12 outer and 38 inner in all,
solved again and again, except twice, not repeatable: 322 inner, and no solution after 1903.
Infeasible ones are given up after 0.12 s at most; with 1000 and 1500, after 11 s (own measurement).
"""


def check_solver(name: str) -> str:
    """``name`` if it is a valid, installed solver.

    Raises:
        SolverUnavailable: otherwise; lists the names that would work.
    """
    if name == "active_set":
        return name
    import qpsolvers  # scipy with it: only for who uses it

    installed = [s for s in SOLVERS if s == "active_set" or s in qpsolvers.available_solvers]
    if name not in SOLVERS:
        raise SolverUnavailable(unknown_name("QP solver", name, installed))
    if name not in installed:
        raise SolverUnavailable(
            f"QP solver {name!r} is not installed: pip install "
            f"{'proxsuite' if name == 'proxqp' else name}; installed: {', '.join(installed)}"
        )
    return name


def solve_dense_qp(qp: DenseQp, solver: str) -> Float[np.ndarray, " n"]:
    """The minimiser of ``qp``, by the solver of that name.

    Raises:
        QpInfeasible: if the problem holds a nan or an infinite number that is no open side, the
            solver finds no solution, or it returns one that is not finite or breaks the bounds.
    """
    if not qp.is_valid:
        # ProxQP ponders over a nan for seconds, and a nan bound would count as an open side.
        raise QpInfeasible(solver, "the problem holds a nan or an infinite number")
    solve = {"active_set": _by_active_set, "proxqp": _by_proxqp}.get(solver, _by_qpsolvers)
    try:
        x = solve(qp, solver)
    except (ValueError, RuntimeError) as error:
        raise QpInfeasible(solver, str(error)) from error
    if x is None or not np.isfinite(x).all():
        raise QpInfeasible(solver, "no feasible point found")
    if not qp.is_met_by(x):
        raise QpInfeasible(solver, "what it returned breaks the constraints")
    return x


def _by_active_set(qp: DenseQp, solver: str) -> Float[np.ndarray, " n"]:
    from go2_wbc.algebra.active_set import MESSAGES, SOLVED, solve_qp

    x = np.empty(len(qp.g))
    arrays = (qp.H, qp.g, *qp.equalities, qp.C, qp.lower, qp.upper)
    H, g, E, e, C, lower, upper = (np.ascontiguousarray(array, float) for array in arrays)
    outcome = solve_qp(H, g, E, e, C, lower, upper, x)
    if outcome != SOLVED:
        raise QpInfeasible(solver, MESSAGES[outcome])
    return x


def _by_qpsolvers(qp: DenseQp, solver: str) -> Float[np.ndarray, " n"] | None:
    import qpsolvers

    G, h = qp.one_sided()
    try:
        problem = qpsolvers.Problem(qp.H, qp.g, G, h, qp.E, qp.e)
        solution = qpsolvers.solve_problem(problem, solver, **QPSOLVERS_OPTIONS[solver])
    except qpsolvers.exceptions.QPError as error:
        raise QpInfeasible(solver, str(error)) from error
    return solution.x if solution.found else None


def _by_proxqp(qp: DenseQp, _solver: str) -> Float[np.ndarray, " n"] | None:
    import proxsuite

    solver = proxsuite.proxqp.dense.QP(len(qp.g), len(qp.equalities[1]), len(qp.lower))
    settings = solver.settings
    settings.eps_abs, settings.eps_rel = PROXQP_EPS, 0.0
    settings.eps_primal_inf = settings.eps_dual_inf = PROXQP_EPS_INFEASIBLE
    settings.max_iter = settings.max_iter_in = PROXQP_MAX_ITERATIONS
    settings.initial_guess = proxsuite.proxqp.InitialGuess.EQUALITY_CONSTRAINED_INITIAL_GUESS
    lower = np.maximum(qp.lower, -PROXQP_INFINITY)
    upper = np.minimum(qp.upper, PROXQP_INFINITY)
    solver.init(qp.H, qp.g, qp.E, qp.e, qp.C, lower, upper, compute_preconditioner=False)
    solver.solve()
    is_solved = solver.results.info.status == proxsuite.proxqp.QPSolverOutput.PROXQP_SOLVED
    return np.array(solver.results.x) if is_solved else None
