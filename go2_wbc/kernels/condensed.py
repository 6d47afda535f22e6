"""The whole-body QP of one tick, assembled, condensed and solved in one kernel.

``wbc.tasks`` and ``wbc.constraints`` say which rows there are, ``wbc.backends`` how the equalities
are eliminated: three unknowns a leg are left, u (12,). In most ticks no limit is in the way; then
the minimum without inequalities is the answer. Where it breaks one, all inequalities become rows of
u for the active-set method.
"""

from __future__ import annotations

import numpy as np

from go2_wbc.algebra.active_set import SINGULAR, SOLVED, constrain, factorise, solve_factorised
from go2_wbc.kernels.bounds import MOST_ROWS, are_met, bound_forces, bound_joints
from go2_wbc.kernels.compilation import kernel, subroutine
from go2_wbc.kernels.elimination import decide, eliminate, expand
from go2_wbc.kernels.friction import motor_torques
from go2_wbc.kernels.goals import add_body_goals, add_goal, add_leg_goals
from go2_wbc.kernels.inputs import are_valid
from go2_wbc.kernels.layout import DECISION, SNAPSHOT

UNSUITED = 10
"""Outcome, beside those of ``active_set``: a singular leg or a rotation by pi, which are for the
full QP, or numbers that are not finite."""

_M, _H, _J_CONTACTS = (SNAPSHOT.start[n] for n in ("mass_matrix", "bias", "J_contacts"))
_TAU, _MOTORS = DECISION.start["tau"], DECISION.start["tau_motors"]


@subroutine("void(f8[::1], f8[::1], f8[::1])")
def torques(snapshot, z, tau):
    """Joint rows of M a + h - J'f; no joint of another leg is coupled but by the base."""
    for n in range(12):
        first = 3 * (n // 3)
        M = snapshot[_M + 18 * (6 + n) : _M + 18 * (7 + n)]
        value = snapshot[_H + 6 + n]
        for k in range(6):
            value += M[k] * z[k]
        for k in range(first, first + 3):
            value += M[6 + k] * z[6 + k]
            value -= snapshot[_J_CONTACTS + 18 * k + 6 + n] * z[18 + k]
        tau[n] = value


@subroutine("void(f8[:,::1], f8[:,::1], f8[:,::1], f8[::1])")
def add_extra_goals(rows, affine, H, g):
    """Rows (k, 32) of a user's own tasks: A, b, weight."""
    row = np.empty(13)
    for n in range(len(rows)):
        row[:] = 0.0
        for i in range(30):
            for k in range(13):
                row[k] += rows[n, i] * affine[i, k]
        add_goal(H, g, row, rows[n, 30], rows[n, 31])


@subroutine("i8(f8[::1], f8[::1], f8[::1], f8[:,::1], f8[:,::1], f8[::1])")
def solve_bounded(snapshot, target, program, affine, L, u):
    """Move u (12,) from the minimum without bounds to that within all; returns the outcome."""
    C, lower, upper = np.empty((MOST_ROWS, 12)), np.empty(MOST_ROWS), np.empty(MOST_ROWS)
    count = bound_forces(target, program, C, lower, upper)
    bound_joints(snapshot, program, affine, count, C, lower, upper)
    count += 24
    E, e, multipliers = np.empty((0, 12)), np.empty(0), np.empty(count)
    return constrain(L, E, e, C[:count], lower[:count], upper[:count], u, multipliers)


@kernel("i8(f8[::1], f8[::1], f8[::1], f8[::1], f8[:,::1], f8[::1])")
def solve_condensed(snapshot, target, program, friction, extra, decision):
    """Fill the decision (``layout.DECISION``); returns the outcome.

    ``extra`` (k, 32) are rows of a user's own tasks: A, b, weight; ``friction`` are the numbers of
    ``kernels.friction``.
    """
    if not are_valid(snapshot, target):
        return UNSUITED
    z, tau, motors = decision[:_TAU], decision[_TAU:_MOTORS], decision[_MOTORS:]
    legs_map, base, affine = np.empty((12, 7)), np.empty((6, 13)), np.empty((30, 13))
    if not eliminate(snapshot, target, program, legs_map, base):
        return UNSUITED
    H, g, L, u = np.zeros((12, 12)), np.zeros(12), np.empty((12, 12)), np.empty(12)
    if not add_body_goals(snapshot, target, program, base, H, g):
        return UNSUITED
    add_leg_goals(snapshot, target, program, base, H, g)
    if len(extra) > 0:
        expand(target, legs_map, base, affine)
        add_extra_goals(extra, affine, H, g)
    if not factorise(H, L):
        return SINGULAR
    solve_factorised(L, g, u)
    decide(target, legs_map, base, u, z)
    torques(snapshot, z, tau)
    outcome = SOLVED
    if not are_met(snapshot, target, program, z, tau):
        expand(target, legs_map, base, affine)
        outcome = solve_bounded(snapshot, target, program, affine, L, u)
        decide(target, legs_map, base, u, z)
        torques(snapshot, z, tau)
    motor_torques(snapshot, z, tau, friction, motors)
    return outcome
