"""A dense dual active-set method for small, strictly convex QPs (Goldfarb & Idnani, 1983).

    minimise  x'Hx/2 + g'x   subject to  E x = e,  lower <= C x <= upper

It starts at the optimum without constraints and takes in the most violated row, one after the
other: a step in the primal and dual variables keeps the point optimal for the rows in the working
set (Math. Programming 27, 1983, sec. 3, whose letters are used). With H = L L', the matrix
J = L^-T Q holds the QR factors of the working set's normals N: J' N = (R; 0). Givens rotations
bring J and R up to date when a row comes or goes.
"""

from __future__ import annotations

import numpy as np
from jaxtyping import Float, Int

from go2_wbc.compilation import kernel, subroutine

SOLVED, INFEASIBLE, SINGULAR, UNFINISHED, BAD_BOUNDS = range(5)
MESSAGES = (
    "solved",
    "no feasible point found",
    "the Hessian is not positive definite",
    "no solution within the limit of steps",
    "a lower bound lies above its upper bound, or is not a number",
)
"""What each outcome of ``solve_qp`` says."""

VIOLATION = 1e-10
"""Violation, relative to 1 + |bound|, below which a row counts as met."""
DEPENDENT = 1e-18
"""Squared share of a normal outside the working set's span below which it counts as inside."""
DEFINITE = 1e-14
"""Share of a diagonal entry of H that must be left as its pivot."""
MAX_STEPS = 400
"""Rows taken in or dropped. 44 rows needed 40 at most (own measurement)."""

FREE, AT_LOWER, AT_UPPER = 0, -1, 1


@subroutine
def factorise(H: Float[np.ndarray, "n n"], L: Float[np.ndarray, "n n"]) -> bool:
    """The lower triangle of L in H = L L', from that of H; False if H is not positive definite."""
    for j in range(H.shape[0]):
        pivot = H[j, j]
        for k in range(j):
            pivot -= L[j, k] * L[j, k]
        if not pivot > DEFINITE * H[j, j]:  # a nan fails too
            return False
        root = np.sqrt(pivot)
        inverse = 1.0 / root
        L[j, j] = root
        for i in range(j + 1, H.shape[0]):
            value = H[i, j]
            for k in range(j):
                value -= L[i, k] * L[j, k]
            L[i, j] = value * inverse
    return True


@subroutine
def solve_factorised(
    L: Float[np.ndarray, "n n"], g: Float[np.ndarray, " n"], x: Float[np.ndarray, " n"]
) -> None:
    """x = -(L L')^-1 g."""
    n = len(g)
    for i in range(n):
        value = -g[i]
        for k in range(i):
            value -= L[i, k] * x[k]
        x[i] = value / L[i, i]
    for i in range(n - 1, -1, -1):
        value = x[i]
        for k in range(i + 1, n):
            value -= L[k, i] * x[k]
        x[i] = value / L[i, i]


@subroutine
def invert(L: Float[np.ndarray, "n n"], J: Float[np.ndarray, "n n"]) -> None:
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
def take_in(
    J: Float[np.ndarray, "n n"], R: Float[np.ndarray, "n n"], d: Float[np.ndarray, " n"], q: int
) -> None:
    """Add the normal n with d = J'n as column q of R: rotate d so that nothing lies below q."""
    n = len(d)
    for j in range(n - 1, q, -1):
        a, b = d[j - 1], d[j]
        if b == 0.0:
            continue
        length = np.hypot(a, b)
        c, s = a / length, b / length
        d[j - 1], d[j] = length, 0.0
        for k in range(n):
            first, second = J[k, j - 1], J[k, j]
            J[k, j - 1] = c * first + s * second
            J[k, j] = c * second - s * first
    for i in range(q + 1):
        R[i, q] = d[i]


@subroutine
def drop(J: Float[np.ndarray, "n n"], R: Float[np.ndarray, "n n"], place: int, q: int) -> None:
    """Remove column ``place`` of the q columns of R, and make R upper triangular again."""
    n = J.shape[0]
    for j in range(place, q - 1):
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
        for k in range(n):
            first, second = J[k, j], J[k, j + 1]
            J[k, j] = c * first + s * second
            J[k, j + 1] = c * second - s * first


@subroutine
def most_violated(
    x: Float[np.ndarray, " n"],
    C: Float[np.ndarray, "m n"],
    lower: Float[np.ndarray, " m"],
    upper: Float[np.ndarray, " m"],
    side: Int[np.ndarray, " m"],
) -> tuple[int, float, float]:
    """The free row that is violated most, or -1; 1 for its lower side, else -1; by how much."""
    found, sign, worst = -1, 1.0, 0.0
    for i in range(len(side)):
        if side[i] != FREE:
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
    J: Float[np.ndarray, "n n"],
    R: Float[np.ndarray, "n n"],
    normal: Float[np.ndarray, " n"],
    q: int,
    d: Float[np.ndarray, " n"],
    z: Float[np.ndarray, " n"],
    r: Float[np.ndarray, " n"],
) -> tuple[float, float]:
    """Fill d = J'n, the primal direction z and the dual one r; returns |d outside|^2, |d|^2."""
    n = len(normal)
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
def partial_step(
    u: Float[np.ndarray, " n"], r: Float[np.ndarray, " n"], rows: Int[np.ndarray, " n"], q: int
) -> tuple[float, int]:
    """The step at which the first multiplier of a bound reaches zero, and its place; inf and -1."""
    step, leaving = np.inf, -1
    for i in range(q):
        if rows[i] >= 0 and r[i] > 0.0 and u[i] < step * r[i]:
            step, leaving = u[i] / r[i], i
    return step, leaving


@subroutine
def meet(
    J: Float[np.ndarray, "n n"],
    R: Float[np.ndarray, "n n"],
    normal: Float[np.ndarray, " n"],
    violation: float,
    slack: float,
    row: int,
    rows: Int[np.ndarray, " n"],
    q: int,
    side: Int[np.ndarray, " m"],
    u: Float[np.ndarray, " n"],
    x: Float[np.ndarray, " n"],
) -> int:
    """Move x until a row is met, dropping others on the way; returns q, the new working set's size.

    ``row`` is the row's number, negative for an equality; ``normal`` points to where it is met. An
    equality that the others imply is left out, if it is met within ``slack``. -1: it cannot be met;
    -2: too many steps.
    """
    n = len(x)
    d, z, r = np.empty(n), np.empty(n), np.empty(n)
    gained = 0.0  # the row's own multiplier
    for _ in range(MAX_STEPS):
        outside, whole = directions(J, R, normal, q, d, z, r)
        has_direction = outside > DEPENDENT * whole
        if row < 0 and not has_direction and violation <= slack:
            return q
        partial, leaving = partial_step(u, r, rows, q)
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
            take_in(J, R, d, q)
            rows[q], u[q] = row, gained
            return q + 1
        side[rows[leaving]] = FREE
        drop(J, R, leaving, q)
        for i in range(leaving, q - 1):
            rows[i], u[i] = rows[i + 1], u[i + 1]
        q -= 1
    return -2


@subroutine
def finish(
    rows: Int[np.ndarray, " n"],
    u: Float[np.ndarray, " n"],
    q: int,
    side: Int[np.ndarray, " m"],
    x: Float[np.ndarray, " n"],
    y: Float[np.ndarray, " k+m"],
    k: int,
) -> int:
    """Put the working set's multipliers in their places in y; an equality's sign waits there."""
    signs = y[:k].copy()
    y[:] = 0.0
    for i in range(q):
        if rows[i] < 0:
            y[-1 - rows[i]] = signs[-1 - rows[i]] * u[i]
        else:
            y[k + rows[i]] = side[rows[i]] * u[i]
    return SOLVED if np.isfinite(x).all() else UNFINISHED


@subroutine
def constrain(
    L: Float[np.ndarray, "n n"],
    E: Float[np.ndarray, "k n"],
    e: Float[np.ndarray, " k"],
    C: Float[np.ndarray, "m n"],
    lower: Float[np.ndarray, " m"],
    upper: Float[np.ndarray, " m"],
    x: Float[np.ndarray, " n"],
    y: Float[np.ndarray, " k+m"],
) -> int:
    """The same as ``solve_qp``, from the minimum x without constraints, with H = L L'."""
    n, k, m = len(x), len(e), len(lower)
    y[:] = 0.0
    for i in range(m):
        if not lower[i] <= upper[i]:
            return BAD_BOUNDS
    J, R = np.empty((n, n)), np.zeros((n, n))
    invert(L, J)
    rows, u = np.empty(n, dtype=np.int64), np.empty(n)  # working set: rows and multipliers
    side = np.zeros(m, dtype=np.int64)
    normal = np.empty(n)
    q = 0
    for i in range(k):
        value = e[i]
        for j in range(n):
            value -= E[i, j] * x[j]
        sign = 1.0 if value >= 0.0 else -1.0
        for j in range(n):
            normal[j] = sign * E[i, j]
        y[i] = -sign  # until the end
        slack = VIOLATION * (1.0 + abs(e[i]))
        q = meet(J, R, normal, abs(value), slack, -1 - i, rows, q, side, u, x)
        if q < 0:
            return INFEASIBLE if q == -1 else UNFINISHED
    for _ in range(MAX_STEPS):
        row, sign, violation = most_violated(x, C, lower, upper, side)
        if row < 0:
            return finish(rows, u, q, side, x, y, k)
        for j in range(n):
            normal[j] = sign * C[row, j]
        q = meet(J, R, normal, violation, 0.0, row, rows, q, side, u, x)
        if q < 0:
            return INFEASIBLE if q == -1 else UNFINISHED
        side[row] = AT_LOWER if sign > 0.0 else AT_UPPER
    return UNFINISHED


@kernel
def solve_qp(
    H: Float[np.ndarray, "n n"],
    g: Float[np.ndarray, " n"],
    E: Float[np.ndarray, "k n"],
    e: Float[np.ndarray, " k"],
    C: Float[np.ndarray, "m n"],
    lower: Float[np.ndarray, " m"],
    upper: Float[np.ndarray, " m"],
    x: Float[np.ndarray, " n"],
    y: Float[np.ndarray, " k+m"],
) -> int:
    """Fill the minimiser x (n,) and the multipliers y (k + m,); returns the outcome.

    H x + g + (E' C') y = 0; a row of C has y >= 0 at its upper bound and y <= 0 at its lower one.
    """
    L = np.empty((len(g), len(g)))
    if not factorise(H, L):
        return SINGULAR
    solve_factorised(L, g, x)
    return constrain(L, E, e, C, lower, upper, x, y)
