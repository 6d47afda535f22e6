"""The whole-body QP of one tick, assembled, condensed and solved by one kernel.

``tasks`` and ``constraints`` say which rows there are. The equalities are solved for all but three
unknowns a leg, u (12,). In most ticks no limit is in the way; then the
minimum without inequalities is the answer. Where it breaks one, all inequalities become rows of u
for the active-set method.

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

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from go2_wbc.algebra.active_set import SINGULAR, SOLVED, VIOLATION, constrain
from go2_wbc.algebra.linear import along, cross, factorise, solve_factorised, solve_linear, triple
from go2_wbc.compilation import kernel, subroutine
from go2_wbc.records import Array12, Array30, Record, layout_of, numbers_of
from go2_wbc.reference import STANCE, Target
from go2_wbc.robot.motor import FrictionFeedForward, fill_motor_torques
from go2_wbc.robot.state import Snapshot
from go2_wbc.wbc.constraints import (
    BaseRows,
    Constraints,
    Limits,
    Multipliers,
    StanceFeetStill,
    fill_base_dynamics,
    fill_limits,
    left_over,
)
from go2_wbc.wbc.contact_prices import is_hasty, price_contacts
from go2_wbc.wbc.tasks import LEG_ROWS, TASK_ROWS, BuiltInTasks, TaskRows, fill_tasks

SINGULAR_DETERMINANT = 2e-4
"""|det J_l| [m^3] below which a leg counts as singular; 1.5e-2 in standing (own measurement).

For a point foot it is thigh * calf * |sin(knee)| * depth of the foot below the hip's axis.
"""
_FORCES_START = layout_of(Target).slice("normal_force_min").start
_FORCES_END = layout_of(Target).slice("normal_force_max").stop
UNSUITED = 10
"""Outcome, beside those of ``active_set``: a singular leg, which is for the full QP, or numbers
that are not finite."""


class Reduction(Record):
    """What follows from the unknowns u."""

    dynamics: BaseRows  #: (1): the base's rows
    legs: Float[np.ndarray, "12 7"]
    """(3): the joints' accelerations of the stance legs, legs (a_b, 1)."""
    base: Float[np.ndarray, "6 13"]  #: (4): that of the base, a_b = base (u, 1)
    affine: Float[np.ndarray, "30 13"]  #: the decision, z = affine (u, 1)


@subroutine
def reduce_leg(now: Snapshot, still: StanceFeetStill, leg: int, r: Reduction) -> bool:
    """(3): fill the rows of a leg; False if it is singular."""
    first, J = 3 * leg, now.J_contacts[leg]
    x, y, z = (
        triple(J[0, 6 + first : 9 + first]),
        triple(J[1, 6 + first : 9 + first]),
        triple(J[2, 6 + first : 9 + first]),
    )
    columns = cross(y, z), cross(z, x), cross(x, y)  # of the inverse, times the determinant
    determinant = x[0] * columns[0][0] + x[1] * columns[0][1] + x[2] * columns[0][2]
    if not abs(determinant) >= SINGULAR_DETERMINANT:  # a nan counts as singular
        return False
    wanted = along(columns, left_over(now, still, leg))
    for k in range(6):
        moved = along(columns, (J[0, k], J[1, k], J[2, k]))
        for i in range(3):
            r.legs[first + i, k] = -moved[i] / determinant
    for i in range(3):
        r.legs[first + i, 6] = -wanted[i] / determinant
    return True


@subroutine
def press(leg: int, r: Reduction, system: Float[np.ndarray, "6 19"]) -> None:
    """What a leg that stands adds to (4)."""
    A, c = r.dynamics.A, 3 * leg
    for i in range(6):
        for k in range(3):
            system[i, 6 + c + k] = -A[i, 18 + c + k]
        for n in range(3):
            share = A[i, 6 + c + n]
            for k in range(6):
                system[i, k] += share * r.legs[c + n, k]
            system[i, 18] -= share * r.legs[c + n, 6]


@subroutine
def eliminate(now: Snapshot, target: Target, still: StanceFeetStill, r: Reduction) -> bool:
    """(3) and (4): fill ``legs`` and ``base``; False if a leg is singular."""
    fill_base_dynamics(now, r.dynamics)
    A, b = r.dynamics.A, r.dynamics.b
    system = np.zeros((6, 19))  # a_b, u, 1
    for i in range(6):
        system[i, 18] = b[i]
        for k in range(6):
            system[i, k] = A[i, k]
    for leg in range(4):
        c = 3 * leg
        if target.legs[leg] != STANCE:
            for i in range(6):
                for k in range(3):
                    system[i, 6 + c + k] = -A[i, 6 + c + k]
        elif reduce_leg(now, still, leg, r):
            press(leg, r, system)
        else:
            return False
    if not solve_linear(system, 6):
        return False
    for i in range(6):
        for k in range(13):
            r.base[i, k] = system[i, 6 + k]
    return True


@subroutine
def expand(target: Target, r: Reduction) -> None:
    """Fill ``affine`` from the other two."""
    r.affine[:] = 0.0
    for i in range(6):
        for k in range(13):
            r.affine[i, k] = r.base[i, k]
    for leg in range(4):
        is_stance = target.legs[leg] == STANCE
        for i in range(3 * leg, 3 * leg + 3):
            if not is_stance:
                r.affine[6 + i, i] = 1.0
                continue
            r.affine[18 + i, i] = 1.0
            r.affine[6 + i, 12] = r.legs[i, 6]
            for n in range(6):
                value = r.legs[i, n]
                for k in range(13):
                    r.affine[6 + i, k] += value * r.base[n, k]


@subroutine
def decide(target: Target, r: Reduction, u: Array12, z: Array30) -> None:
    """Fill the decision z that the unknowns lead to."""
    for i in range(6):
        value = r.base[i, 12]
        for k in range(12):
            value += r.base[i, k] * u[k]
        z[i] = value
    for leg in range(4):
        is_stance = target.legs[leg] == STANCE
        for i in range(3 * leg, 3 * leg + 3):
            if not is_stance:
                z[6 + i], z[18 + i] = u[i], 0.0
                continue
            value = r.legs[i, 6]
            for n in range(6):
                value += r.legs[i, n] * z[n]
            z[6 + i], z[18 + i] = value, u[i]


@kernel
def reduce_equalities(now: Snapshot, target: Target, still: StanceFeetStill, r: Reduction) -> bool:
    """Fill the reduction; False if a leg is singular."""
    if not eliminate(now, target, still, r):
        return False
    expand(target, r)
    return True


@dataclass(frozen=True, slots=True)
class QpNumbers:
    """What a whole-body controller is told of its robot."""

    tasks: BuiltInTasks
    constraints: Constraints
    friction: FrictionFeedForward


class Decision(Record):
    """What the QP decides."""

    z: Array30  #: see ``problem``
    tau: Array12  #: joint torques [N m] without friction
    tau_motors: Array12  #: those that the motors are told [N m]
    multipliers: Multipliers
    """Of the inequalities, all 0 if the tick met them by itself; and of contacts."""


class Workspace(Record):
    """What a tick computes on the way to its decision; a tick takes nothing from the one before."""

    tasks: TaskRows  #: rows of the built-in tasks
    limits: Limits  #: rows of the inequalities
    reduction: Reduction  #: what follows from the unknowns u
    H: Float[np.ndarray, "12 12"]  #: the cost u'Hu/2 + g'u; only the lower half is filled
    g: Array12
    L: Float[np.ndarray, "12 12"]  #: H = L L'; only the lower half is filled
    u: Array12  #: the unknowns
    C: Float[np.ndarray, "44 12"]  #: lower <= C u <= upper are the inequalities
    lower: Float[np.ndarray, "44"]
    upper: Float[np.ndarray, "44"]
    row_multipliers: Float[np.ndarray, "44"]  #: of the inequalities, row by row


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
def solve_bounded(target: Target, w: Workspace, multipliers: Multipliers) -> int:
    """Move u from the minimum without bounds to that within all; returns the outcome."""
    m, y = bound_unknowns(target, w.limits, w), w.row_multipliers
    E, e = np.empty((0, 12)), np.empty(0)
    outcome = constrain(w.L, E, e, w.C[:m], w.lower[:m], w.upper[:m], w.u, y[:m])
    count = 0
    for leg in range(4):
        if target.legs[leg] != STANCE:
            continue
        for n in range(5):
            multipliers.forces[leg, n] = y[count]
            count += 1
    for n in range(12):
        multipliers.torques[n], multipliers.joints[n] = y[count + n], y[count + 12 + n]
    return outcome


@subroutine
def slope_of(
    extra: Float[np.ndarray, "k 32"], w: Workspace, d: Decision
) -> Float[np.ndarray, "18"]:
    """How cost and limits, with their multipliers, rise with the accelerations at a decision."""
    slope, rows, z, y = np.zeros(18), w.tasks, d.z, d.multipliers
    for n in range(TASK_ROWS):
        rest = -rows.b[n]
        for k in range(6):
            rest += rows.A[n, k] * z[k]
        for k in range(12):
            rest += rows.A[n, 6 + k] * w.u[k]
        for k in range(6):
            slope[k] += rows.weight[n] * rest * rows.A[n, k]
    for n in range(len(extra)):
        rest = -extra[n, 30]
        for k in range(30):
            rest += extra[n, k] * z[k]
        for k in range(18):
            slope[k] += extra[n, 31] * rest * extra[n, k]
    for n in range(12):
        first, T = 6 + 3 * (n // 3), w.limits.torques[n]
        for k in range(6):
            slope[k] += y.torques[n] * T[k]
        for k in range(3):
            slope[first + k] += y.torques[n] * T[6 + k]
        slope[6 + n] += y.joints[n]
    return slope


@subroutine
def is_finite(row: Float[np.ndarray, " n"]) -> bool:
    """Whether every number is finite. Without branches it takes a fifth."""
    count = 0
    for i in range(len(row)):
        count += abs(row[i]) < np.inf
    return count == len(row)


@subroutine
def are_valid(now: Snapshot, target: Target) -> bool:
    """What ``check_inputs`` of the controller demands."""
    asked = numbers_of(target)
    for leg in range(4):
        if not (target.normal_force_min[leg] < np.inf and target.normal_force_max[leg] > -np.inf):
            return False
    return (
        is_finite(numbers_of(now))
        and is_finite(asked[:_FORCES_START])
        and is_finite(asked[_FORCES_END:])
    )


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
    numbers_of(decision.multipliers)[:] = 0.0
    outcome = SOLVED
    if not are_met(target, w.limits, decision):
        expand(target, w.reduction)
        outcome = solve_bounded(target, w, decision.multipliers)
        decide(target, w.reduction, w.u, decision.z)
        fill_tau(w.limits, decision.z, decision.tau)
    still, r = c.constraints.still, w.reduction
    for leg in range(4):
        if is_hasty(now, target, still, leg):
            slope, prices = slope_of(extra, w, decision), decision.multipliers.contacts
            price_contacts(now, target, still, slope, r.dynamics.A, r.legs, prices)
            break
    fill_motor_torques(now, c.friction, decision.z, decision.tau, decision.tau_motors)
    return outcome
