"""Linear algebra of small sizes, for compiled code: vectors, frames, systems of equations.

Vectors are triples of numbers, which compiled code keeps in registers. Systems are solved by
Gauss-Jordan elimination, or by H = L L' (Cholesky).
"""

from __future__ import annotations

import numpy as np
from jaxtyping import Float

from go2_wbc.compilation import subroutine
from go2_wbc.records import V3, Array3, Array3x3, Array4

Axes = tuple[V3, V3, V3]  #: The three axes of a frame


@subroutine
def triple(a: Array3) -> V3:
    """The numbers of an array."""
    return a[0], a[1], a[2]


@subroutine
def put(a: V3, into: Array3) -> None:
    """Put a vector into an array."""
    into[0], into[1], into[2] = a


@subroutine
def plus(a: V3, b: V3) -> V3:
    """a + b."""
    return a[0] + b[0], a[1] + b[1], a[2] + b[2]


@subroutine
def plus_scaled(a: V3, factor: float, b: V3) -> V3:
    """a + factor b."""
    return a[0] + factor * b[0], a[1] + factor * b[1], a[2] + factor * b[2]


@subroutine
def cross(a: V3, b: V3) -> V3:
    """a x b."""
    return a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]


@subroutine
def dot(a: V3, b: V3) -> float:
    """a . b."""
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


@subroutine
def about_x(c: float, s: float, a: V3) -> V3:
    """A vector turned about x by the angle of this cosine and sine."""
    return a[0], c * a[1] - s * a[2], s * a[1] + c * a[2]


@subroutine
def about_y(c: float, s: float, a: V3) -> V3:
    """A vector turned about y."""
    return c * a[0] + s * a[2], a[1], c * a[2] - s * a[0]


@subroutine
def along(axes: Axes, a: V3) -> V3:
    """A vector given along these axes."""
    x, y, z = axes
    return (
        x[0] * a[0] + y[0] * a[1] + z[0] * a[2],
        x[1] * a[0] + y[1] * a[1] + z[1] * a[2],
        x[2] * a[0] + y[2] * a[1] + z[2] * a[2],
    )


@subroutine
def turned(R: Array3x3, a: V3) -> V3:
    """R a."""
    return (
        R[0, 0] * a[0] + R[0, 1] * a[1] + R[0, 2] * a[2],
        R[1, 0] * a[0] + R[1, 1] * a[1] + R[1, 2] * a[2],
        R[2, 0] * a[0] + R[2, 1] * a[1] + R[2, 2] * a[2],
    )


@subroutine
def turned_back(R: Array3x3, a: V3) -> V3:
    """R' a."""
    return (
        R[0, 0] * a[0] + R[1, 0] * a[1] + R[2, 0] * a[2],
        R[0, 1] * a[0] + R[1, 1] * a[1] + R[2, 1] * a[2],
        R[0, 2] * a[0] + R[1, 2] * a[1] + R[2, 2] * a[2],
    )


@subroutine
def rotation_of(x: float, y: float, z: float, w: float, R: Array3x3) -> None:
    """Fill the rotation matrix of a unit quaternion."""
    R[0, 0], R[0, 1], R[0, 2] = 1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)
    R[1, 0], R[1, 1], R[1, 2] = 2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)
    R[2, 0], R[2, 1], R[2, 2] = 2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)


@subroutine
def rotation_by(vector: V3, R: Array3x3) -> None:
    """Fill the rotation by a rotation vector [rad]."""
    angle = np.sqrt(vector[0] ** 2 + vector[1] ** 2 + vector[2] ** 2)
    factor = np.sin(angle / 2) / angle if angle > 1e-6 else 0.5 - angle * angle / 48
    x, y, z = factor * vector[0], factor * vector[1], factor * vector[2]
    rotation_of(x, y, z, np.cos(angle / 2), R)


@subroutine
def rotation_vector(R: Array3x3) -> V3:
    """The rotation vector [rad] of a rotation matrix, of length 0 to pi."""
    q = np.empty(4)
    quaternion_of(R, q)
    if q[3] < 0.0:
        q *= -1.0
    sine = np.sqrt(q[0] ** 2 + q[1] ** 2 + q[2] ** 2)
    # 2 arcsin(x) / x = 2 + x^2 / 3 + ...
    factor = 2.0 * np.arctan2(sine, q[3]) / sine if sine > 1e-6 else 2.0 + sine * sine / 3.0
    return factor * q[0], factor * q[1], factor * q[2]


@subroutine
def quaternion_of(R: Array3x3, q: Array4) -> None:
    """Fill the quaternion x y z w of ``R``, from its largest component (Shepperd 1978)."""
    trace = R[0, 0] + R[1, 1] + R[2, 2]
    largest, i = trace, 3
    for k in range(3):
        if R[k, k] > largest:
            largest, i = R[k, k], k
    if i == 3:
        q[0], q[1], q[2] = R[2, 1] - R[1, 2], R[0, 2] - R[2, 0], R[1, 0] - R[0, 1]
        q[3] = 1.0 + trace
    else:
        j, k = (i + 1) % 3, (i + 2) % 3
        q[i] = 1.0 + 2.0 * R[i, i] - trace
        q[j], q[k] = R[i, j] + R[j, i], R[i, k] + R[k, i]
        q[3] = R[k, j] - R[j, k]
    q /= np.sqrt(q[0] ** 2 + q[1] ** 2 + q[2] ** 2 + q[3] ** 2)


Vector = Float[np.ndarray, " n"]
Square = Float[np.ndarray, "n n"]
DEFINITE = 1e-14  #: Share of a diagonal entry of H that must be left as its pivot


@subroutine
def solve_linear(A: Float[np.ndarray, "n m"], n: int) -> bool:
    """Gauss-Jordan with pivoting: the columns from n on become (A[:, :n])^-1 A[:, n:].

    False for a singular matrix.
    """
    columns = A.shape[1]
    for j in range(n):
        pivot = j
        for i in range(j + 1, n):
            if abs(A[i, j]) > abs(A[pivot, j]):
                pivot = i
        if not abs(A[pivot, j]) > 0.0:
            return False
        if pivot != j:
            for k in range(j, columns):
                A[j, k], A[pivot, k] = A[pivot, k], A[j, k]
        inverse = 1.0 / A[j, j]
        for k in range(j + 1, columns):
            A[j, k] *= inverse
        for i in range(n):
            if i == j:
                continue
            factor = A[i, j]
            for k in range(j + 1, columns):
                A[i, k] -= factor * A[j, k]
    return True


@subroutine
def factorise(H: Square, L: Square) -> bool:
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
def solve_factorised(L: Square, g: Vector, x: Vector) -> None:
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
