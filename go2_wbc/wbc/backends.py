"""Our two ways to solve the assembled ``Problem``: condensed, and in full."""

from __future__ import annotations

import numpy as np
from jaxtyping import Float

from go2_wbc.errors import QpInfeasible
from go2_wbc.records import Array30, packed
from go2_wbc.reference import Target
from go2_wbc.wbc.condensed import Reduction, reduce_equalities
from go2_wbc.wbc.constraints import StanceFeetStill
from go2_wbc.wbc.problem import SIZE, Problem
from go2_wbc.wbc.solvers import DenseQp, solve_dense_qp, unknowns


def solve_full(problem: Problem, solver: str) -> Array30:
    """The optimal decision z, by the QP in accelerations and stance forces, with its equalities.

    Raises:
        QpInfeasible: with the residual table of the best unconstrained point.
    """
    Z, z0 = np.eye(SIZE)[:, unknowns(problem)], np.zeros(SIZE)
    return _embed(problem, dense_qp(problem, Z, z0, with_equalities=True), Z, z0, solver)


def solve_condensed(problem: Problem, solver: str) -> Array30:
    """The same by the QP in three unknowns per leg, equalities eliminated; in full if singular.

    With the solver "active_set" a tick is solved by ``condensed`` without assembling a problem.
    """
    reduction = eliminate_equalities(problem)
    if reduction is None:
        return solve_full(problem, solver)
    return _embed(problem, dense_qp(problem, *reduction), *reduction, solver)


def eliminate_equalities(problem: Problem) -> tuple[Float[np.ndarray, "30 12"], Array30] | None:
    """Z and z0 such that z = Z u + z0 meets every equality (``condensed``); None if singular."""
    reduction, still = Reduction(), packed(problem.source(StanceFeetStill))
    target = Target.of(problem.reference.row)
    if not reduce_equalities(problem.snapshot, target, still, reduction):
        return None
    return reduction.affine[:, :12], reduction.affine[:, 12]


def dense_qp(
    problem: Problem, Z: Float[np.ndarray, "30 n"], z0: Array30, *, with_equalities: bool = False
) -> DenseQp:
    """The QP in u for z = Z u + z0.

    The tasks' cost |W^(1/2) (A z - b)|^2 has the Hessian 2 Z'A'W A Z; the 2 is left out of both
    terms. With equalities, |E u - e|^2 joins the cost: it is zero at every feasible point, so the
    optimum stays, and the Hessian becomes positive definite, which quadprog needs.
    """
    root = np.sqrt(problem.weights)
    A = root[:, None] * (problem.tasks.A @ Z)
    b = root * (problem.tasks.b - problem.tasks.A @ z0)
    C = problem.bounds.C @ Z
    shift = problem.bounds.C @ z0
    H, g = A.T @ A, -A.T @ b
    lower, upper = problem.bounds.lower - shift, problem.bounds.upper - shift
    if not with_equalities:
        return DenseQp(H, g, C, lower, upper)
    E, e = problem.equalities.A @ Z, problem.equalities.b - problem.equalities.A @ z0
    return DenseQp(H + E.T @ E, g - E.T @ e, C, lower, upper, E, e)


def _embed(
    problem: Problem, qp: DenseQp, Z: Float[np.ndarray, "30 n"], z0: Array30, solver: str
) -> Array30:
    try:
        return Z @ solve_dense_qp(qp, solver) + z0
    except QpInfeasible as error:
        # H u = -g: the optimum without bounds, which tells best what asked for too much
        best = Z @ np.linalg.lstsq(qp.H, -qp.g, rcond=None)[0] + z0
        raise QpInfeasible(error.solver, error.status, problem.residuals(best)) from error
