"""A dense dual active-set method for small, strictly convex QPs (Goldfarb & Idnani, 1983).

    minimise  x'Hx/2 + g'x   subject to  E x = e,  lower <= C x <= upper

It starts at the optimum without constraints and takes in the most violated row, one after the
other: a step in the primal and dual variables keeps the point optimal for the rows in the working
set (Math. Programming 27, 1983, sec. 3, whose letters are used). With H = L L', the matrix
J = L^-T Q holds the QR factors of the working set's normals N: J' N = (R; 0). Givens rotations
bring J and R up to date when a row comes or goes.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from jaxtyping import Bool, Float, Int

from go2_wbc.algebra.linear import Square, Vector, factorise, solve_factorised
from go2_wbc.compilation import kernel, subroutine

Rows = Float[np.ndarray, "m n"]
Bounds = Float[np.ndarray, " m"]
Taken = Bool[np.ndarray, " m"]

SOLVED, INFEASIBLE, SINGULAR, UNFINISHED, BAD_BOUNDS = range(5)
MESSAGES = (
    "solved",
    "no feasible point found",
    "the Hessian is not positive definite",
    "no solution within the limit of steps",
    "a lower bound lies above its upper bound, or is not a number",
)
"""What each outcome of ``solve_qp`` says."""

VIOLATION = 1e-10  #: Violation, relative to 1 + |bound|, below which a row counts as met
DEPENDENT = 1e-18
"""Squared share of a normal outside the working set's span below which it counts as inside."""
MAX_STEPS = 400  #: Rows taken in or dropped. 44 rows needed 40 at most (own measurement)


class WorkingSet(NamedTuple):
    """The rows that are met with equality; how many they are, q, goes beside it."""

    J: Square  #: J' N = (R; 0), see the module
    R: Square
    rows: Int[np.ndarray, " n"]  #: the number of each row, negative for an equality
    u: Vector  #: their multipliers
    taken: Taken  #: whether each inequality is among them


@subroutine
def invert(L: Square, J: Square) -> None:
    """J = L^-T: column c of L^-1 is row c of J."""
    n = L.shape[0]
    for c in range(n):
        J[c, :c] = 0.0
        J[c, c] = 1.0 / L[c, c]
        for i in range(c + 1, n):
            value = 0.0
            for k in range(c, i):
                value -= L[i, k] * J[c, k]
            J[c, i] = value / L[i, i]


@subroutine
def rotate(J: Square, j: int, c: float, s: float) -> None:
    """Rotate columns j and j + 1 by the angle of this cosine and sine."""
    for k in range(J.shape[0]):
        first, second = J[k, j], J[k, j + 1]
        J[k, j] = c * first + s * second
        J[k, j + 1] = c * second - s * first


@subroutine
def take_in(w: WorkingSet, d: Vector, q: int) -> None:
    """Add the normal n with d = J'n as column q of R: rotate d so that nothing lies below q."""
    J, R = w.J, w.R
    for j in range(len(d) - 1, q, -1):
        a, b = d[j - 1], d[j]
        if b == 0.0:
            continue
        length = np.hypot(a, b)
        d[j - 1], d[j] = length, 0.0
        rotate(J, j - 1, a / length, b / length)
    for i in range(q + 1):
        R[i, q] = d[i]


@subroutine
def drop(w: WorkingSet, place: int, q: int) -> None:
    """Remove column ``place`` of the q columns of R, and make R upper triangular again."""
    J, R, rows, u, taken = w
    taken[rows[place]] = False
    for j in range(place, q - 1):
        rows[j], u[j] = rows[j + 1], u[j + 1]
        for i in range(j + 2):
            R[i, j] = R[i, j + 1]
    for j in range(place, q - 1):
        a, b = R[j, j], R[j + 1, j]
        if b == 0.0:
            continue
        length = np.hypot(a, b)
        c, s = a / length, b / length
        R[j, j], R[j + 1, j] = length, 0.0
        for k in range(j + 1, q - 1):
            first, second = R[j, k], R[j + 1, k]
            R[j, k] = c * first + s * second
            R[j + 1, k] = c * second - s * first
        rotate(J, j, c, s)


@subroutine
def most_violated(
    x: Vector, C: Rows, lower: Bounds, upper: Bounds, taken: Taken
) -> tuple[int, float, float]:
    """The free row that is violated most, or -1; 1 for its lower side, else -1; by how much."""
    found, sign, worst = -1, 1.0, 0.0
    for i in range(len(taken)):
        if taken[i]:
            continue
        value = 0.0
        for j in range(len(x)):
            value += C[i, j] * x[j]
        below, above = lower[i] - value, value - upper[i]
        excess = max(below, above)
        bound = lower[i] if below > above else upper[i]
        if excess > worst and excess > VIOLATION * (1.0 + abs(bound)):
            found, worst = i, excess
            sign = 1.0 if below > above else -1.0
    return found, sign, worst


@subroutine
def directions(
    w: WorkingSet, normal: Vector, q: int, d: Vector, z: Vector, r: Vector
) -> tuple[float, float]:
    """Fill d = J'n, the primal direction z and the dual one r; returns |d outside|^2, |d|^2."""
    J, R, n = w.J, w.R, len(normal)
    outside, whole = 0.0, 0.0
    for j in range(n):
        value = 0.0
        for i in range(n):
            value += J[i, j] * normal[i]
        d[j] = value
        whole += value * value
        if j >= q:
            outside += value * value
    for i in range(n):  # the part of J d outside the working set
        value = 0.0
        for j in range(q, n):
            value += J[i, j] * d[j]
        z[i] = value
    for i in range(q - 1, -1, -1):  # R r = d
        value = d[i]
        for j in range(i + 1, q):
            value -= R[i, j] * r[j]
        r[i] = value / R[i, i]
    return outside, whole


@subroutine
def partial_step(w: WorkingSet, r: Vector, q: int) -> tuple[float, int]:
    """The step at which the first multiplier of a bound reaches zero, and its place; inf and -1."""
    rows, u = w.rows, w.u
    step, leaving = np.inf, -1
    for i in range(q):
        if rows[i] >= 0 and r[i] > 0.0 and u[i] < step * r[i]:
            step, leaving = u[i] / r[i], i
    return step, leaving


@subroutine
def meet(
    w: WorkingSet, q: int, row: int, normal: Vector, violation: float, slack: float, x: Vector
) -> int:
    """Move x until a row is met, dropping others on the way; returns q, the new working set's size.

    ``row`` is the row's number, negative for an equality; ``normal`` points to where it is met. An
    equality that the others imply is left out, if it is met within ``slack``. -1: it cannot be met;
    -2: too many steps.
    """
    n, rows, u = len(x), w.rows, w.u
    d, z, r = np.empty(n), np.empty(n), np.empty(n)
    gained = 0.0  # the row's own multiplier
    for _ in range(MAX_STEPS):
        outside, whole = directions(w, normal, q, d, z, r)
        has_direction = outside > DEPENDENT * whole
        if row < 0 and not has_direction and violation <= slack:
            return q
        partial, leaving = partial_step(w, r, q)
        full = violation / outside if has_direction else np.inf
        step = min(partial, full)
        if not step < np.inf:
            return -1
        for i in range(q):
            u[i] -= step * r[i]
        gained += step
        if has_direction:
            for i in range(n):
                x[i] += step * z[i]
            violation -= step * outside
        if full <= partial:
            take_in(w, d, q)
            rows[q], u[q] = row, gained
            return q + 1
        drop(w, leaving, q)
        q -= 1
    return -2


@subroutine
def tell_multipliers(w: WorkingSet, q: int, y: Vector) -> None:
    """Fill the multiplier of each inequality, of which the sides of those taken are in ``y``."""
    for i in range(len(y)):
        if not w.taken[i]:
            y[i] = 0.0
    for i in range(q):
        if len(y) > 0 and w.rows[i] >= 0:
            y[w.rows[i]] *= w.u[i]


@subroutine
def constrain(
    L: Square,
    E: Float[np.ndarray, "k n"],
    e: Float[np.ndarray, " k"],
    C: Rows,
    lower: Bounds,
    upper: Bounds,
    x: Vector,
    y: Float[np.ndarray, " told"],
) -> int:
    """The same as ``solve_qp``, from the minimum x without constraints, with H = L L'.

    ``y`` may have no element where nobody asks for multipliers.
    """
    n, m = len(x), len(lower)
    for i in range(m):
        if not lower[i] <= upper[i]:
            return BAD_BOUNDS
    J, R, taken = np.empty((n, n)), np.zeros((n, n)), np.zeros(m, dtype=np.bool_)
    w = WorkingSet(J, R, np.empty(n, dtype=np.int64), np.empty(n), taken)
    invert(L, J)
    normal, q = np.empty(n), 0
    for i in range(len(e)):
        value = e[i]
        for j in range(n):
            value -= E[i, j] * x[j]
        sign = 1.0 if value >= 0.0 else -1.0
        for j in range(n):
            normal[j] = sign * E[i, j]
        q = meet(w, q, -1 - i, normal, abs(value), VIOLATION * (1.0 + abs(e[i])), x)
        if q < 0:
            return INFEASIBLE if q == -1 else UNFINISHED
    for _ in range(MAX_STEPS):
        row, sign, violation = most_violated(x, C, lower, upper, taken)
        if row < 0:
            tell_multipliers(w, q, y)
            return SOLVED if np.isfinite(x).all() else UNFINISHED
        for j in range(n):
            normal[j] = sign * C[row, j]
        q = meet(w, q, row, normal, violation, 0.0, x)
        if q < 0:
            return INFEASIBLE if q == -1 else UNFINISHED
        taken[row] = True
        if len(y) > 0:
            y[row] = -sign
    return UNFINISHED


@kernel
def solve_qp(
    H: Square,
    g: Vector,
    E: Float[np.ndarray, "k n"],
    e: Float[np.ndarray, " k"],
    C: Rows,
    lower: Bounds,
    upper: Bounds,
    x: Vector,
    y: Vector,
) -> int:
    """Fill the minimiser x; returns the outcome.

    ``y``, of no or of m elements, gets the multipliers of the inequalities: H x + g + E'nu + C'y is
    zero, y positive where the upper side binds, negative where the lower one does. They are by how
    much the least cost falls for each unit by which that side is wider.
    """
    L = np.empty((len(g), len(g)))
    if not factorise(H, L):
        return SINGULAR
    solve_factorised(L, g, x)
    return constrain(L, E, e, C, lower, upper, x, y)
