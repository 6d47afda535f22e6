"""The whole-body QP of one tick, assembled, condensed and solved by one kernel.

``tasks`` and ``constraints`` say which rows there are, ``elimination`` how the equalities are
solved: three unknowns a leg are left, u (12,). In most ticks no limit is in the way; then the
minimum without inequalities is the answer. Where it breaks one, all inequalities become rows of u
for the active-set method.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from go2_wbc.algebra.active_set import SINGULAR, SOLVED, VIOLATION, constrain
from go2_wbc.algebra.linear import factorise, solve_factorised
from go2_wbc.compilation import kernel, subroutine
from go2_wbc.records import Array12, Array30, Record
from go2_wbc.reference import STANCE, Target
from go2_wbc.robot.joint_friction import FrictionFeedForward, fill_motor_torques
from go2_wbc.robot.snapshot import Snapshot
from go2_wbc.wbc.constraints import Constraints, Limits, fill_limits
from go2_wbc.wbc.elimination import Reduction, decide, eliminate, expand
from go2_wbc.wbc.inputs import are_valid
from go2_wbc.wbc.tasks import LEG_ROWS, TASK_ROWS, BuiltInTasks, TaskRows, fill_tasks

UNSUITED = 10
"""Outcome, beside those of ``active_set``: a singular leg, which is for the full QP, or numbers
that are not finite."""
MOST_ROWS = 44
"""Five for each of four feet, two for each of twelve joints."""


@dataclass(frozen=True, slots=True)
class QpNumbers:
    """What a whole-body controller is told of its robot."""

    tasks: BuiltInTasks
    constraints: Constraints
    friction: FrictionFeedForward


class Decision(Record):
    """What the QP decides.

    Attributes:
        z: see ``problem``.
        tau: joint torques [N m] without friction.
        tau_motors: those that the motors are told [N m].
    """

    z: Array30
    tau: Array12
    tau_motors: Array12


class Workspace(Record):
    """What a tick computes on the way to its decision; a tick takes nothing from the one before.

    Attributes:
        tasks, limits: rows of the built-in tasks and of the inequalities.
        reduction: what follows from the unknowns u.
        H, g: the cost u'Hu/2 + g'u; only the lower half of H is filled.
        L: H = L L'.
        u: the unknowns.
        C, lower, upper: the inequalities in u.
    """

    tasks: TaskRows
    limits: Limits
    reduction: Reduction
    H: Float[np.ndarray, "12 12"]
    g: Array12
    L: Float[np.ndarray, "12 12"]
    u: Array12
    C: Float[np.ndarray, "44 12"]
    lower: Float[np.ndarray, "44"]
    upper: Float[np.ndarray, "44"]


@subroutine
def add_row(
    row: Float[np.ndarray, "13"],
    first: int,
    end: int,
    b: float,
    weight: float,
    H: Float[np.ndarray, "12 12"],
    g: Array12,
) -> None:
    """Add weight |row (u, 1) - b|^2 / 2 to the cost; columns other than first to end are 0."""
    rest = weight * (row[12] - b)
    for i in range(first, end):
        if row[i] == 0.0:
            continue
        g[i] += rest * row[i]
        scaled = weight * row[i]
        for k in range(first, i + 1):
            H[i, k] += scaled * row[k]


@subroutine
def add_tasks(
    rows: TaskRows, base: Float[np.ndarray, "6 13"], H: Float[np.ndarray, "12 12"], g: Array12
) -> None:
    """Add the cost of the built-in tasks."""
    row = np.empty(13)
    for n in range(TASK_ROWS):
        A = rows.A[n]
        first, end = 0, 12
        if n >= LEG_ROWS:
            first = n - n % 3 - LEG_ROWS
            end = first + 3
        row[:] = 0.0
        moves_base = False
        for k in range(6):
            value = A[k]
            if value != 0.0:
                moves_base = True
                for m in range(13):
                    row[m] += value * base[k, m]
        for m in range(first, end):
            row[m] += A[6 + m]
        if moves_base:
            first, end = 0, 12
        add_row(row, first, end, rows.b[n], rows.weight[n], H, g)


@subroutine
def add_extra_tasks(
    rows: Float[np.ndarray, "k 32"],
    affine: Float[np.ndarray, "30 13"],
    H: Float[np.ndarray, "12 12"],
    g: Array12,
) -> None:
    """Add the cost of a user's own tasks: A, b, weight."""
    row = np.empty(13)
    for n in range(len(rows)):
        row[:] = 0.0
        for i in range(30):
            for k in range(13):
                row[k] += rows[n, i] * affine[i, k]
        add_row(row, 0, 12, rows[n, 30], rows[n, 31], H, g)


@subroutine
def fill_tau(limits: Limits, z: Array30, tau: Array12) -> None:
    """Fill the torques of a decision."""
    for n in range(12):
        first, row = 3 * (n // 3), limits.torques[n]
        value = limits.torques_offset[n]
        for k in range(6):
            value += row[k] * z[k]
        for i in range(3):
            value += row[6 + i] * z[6 + first + i]
            value += row[9 + i] * z[18 + first + i]
        tau[n] = value


@subroutine
def is_within(value: float, lower: float, upper: float) -> bool:
    """Whether a bound is met as ``active_set`` wants it; not if it is no bound (nan, crossed)."""
    return (
        lower <= upper
        and lower - value <= VIOLATION * (1.0 + abs(lower))
        and value - upper <= VIOLATION * (1.0 + abs(upper))
    )


@subroutine
def are_met(target: Target, limits: Limits, decision: Decision) -> bool:
    """Whether a decision and its torques keep every bound; not if a number is not finite."""
    z, tau = decision.z, decision.tau
    for leg in range(4):
        if target.legs[leg] != STANCE:
            continue
        x, y, up = z[18 + 3 * leg], z[19 + 3 * leg], z[20 + 3 * leg]
        for n in range(5):
            C = limits.forces[leg, n]
            value = C[0] * x + C[1] * y + C[2] * up
            if not is_within(value, limits.forces_lower[leg, n], limits.forces_upper[leg, n]):
                return False
    for n in range(12):
        if not is_within(tau[n], limits.torques_lower[n], limits.torques_upper[n]):
            return False
        if not is_within(z[6 + n], limits.joints_lower[n], limits.joints_upper[n]):
            return False
    return True


@subroutine
def bound_unknowns(target: Target, limits: Limits, w: Workspace) -> int:
    """Fill the inequalities in u; returns how many there are."""
    affine, count = w.reduction.affine, 0
    for leg in range(4):
        if target.legs[leg] != STANCE:
            continue
        for n in range(5):
            w.C[count, :] = 0.0
            for i in range(3):
                w.C[count, 3 * leg + i] = limits.forces[leg, n, i]
            w.lower[count] = limits.forces_lower[leg, n]
            w.upper[count] = limits.forces_upper[leg, n]
            count += 1
    row = np.empty(13)
    for n in range(12):
        first, T = 3 * (n // 3), limits.torques[n]
        row[:] = 0.0
        for m in range(12):
            column = m if m < 6 else first + m if m < 9 else first + m + 9
            for k in range(13):
                row[k] += T[m] * affine[column, k]
        offset = limits.torques_offset[n] + row[12]
        w.C[count + n, :] = row[:12]
        w.lower[count + n] = limits.torques_lower[n] - offset
        w.upper[count + n] = limits.torques_upper[n] - offset
        last, offset = count + 12 + n, affine[6 + n, 12]
        w.C[last, :] = affine[6 + n, :12]
        w.lower[last] = limits.joints_lower[n] - offset
        w.upper[last] = limits.joints_upper[n] - offset
    return count + 24


@subroutine
def solve_bounded(target: Target, w: Workspace) -> int:
    """Move u from the minimum without bounds to that within all; returns the outcome."""
    m = bound_unknowns(target, w.limits, w)
    E, e = np.empty((0, 12)), np.empty(0)
    return constrain(w.L, E, e, w.C[:m], w.lower[:m], w.upper[:m], w.u)


@kernel
def solve_tick(
    now: Snapshot,
    target: Target,
    c: QpNumbers,
    extra: Float[np.ndarray, "k 32"],
    w: Workspace,
    decision: Decision,
) -> int:
    """Fill the decision; returns the outcome.

    ``extra`` are rows of a user's own tasks: A, b, weight.
    """
    if not are_valid(now, target) or not eliminate(now, target, c.constraints.still, w.reduction):
        return UNSUITED
    w.H[:] = 0.0
    w.g[:] = 0.0
    fill_tasks(now, target, c.tasks, w.tasks)
    add_tasks(w.tasks, w.reduction.base, w.H, w.g)
    if len(extra) > 0:
        expand(target, w.reduction)
        add_extra_tasks(extra, w.reduction.affine, w.H, w.g)
    if not factorise(w.H, w.L):
        return SINGULAR
    solve_factorised(w.L, w.g, w.u)
    fill_limits(now, target, c.constraints, w.limits)
    decide(target, w.reduction, w.u, decision.z)
    fill_tau(w.limits, decision.z, decision.tau)
    outcome = SOLVED
    if not are_met(target, w.limits, decision):
        expand(target, w.reduction)
        outcome = solve_bounded(target, w)
        decide(target, w.reduction, w.u, decision.z)
        fill_tau(w.limits, decision.z, decision.tau)
    fill_motor_torques(now, c.friction, decision.z, decision.tau, decision.tau_motors)
    return outcome
