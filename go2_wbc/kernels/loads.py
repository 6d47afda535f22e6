"""Contact forces and torques along a trajectory: the arithmetic of ``motions.feasibility.dynamic``.

What each quantity is, and the QP that shares the load, is described there; ``legs`` holds
``LegGeometry.row`` of each leg (``robot.leg_kinematics``).
"""

from __future__ import annotations

import numpy as np

from go2_wbc.kernels.active_set import SOLVED, solve_qp
from go2_wbc.kernels.compilation import kernel, subroutine


@subroutine("void(f8[::1], f8[::1], f8[:,::1], f8, f8[:,::1])")
def place_leg(leg, q, R, radius, points):
    """Fill points of a leg in the base frame: of the axes of hip, thigh and calf, and of contact.

    The contact lies a foot's radius below the foot's centre. The last row is the direction of the
    axes of thigh and calf.
    """
    ch, sh = np.cos(q[0]), np.sin(q[0])
    x, down = 0.0, 0.0
    for k in range(3):
        points[0, k] = leg[k]
    for k in range(1, 4):  # thigh, calf, foot
        points[k, 0] = leg[0] + x
        points[k, 1] = leg[1] + leg[3] * ch + down * sh
        points[k, 2] = leg[2] + leg[3] * sh - down * ch
        if k == 1:
            x, down = -leg[4] * np.sin(q[1]), leg[4] * np.cos(q[1])
        elif k == 2:
            x -= leg[5] * np.sin(q[1] + q[2])
            down += leg[5] * np.cos(q[1] + q[2])
    for k in range(3):
        points[3, k] -= radius * R[2, k]
    points[4, 0], points[4, 1], points[4, 2] = 0.0, ch, sh


@subroutine("void(f8[:,::1], f8[::1], f8[::1], f8[::1], f8[::1], f8[:,::1], f8[::1])")
def weigh(A, wrench, shares, scale, numbers, H, g):
    """Fill the cost x'Hx/2 + g'x of the forces x (3 k,) of k loaded feet."""
    evenness, weight, n, total = numbers[0], numbers[1], len(g), 0.0
    for foot in range(len(shares)):
        total += shares[foot]
    for i in range(n):
        g[i] = 0.0 if i % 3 < 2 else -evenness * weight * shares[i // 3] / total
        for r in range(6):
            g[i] -= scale[r] * A[r, i] * scale[r] * wrench[r]
        for j in range(i + 1):
            value = evenness if i == j else 0.0
            for r in range(6):
                value += scale[r] * A[r, i] * scale[r] * A[r, j]
            H[i, j], H[j, i] = value, value


@subroutine("void(f8[::1], f8[:,::1], f8, f8[:,::1], f8[::1], f8[::1])")
def bound(shares, pyramid, force_max, C, lower, upper):
    """Fill the rows of friction and normal force of the loaded feet."""
    for row in range(len(lower)):
        foot, kind = row // 5, row % 5
        for column in range(C.shape[1]):
            C[row, column] = 0.0
        for axis in range(3):
            C[row, 3 * foot + axis] = pyramid[kind, axis]
        lower[row] = -np.inf if kind < 4 else 0.0
        upper[row] = 0.0 if kind < 4 else force_max * shares[foot]


@subroutine("void(f8[:,::1], f8[:,::1], i8, f8[:,::1])")
def press(points, R, foot, A):
    """Fill a foot's columns of A: the wrench on the base of a force along each world axis."""
    p0, p1, p2 = points[3, 0], points[3, 1], points[3, 2]
    for axis in range(3):
        r0, r1, r2 = R[axis, 0], R[axis, 1], R[axis, 2]
        column = 3 * foot + axis
        A[0, column], A[1, column], A[2, column] = r0, r1, r2
        A[3, column], A[4, column] = p1 * r2 - p2 * r1, p2 * r0 - p0 * r2
        A[5, column] = p0 * r1 - p1 * r0


@subroutine("void(f8[:,::1], f8[:,::1], f8[::1], f8[::1])")
def relieve(points, R, f, tau):
    """Take from a leg's torques what a force on its foot does to them."""
    f0 = R[0, 0] * f[0] + R[1, 0] * f[1] + R[2, 0] * f[2]  # in the base frame
    f1 = R[0, 1] * f[0] + R[1, 1] * f[1] + R[2, 1] * f[2]
    f2 = R[0, 2] * f[0] + R[1, 2] * f[1] + R[2, 2] * f[2]
    for joint in range(3):
        a0, a1 = points[3, 0] - points[joint, 0], points[3, 1] - points[joint, 1]
        a2 = points[3, 2] - points[joint, 2]
        if joint == 0:
            tau[0] -= a1 * f2 - a2 * f1
        else:
            tau[joint] -= points[4, 1] * (a2 * f0 - a0 * f2) + points[4, 2] * (a0 * f1 - a1 * f0)


@kernel(
    "void(f8[:,::1], f8[:,:,::1], f8[:,::1], f8[:,::1], f8[:,::1], f8[:,::1], f8[::1], f8[::1], "
    "f8[:,:,::1], f8[:,::1], f8[:,::1])",
    nogil=True,
)
def share_loads(
    joints, R, needed, load_share, legs, pyramid, scale, numbers, contact, tau, missing
):
    """Fill contact forces, torques, and what of force and moment the feet cannot give.

    ``needed``: M a + h; ``numbers``: evenness, weight [N], greatest normal force [N], foot radius
    [m]. ``contact`` comes with zeros, ``tau`` with the joints' rows of ``needed``.
    """
    points, loaded, shares = np.empty((4, 5, 3)), np.empty(4, dtype=np.int64), np.empty(4)
    left, E, e = np.empty(6), np.empty((0, 12)), np.empty(0)
    for i in range(len(joints)):
        k = 0
        for leg in range(4):
            if load_share[i, leg] > 0.0:
                loaded[k], shares[k] = leg, load_share[i, leg]
                k += 1
        n, m = 3 * k, 5 * k
        A, x = np.empty((6, n)), np.empty(n)
        for foot in range(k):
            leg = loaded[foot]
            q = joints[i, 3 * leg : 3 * leg + 3]
            place_leg(legs[leg], q, R[i], numbers[3], points[leg])
            press(points[leg], R[i], foot, A)
        if k > 0:
            H, g, C = np.empty((n, n)), np.empty(n), np.empty((m, n))
            lower, upper = np.empty(m), np.empty(m)
            weigh(A, needed[i], shares[:k], scale, numbers, H, g)
            bound(shares[:k], pyramid, numbers[2], C, lower, upper)
            if solve_qp(H, g, E, e, C, lower, upper, x, np.empty(m)) != SOLVED:
                for j in range(n):
                    x[j] = 0.0
        for foot in range(k):
            leg, f = loaded[foot], x[3 * foot : 3 * foot + 3]
            relieve(points[leg], R[i], f, tau[i, 3 * leg : 3 * leg + 3])
            for axis in range(3):
                contact[i, leg, axis] = f[axis]
        for r in range(6):
            left[r] = needed[i, r]
            for j in range(n):
                left[r] -= A[r, j] * x[j]
        missing[i, 0] = np.sqrt(left[0] ** 2 + left[1] ** 2 + left[2] ** 2)
        missing[i, 1] = np.sqrt(left[3] ** 2 + left[4] ** 2 + left[5] ** 2)
