"""Our two ways to solve the assembled ``Problem``: condensed, and in full.

The equalities are the base's rows of the equations of motion (6), and for each stance leg l that
its contact point rolls (3); see ``constraints``. With the blocks of M, h and J by base b and leg,

    base         M_b a_b + sum_l M_bl a_l - sum_stance J_bl' f_l = -h_b             (1)
    stance leg   J_bl a_b + J_l a_l = c_l                                           (2)

where a_b (6,) is the base's acceleration in the base frame, a_l (3,) that of leg l's joints, f_l
(3,) its contact force in the world frame. J_l is square, so (2) can be solved for a_l and put into
(1): elimination of variables (Nocedal & Wright, *Numerical Optimization*, 2006, sec. 15.3).

    stance leg   a_l = J_l^-1 (c_l - J_bl a_b)                                      (3)
    base         (M_b - sum_stance M_bl J_l^-1 J_bl) a_b
                   = sum_stance J_bl' f_l - sum_swing M_bl a_l - h_b - sum_stance M_bl J_l^-1 c_l
                                                                                    (4)

Three unknowns a leg are left: u (12,) holds f_l of a stance leg and a_l of another. (4) and (3)
make z = Z u + z0, and the QP in u has no equalities, 12 unknowns instead of up to 30, and the same
optimum. A stance leg near a singularity (straight, or with the foot under the hip's axis) has no
J_l^-1; the full QP in (a, f) takes over for that tick.
"""

from __future__ import annotations

from abc import ABC, abstractmethod

import numpy as np
from jaxtyping import Float, Int

from go2_wbc.errors import QpInfeasible
from go2_wbc.wbc.problem import FORCES, SIZE, Problem
from go2_wbc.wbc.solvers import DenseQp, solve_dense_qp

SINGULAR_DETERMINANT = 2e-4
"""|det J_l| [m^3] below which a leg counts as singular; 1.5e-2 in standing (own measurement).

For a point foot it is thigh * calf * |sin(knee)| * depth of the foot below the hip's axis.
"""

_LEG_COLUMNS = np.arange(12).reshape(4, 3)
_UNKNOWN_OF_LEG = np.eye(12, 13).reshape(4, 3, 13)
"""Rows that pick a leg's three unknowns out of (u, 1)."""


class QpBackend(ABC):
    """Solves an assembled problem."""

    def __init__(self, solver: str) -> None:
        """Args: solver: name of a dense QP solver, see ``solvers``."""
        self.solver = solver

    @abstractmethod
    def solve(self, problem: Problem) -> Float[np.ndarray, "30"]:
        """The optimal decision vector z.

        Raises:
            QpInfeasible: with the residual table of the best unconstrained point.
        """


class FullBackend(QpBackend):
    """The QP in accelerations and stance forces, with its equalities."""

    def solve(self, problem: Problem) -> Float[np.ndarray, "30"]:
        """The optimal decision vector z; see ``QpBackend.solve``."""
        unknown = np.concatenate([np.ones(18, dtype=bool), np.repeat(problem.stance, 3)])
        qp = dense_qp(problem, np.eye(SIZE)[:, unknown], np.zeros(SIZE), with_equalities=True)
        return _embed(problem, qp, np.eye(SIZE)[:, unknown], np.zeros(SIZE), self.solver)


class CondensedBackend(QpBackend):
    """The QP in three unknowns per leg, equalities eliminated."""

    def solve(self, problem: Problem) -> Float[np.ndarray, "30"]:
        """The optimal decision vector z; see ``QpBackend.solve``."""
        reduction = eliminate_equalities(problem)
        if reduction is None:
            return FullBackend(self.solver).solve(problem)
        Z, z0 = reduction
        return _embed(problem, dense_qp(problem, Z, z0), Z, z0, self.solver)


def dense_qp(
    problem: Problem,
    Z: Float[np.ndarray, "30 n"],
    z0: Float[np.ndarray, "30"],
    *,
    with_equalities: bool = False,
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


def eliminate_equalities(
    problem: Problem,
) -> tuple[Float[np.ndarray, "30 12"], Float[np.ndarray, "30"]] | None:
    """Z (30, 12) and z0 (30,) such that z = Z u + z0 meets every equality, or None if singular.

    u holds, leg by leg, the contact force of a stance foot or the joint accelerations of the leg.
    Assumes the order of ``formulate``: six base rows, then three rows per stance foot.
    """
    E, e = problem.equalities
    stance, swing = np.flatnonzero(problem.stance), np.flatnonzero(~problem.stance)
    by_leg = E[:6, 6:18].reshape(6, 4, 3)
    by_foot = E[:6, FORCES].reshape(6, 4, 3)
    feet = E[6:].reshape(-1, 3, SIZE)
    J_legs = feet[np.arange(len(stance))[:, None], :, 6 + _LEG_COLUMNS[stance]].transpose(0, 2, 1)
    if len(stance) and np.abs(np.linalg.det(J_legs)).min() < SINGULAR_DETERMINANT:
        return None
    # (3): a_l = legs_map @ (a_b, 1) for every stance leg
    legs_map = np.linalg.inv(J_legs) @ np.concatenate([-feet[:, :, :6], e[6:].reshape(-1, 3, 1)], 2)
    # (4): base_map is its right side, which is linear in (u, 1), divided by its left
    M_legs = by_leg[:, stance].reshape(6, -1)
    folded = M_legs @ legs_map.reshape(-1, 7)
    right = np.empty((6, 13))
    right[:, :12] = -np.where(problem.stance[:, None], by_foot, by_leg).reshape(6, 12)
    right[:, 12] = e[:6] - folded[:, 6]
    base_map = np.linalg.solve(E[:6, :6] + folded[:, :6], right)
    return _back_substitute(base_map, legs_map, stance, swing)


def _back_substitute(
    base_map: Float[np.ndarray, "6 13"],
    legs_map: Float[np.ndarray, "k 3 7"],
    stance: Int[np.ndarray, " k"],
    swing: Int[np.ndarray, " s"],
) -> tuple[Float[np.ndarray, "30 12"], Float[np.ndarray, "30"]]:
    """Z and z0 from the base's acceleration in (u, 1), by (3) and u's own entries."""
    affine = np.zeros((SIZE, 13))
    affine[:6] = base_map
    joints = affine[6:18].reshape(4, 3, 13)
    joints[stance] = legs_map[:, :, :6] @ base_map
    joints[stance, :, 12] += legs_map[:, :, 6]
    joints[swing] = _UNKNOWN_OF_LEG[swing]
    affine[FORCES].reshape(4, 3, 13)[stance] = _UNKNOWN_OF_LEG[stance]
    return affine[:, :12], affine[:, 12]


def _embed(
    problem: Problem,
    qp: DenseQp,
    Z: Float[np.ndarray, "30 n"],
    z0: Float[np.ndarray, "30"],
    solver: str,
) -> Float[np.ndarray, "30"]:
    try:
        return Z @ solve_dense_qp(qp, solver).x + z0
    except QpInfeasible as error:
        # H u = -g: the optimum without bounds, which tells best what asked for too much
        best = Z @ np.linalg.lstsq(qp.H, -qp.g, rcond=None)[0] + z0
        raise QpInfeasible(error.solver, error.status, problem.residuals(best)) from error
