"""Vectors as triples of numbers, which compiled code keeps in registers, and their frames."""

from __future__ import annotations

from go2_wbc.kernels.compilation import subroutine

V3 = "UniTuple(f8, 3)"
"""A vector, in the notation of signatures."""
AXES = f"UniTuple({V3}, 3)"
"""The three axes of a frame."""


@subroutine(f"{V3}({V3}, {V3})")
def plus(a, b):
    """a + b."""
    return a[0] + b[0], a[1] + b[1], a[2] + b[2]


@subroutine(f"{V3}({V3}, f8, {V3})")
def plus_scaled(a, factor, b):
    """a + factor b."""
    return a[0] + factor * b[0], a[1] + factor * b[1], a[2] + factor * b[2]


@subroutine(f"{V3}({V3}, {V3})")
def cross(a, b):
    """a x b."""
    return a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]


@subroutine(f"f8({V3}, {V3})")
def dot(a, b):
    """a . b."""
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


@subroutine(f"{V3}(f8, f8, {V3})")
def about_x(c, s, a):
    """A vector turned about x by the angle of this cosine and sine."""
    return a[0], c * a[1] - s * a[2], s * a[1] + c * a[2]


@subroutine(f"{V3}(f8, f8, {V3})")
def about_y(c, s, a):
    """A vector turned about y."""
    return c * a[0] + s * a[2], a[1], c * a[2] - s * a[0]


@subroutine(f"{V3}(f8[::1], i8)")
def vector(numbers, start):
    """Three numbers of a row."""
    return numbers[start], numbers[start + 1], numbers[start + 2]


@subroutine(f"void(f8[::1], i8, {V3})")
def put(row, start, a):
    """Put a vector in its place in a row."""
    row[start], row[start + 1], row[start + 2] = a


@subroutine(f"{V3}({AXES}, {V3})")
def along(axes, a):
    """A vector given along these axes."""
    x, y, z = axes
    return (
        x[0] * a[0] + y[0] * a[1] + z[0] * a[2],
        x[1] * a[0] + y[1] * a[1] + z[1] * a[2],
        x[2] * a[0] + y[2] * a[1] + z[2] * a[2],
    )


@subroutine("void(f8, f8, f8, f8, f8[:,::1])")
def rotation_of(x, y, z, w, R):
    """Fill the rotation matrix of a unit quaternion."""
    R[0, 0], R[0, 1], R[0, 2] = 1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)
    R[1, 0], R[1, 1], R[1, 2] = 2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)
    R[2, 0], R[2, 1], R[2, 2] = 2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)
