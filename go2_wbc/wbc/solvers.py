"""Dense QP solvers by name, all started fresh.

active_set: our compiled dual active set (``algebra.active_set``), the default;
daqp: dual active set (Arnström, Bemporad & Axehill, IEEE Trans. Autom. Control 67(8), 2022);
quadprog: dual active set (Goldfarb & Idnani, Math. Programming 27, 1983); proxqp: proximal
augmented Lagrangian (Bambade et al., RSS 2022).

ProxQP is never warm-started: its warm start reports feasible problems as infeasible when the
contacts change. Tolerances are set so that torques agree to 1e-5 N m across solvers.

And an answer when the constraints contradict each other: the nearest to what they ask.

A stance foot that in truth has no contact, or a joint that a blow has driven beyond what braking
can stop, make the hard problem infeasible in the middle of a walk. What physics itself holds stays
hard: the base's dynamics, the torque limits, friction and the greatest normal force. What reality
can contradict gives way, in this order:

1. the least normal force is not asked for;
2. the joint limits get slack, |slack|^2 at weight 1 [1/(rad/s^2)^2];
3. the stance feet's rows become a task at weight 100 [1/(m/s^2)^2].

Such a problem always has a solution, for falling freely without torque is one. It is quadratic in
every violation, so the more a row is violated the more it counts (Nocedal & Wright, *Numerical
Optimization*, 2006, sec. 17.1), and it is solved only when the hard problem has no solution.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from typing import Any

import numpy as np
from jaxtyping import Bool, Float

from go2_wbc.errors import QpInfeasible, ResidualRow, SolverUnavailable, unknown_name
from go2_wbc.records import Array30
from go2_wbc.wbc.problem import SIZE, Problem

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
    own = {"active_set": lambda qp, _: solve_with_multipliers(qp)[0], "proxqp": _by_proxqp}
    solve = own.get(solver, _by_qpsolvers)
    try:
        x = solve(qp, solver)
    except (ValueError, RuntimeError) as error:
        raise QpInfeasible(solver, str(error)) from error
    if x is None or not np.isfinite(x).all():
        raise QpInfeasible(solver, "no feasible point found")
    if not qp.is_met_by(x):
        raise QpInfeasible(solver, "what it returned breaks the constraints")
    return x


def solve_with_multipliers(qp: DenseQp) -> tuple[Float[np.ndarray, " n"], Float[np.ndarray, " m"]]:
    """The minimiser by our active set, and the multiplier of each inequality (``solve_qp``).

    Raises:
        QpInfeasible: if it finds none.
    """
    from go2_wbc.algebra.active_set import MESSAGES, SOLVED, solve_qp

    x, y = np.empty(len(qp.g)), np.empty(len(qp.lower))
    arrays = (qp.H, qp.g, *qp.equalities, qp.C, qp.lower, qp.upper)
    H, g, E, e, C, lower, upper = (np.ascontiguousarray(array, float) for array in arrays)
    outcome = solve_qp(H, g, E, e, C, lower, upper, x, y)
    if outcome != SOLVED:
        raise QpInfeasible("active_set", MESSAGES[outcome])
    return x, y


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


STANCE_WEIGHT = 100.0
"""Weight of the stance feet's rows against the tasks', the greatest of which is 10 by default."""
SLACK_WEIGHT = 1.0  #: Weight of the joint limits' slack

LIMITS = {"stance feet": 30.0, "joint limits": 400.0}
"""Violations [m/s^2, rad/s^2] beyond which a relaxed answer is no answer to what was asked.

Over 8 cm boxes and under pushes that the trot withstood they stayed below 18 and 350, in falls they
reached 83 and 667 (own simulation).
"""


def is_grave(violations: Iterable[ResidualRow]) -> bool:
    """Whether constraints gave way by more than ``LIMITS``."""
    return any(row.norm > LIMITS.get(row.name, np.inf) for row in violations)


def solve_relaxed(problem: Problem, solver: str) -> Array30:
    """The decision z of the relaxed problem.

    Raises:
        QpInfeasible: for a reference that no robot could meet: numbers that are not finite, or a
            least force above the greatest.
    """
    unknown = unknowns(problem)
    z = np.zeros(SIZE)
    z[unknown] = solve_dense_qp(relaxed_qp(problem), solver)[:-12]
    return z


def unknowns(problem: Problem) -> Bool[np.ndarray, "30"]:
    """Which of z are not known to be zero: accelerations, and forces of feet that stand."""
    return np.concatenate([np.ones(18, dtype=bool), np.repeat(problem.stance, 3)])


def relaxed_qp(problem: Problem) -> DenseQp:
    """The relaxed problem, in the unknowns of z and the slack of the 12 joint limits.

    Raises:
        QpInfeasible: for a least force above the greatest.
    """
    unknown = unknowns(problem)
    n = int(unknown.sum())
    root = np.sqrt(problem.weights)
    A, b = root[:, None] * problem.tasks.A[:, unknown], root * problem.tasks.b
    E, e = problem.equalities.A[:, unknown], problem.equalities.b
    base, stance = slice(0, 6), slice(6, None)
    H, g = np.zeros((n + 12, n + 12)), np.zeros(n + 12)
    # |E u - e|^2 of the hard rows is zero at every feasible point and makes H positive definite.
    for rows, right, weight in (
        (A, b, 1.0),
        (E[base], e[base], 1.0),
        (E[stance], e[stance], STANCE_WEIGHT),
    ):
        H[:n, :n] += weight * rows.T @ rows
        g[:n] -= weight * rows.T @ right
    H[n:, n:] = SLACK_WEIGHT * np.eye(12)
    C, lower, upper = _relaxed_bounds(problem, unknown)
    hard = np.concatenate([E[base], np.zeros((6, 12))], axis=1)
    return DenseQp(H, g, C, lower, upper, hard, e[base])


def _relaxed_bounds(
    problem: Problem, unknown: Bool[np.ndarray, "30"]
) -> tuple[Float[np.ndarray, "m n"], Float[np.ndarray, " m"], Float[np.ndarray, " m"]]:
    """Rows of the bounds in (u, slack): forces first, then torques, then joint limits."""
    lower, upper = problem.bounds.lower.copy(), problem.bounds.upper.copy()
    forces, joints = slice(0, len(lower) - 24), slice(len(lower) - 12, None)
    if (lower[forces] > upper[forces]).any():
        raise QpInfeasible("relaxation", "a least normal force lies above the greatest")
    lower[forces] = np.minimum(lower[forces], 0.0)
    middle = (lower[joints] + upper[joints]) / 2
    lower[joints], upper[joints] = (
        np.minimum(lower[joints], middle),
        np.maximum(upper[joints], middle),
    )
    slack = np.zeros((len(lower), 12))
    slack[joints] = np.eye(12)
    return np.concatenate([problem.bounds.C[:, unknown], slack], axis=1), lower, upper
