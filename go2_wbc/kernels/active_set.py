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

from go2_wbc.kernels.compilation import kernel

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


@kernel("b1(f8[:,::1], f8[:,::1])")
def factorise(H, J):  # noqa: ANN001, ANN201
    """J = L^-T of H = L L'; False if H is not positive definite."""
    n = H.shape[0]
    L = np.empty((n, n))
    for j in range(n):
        pivot = H[j, j]
        for k in range(j):
            pivot -= L[j, k] * L[j, k]
        if not pivot > DEFINITE * H[j, j]:  # a nan fails too
            return False
        root = np.sqrt(pivot)
        L[j, j] = root
        for i in range(j + 1, n):
            value = H[i, j]
            for k in range(j):
                value -= L[i, k] * L[j, k]
            L[i, j] = value / root
    for c in range(n):  # column c of L^-1 is row c of J
        J[c, :c] = 0.0
        J[c, c] = 1.0 / L[c, c]
        for i in range(c + 1, n):
            value = 0.0
            for k in range(c, i):
                value -= L[i, k] * J[c, k]
            J[c, i] = value / L[i, i]
    return True


@kernel("void(f8[:,::1], f8[:,::1], f8[::1], i8)")
def take_in(J, R, d, q):  # noqa: ANN001, ANN201
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


@kernel("void(f8[:,::1], f8[:,::1], i8, i8)")
def drop(J, R, place, q):  # noqa: ANN001, ANN201
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


@kernel("i8(f8[:,::1], f8[::1], f8[:,::1], f8[::1], f8[:,::1], f8[::1], f8[::1], f8[::1], f8[::1])")
def solve_qp(H, g, E, e, C, lower, upper, x, y):  # noqa: ANN001, ANN201, C901
    """Fill the minimiser x (n,) and the multipliers y (k + m,); returns the outcome.

    H x + g + (E' C') y = 0; a row of C has y >= 0 at its upper bound and y <= 0 at its lower one.
    """
    n, k, m = len(g), len(e), len(lower)
    y[:] = 0.0
    for i in range(m):
        if not lower[i] <= upper[i]:
            return BAD_BOUNDS
    J, R = np.empty((n, n)), np.zeros((n, n))
    if not factorise(H, J):
        return SINGULAR
    for i in range(n):  # x = -H^-1 g = -J J' g
        x[i] = 0.0
    for j in range(n):
        value = 0.0
        for i in range(j + 1):  # J is upper triangular here
            value += J[i, j] * g[i]
        for i in range(j + 1):
            x[i] -= J[i, j] * value
    side = np.zeros(m, dtype=np.int8)
    rows = np.empty(n + 1, dtype=np.int64)  # of the working set; equalities first, as -1 - row
    u = np.zeros(n + 1)
    r, d, z, normal = np.empty(n), np.empty(n), np.empty(n), np.empty(n)
    q, taken = 0, 0
    steps = 0
    while True:
        sign = 1.0
        if taken < k:
            row = -1 - taken
            taken += 1
            value = e[-1 - row]
            for i in range(n):
                value -= E[-1 - row, i] * x[i]
            sign = 1.0 if value >= 0.0 else -1.0
            violation = abs(value)
            for i in range(n):
                normal[i] = sign * E[-1 - row, i]
        else:
            row, violation, worst = -1, 0.0, 0.0
            for i in range(m):
                if side[i] != FREE:
                    continue
                value = 0.0
                for j in range(n):
                    value += C[i, j] * x[j]
                below, above = lower[i] - value, value - upper[i]
                excess = max(below, above)
                bound = abs(lower[i]) if below > above else abs(upper[i])
                if excess > VIOLATION * (1.0 + bound) and excess > worst:
                    row, worst, violation = i, excess, excess
                    sign = 1.0 if below > above else -1.0
            if row < 0:
                break
            for i in range(n):
                normal[i] = sign * C[row, i]
        gained = 0.0  # multiplier of the new row
        while True:
            steps += 1
            if steps > MAX_STEPS:
                return UNFINISHED
            outside, whole = 0.0, 0.0
            for j in range(n):  # d = J'n
                value = 0.0
                for i in range(n):
                    value += J[i, j] * normal[i]
                d[j] = value
                whole += value * value
                if j >= q:
                    outside += value * value
            for i in range(n):  # primal direction: the part of J d outside the working set
                value = 0.0
                for j in range(q, n):
                    value += J[i, j] * d[j]
                z[i] = value
            for i in range(q - 1, -1, -1):  # dual direction: R r = d
                value = d[i]
                for j in range(i + 1, q):
                    value -= R[i, j] * r[j]
                r[i] = value / R[i, i]
            partial, leaving = np.inf, -1
            for i in range(q):
                if rows[i] >= 0 and r[i] > 0.0 and u[i] < partial * r[i]:
                    partial, leaving = u[i] / r[i], i
            has_direction = outside > DEPENDENT * whole
            if row < 0 and not has_direction and violation <= VIOLATION * (1.0 + abs(e[-1 - row])):
                break  # an equality that says what others have said
            full = violation / outside if has_direction else np.inf
            step = min(partial, full)
            if not step < np.inf:
                return INFEASIBLE
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
                if row < 0:
                    y[-1 - row] = -sign  # signs of the equalities, until the end
                else:
                    side[row] = AT_LOWER if sign > 0.0 else AT_UPPER
                q += 1
                break
            side[rows[leaving]] = FREE
            drop(J, R, leaving, q)
            for i in range(leaving, q - 1):
                rows[i], u[i] = rows[i + 1], u[i + 1]
            q -= 1
    for i in range(q):
        if rows[i] < 0:
            y[-1 - rows[i]] *= u[i]
        else:
            y[k + rows[i]] = side[rows[i]] * u[i]
    for i in range(n):
        if not np.isfinite(x[i]):
            return UNFINISHED
    return SOLVED
