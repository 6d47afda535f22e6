"""An answer when the constraints contradict each other: the nearest to what they ask.

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

import numpy as np
from jaxtyping import Bool, Float

from go2_wbc.errors import QpInfeasible, ResidualRow
from go2_wbc.records import Array30
from go2_wbc.wbc.problem import SIZE, Problem
from go2_wbc.wbc.solvers import DenseQp, solve_dense_qp

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
    unknown = np.concatenate([np.ones(18, dtype=bool), np.repeat(problem.stance, 3)])
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
    x = solve_dense_qp(DenseQp(H, g, C, lower, upper, hard, e[base]), solver)
    z = np.zeros(SIZE)
    z[unknown] = x[:n]
    return z


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
