"""Vectors as triples of numbers, which compiled code keeps in registers, and their frames."""

from __future__ import annotations

import numpy as np
from jaxtyping import Float

from go2_wbc.compilation import subroutine
from go2_wbc.records import V3

Axes = tuple[V3, V3, V3]
"""The three axes of a frame."""


@subroutine
def triple(a: Float[np.ndarray, "3"]) -> V3:
    """The numbers of an array."""
    return a[0], a[1], a[2]


@subroutine
def put(a: V3, into: Float[np.ndarray, "3"]) -> None:
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
def rotation_of(x: float, y: float, z: float, w: float, R: Float[np.ndarray, "3 3"]) -> None:
    """Fill the rotation matrix of a unit quaternion."""
    R[0, 0], R[0, 1], R[0, 2] = 1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)
    R[1, 0], R[1, 1], R[1, 2] = 2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)
    R[2, 0], R[2, 1], R[2, 2] = 2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)


@subroutine
def rotation_by(vector: V3, R: Float[np.ndarray, "3 3"]) -> None:
    """Fill the rotation by a rotation vector [rad]."""
    angle = np.sqrt(vector[0] ** 2 + vector[1] ** 2 + vector[2] ** 2)
    factor = np.sin(angle / 2) / angle if angle > 1e-6 else 0.5 - angle * angle / 48
    x, y, z = factor * vector[0], factor * vector[1], factor * vector[2]
    rotation_of(x, y, z, np.cos(angle / 2), R)
