"""Contact forces and torques along a trajectory: the arithmetic of ``motions.feasibility.dynamic``.

What each quantity is, and the QP that shares the load, is described there; ``legs`` holds
``LegGeometry.row`` of each leg (``robot.leg_kinematics``).
"""

from __future__ import annotations

import numpy as np

from go2_wbc.algebra.active_set import SOLVED, solve_qp
from go2_wbc.kernels.compilation import kernel, subroutine
from go2_wbc.kernels.layout import LEAST_PRESSURE
from go2_wbc.kernels.standing import relative_loads


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


@subroutine("void(f8[:,:,::1], f8[:,::1], f8[::1], i8[::1], f8[::1], f8[::1], f8[::1])")
def expect(points, R, wrench, loaded, shares, numbers, loads):
    """Fill the expected loads of the loaded feet, over their mean."""
    k = len(loads)
    places, most = np.empty((k, 2)), np.empty(k)
    F, N, depth = np.zeros(3), np.zeros(3), 0.0
    for axis in range(3):
        for m in range(3):
            F[axis] += R[axis, m] * wrench[m]
            N[axis] += R[axis, m] * wrench[3 + m]
    pressure = max(F[2], LEAST_PRESSURE * numbers[1])
    for foot in range(k):
        p = points[loaded[foot], 3]
        for axis in range(2):
            places[foot, axis] = R[axis, 0] * p[0] + R[axis, 1] * p[1] + R[axis, 2] * p[2]
        depth -= (R[2, 0] * p[0] + R[2, 1] * p[1] + R[2, 2] * p[2]) / k
        most[foot] = numbers[2] * shares[foot] * k / pressure
    x, y = -(N[1] + depth * F[0]) / pressure, (N[0] - depth * F[1]) / pressure
    relative_loads(places, x, y, most, loads)


@subroutine("void(f8[:,::1], f8[::1], f8[::1], f8[::1], f8[::1], f8[::1], f8[:,::1], f8[::1])")
def weigh(A, wrench, shares, loads, scale, numbers, H, g):
    """Fill the cost x'Hx/2 + g'x of the forces x (3 k,) of k loaded feet."""
    evenness, weight, n, total = numbers[0], numbers[1], len(g), 0.0
    for foot in range(len(shares)):
        total += shares[foot]
    for i in range(n):
        g[i] = 0.0 if i % 3 < 2 else -evenness * weight * shares[i // 3] / total
        for r in range(6):
            g[i] -= scale[r] * A[r, i] * scale[r] * wrench[r]
        for j in range(i + 1):
            value = 0.0
            if i == j:
                value = evenness if i % 3 == 2 else evenness / loads[i // 3]
            for r in range(6):
                value += scale[r] * A[r, i] * scale[r] * A[r, j]
            H[i, j], H[j, i] = value, value


@subroutine("void(f8[::1], f8[:,::1], f8, f8[:,::1], f8[::1], f8[::1])")
def bound(shares, pyramid, force_max, C, lower, upper):
    """Fill the rows of friction and normal force, which is the last of them, of the loaded feet."""
    rows = len(pyramid)
    for row in range(len(lower)):
        foot, kind = row // rows, row % rows
        for column in range(C.shape[1]):
            C[row, column] = 0.0
        for axis in range(3):
            C[row, 3 * foot + axis] = pyramid[kind, axis]
        lower[row] = -np.inf if kind < rows - 1 else 0.0
        upper[row] = 0.0 if kind < rows - 1 else force_max * shares[foot]


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


@subroutine(
    "i8(f8[::1], f8[:,::1], f8[::1], f8[:,::1], f8, f8[:,:,::1], i8[::1], f8[::1], f8[:,::1])"
)
def gather(joints, R, load_share, legs, radius, points, loaded, shares, A):
    """Fill the loaded feet's numbers, shares and columns of A; returns how many there are."""
    k = 0
    for leg in range(4):
        if load_share[leg] > 0.0:
            loaded[k], shares[k] = leg, load_share[leg]
            place_leg(legs[leg], joints[3 * leg : 3 * leg + 3], R, radius, points[leg])
            press(points[leg], R, k, A)
            k += 1
    return k


@subroutine("void(f8[:,::1], f8[::1], f8[::1], f8[::1], f8[:,::1], f8[::1], f8[::1], f8[::1])")
def share(A, wrench, shares, loads, pyramid, scale, numbers, x):
    """Fill the forces of the loaded feet; zeros if there are none."""
    n, m = len(x), len(pyramid) * len(shares)
    H, g, C, lower, upper = (
        np.empty((n, n)),
        np.empty(n),
        np.empty((m, n)),
        np.empty(m),
        np.empty(m),
    )
    weigh(A, wrench, shares, loads, scale, numbers, H, g)
    bound(shares, pyramid, numbers[2], C, lower, upper)
    if solve_qp(H, g, np.empty((0, 12)), np.empty(0), C, lower, upper, x, np.empty(m)) != SOLVED:
        for j in range(n):
            x[j] = 0.0


@subroutine("void(f8[:,::1], f8[::1], f8[::1], f8[::1])")
def remain(A, wrench, x, left):
    """Fill what the forces leave of the wrench."""
    for r in range(6):
        left[r] = wrench[r]
        for j in range(len(x)):
            left[r] -= A[r, j] * x[j]


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
    left, whole, loads = np.empty(6), np.empty((6, 12)), np.empty(4)
    for i in range(len(joints)):
        k = gather(joints[i], R[i], load_share[i], legs, numbers[3], points, loaded, shares, whole)
        n = 3 * k
        A, x = whole[:, :n].copy(), np.zeros(n)
        if k > 0:
            expect(points, R[i], needed[i], loaded, shares, numbers, loads[:k])
            share(A, needed[i], shares[:k], loads[:k], pyramid, scale, numbers, x)
        for foot in range(k):
            leg, f = loaded[foot], x[3 * foot : 3 * foot + 3]
            relieve(points[leg], R[i], f, tau[i, 3 * leg : 3 * leg + 3])
            for axis in range(3):
                contact[i, leg, axis] = f[axis]
        remain(A, needed[i], x, left)
        missing[i, 0] = np.sqrt(left[0] ** 2 + left[1] ** 2 + left[2] ** 2)
        missing[i, 1] = np.sqrt(left[3] ** 2 + left[4] ** 2 + left[5] ** 2)


@kernel(
    "void(f8[:,::1], f8[:,:,::1], f8[:,::1], f8[:,::1], f8[:,::1], f8[:,::1], f8[::1], f8[::1], "
    "f8[::1], f8, f8[::1])",
    nogil=True,
)
def least_friction(
    joints, R, needed, load_share, legs, cone, scale, numbers, highest, tolerance, friction
):
    """Fill the least friction coefficient with which the feet can give the wrench.

    ``cone``: facets at a coefficient of 1. ``highest``: what is enough; 0 where nothing is asked.
    ``tolerance``: greatest part of the scaled wrench [N] that may be missing. By bisection: the
    forces that a coefficient allows are among those that a greater one does.
    """
    points, loaded, shares = np.empty((4, 5, 3)), np.empty(4, dtype=np.int64), np.empty(4)
    left, whole, facets, loads = np.empty(6), np.empty((6, 12)), cone.copy(), np.empty(4)
    for i in range(len(joints)):
        low, high = 0.0, highest[i]
        if high == 0.0:
            continue
        k = gather(joints[i], R[i], load_share[i], legs, numbers[3], points, loaded, shares, whole)
        A, x = whole[:, : 3 * k].copy(), np.zeros(3 * k)
        if k > 0:
            expect(points, R[i], needed[i], loaded, shares, numbers, loads[:k])
        for _ in range(7 if k > 0 else 0):
            middle = 0.5 * (low + high)
            for facet in range(len(cone) - 1):
                facets[facet, 2] = middle * cone[facet, 2]
            share(A, needed[i], shares[:k], loads[:k], facets, scale, numbers, x)
            remain(A, needed[i], x, left)
            missing = 0.0
            for r in range(6):
                missing += (scale[r] * left[r]) ** 2
            if missing > tolerance * tolerance:
                low = middle
            else:
                high = middle
        friction[i] = high


@kernel(
    "void(f8[:,::1], f8[:,:,::1], f8[:,::1], f8[:,::1], f8, f8[:,:,::1])",
    nogil=True,
)
def accelerate(joints, R, a, legs, radius, feet):
    """Fill J a along the ground, of the contact point of every foot, with a of base and joints."""
    points, J_a = np.empty((5, 3)), np.empty(3)
    for i in range(len(joints)):
        for leg in range(4):
            place_leg(legs[leg], joints[i, 3 * leg : 3 * leg + 3], R[i], radius, points)
            p = points[3]
            for k in range(3):
                m, n = (k + 1) % 3, (k + 2) % 3
                J_a[k] = a[i, k] + a[i, 3 + m] * p[n] - a[i, 3 + n] * p[m]
            for joint in range(3):
                rate = a[i, 6 + 3 * leg + joint]
                u, v, w = 1.0, 0.0, 0.0
                if joint > 0:
                    u, v, w = points[4, 0], points[4, 1], points[4, 2]
                a0, a1 = p[0] - points[joint, 0], p[1] - points[joint, 1]
                a2 = p[2] - points[joint, 2]
                J_a[0] += rate * (v * a2 - w * a1)
                J_a[1] += rate * (w * a0 - u * a2)
                J_a[2] += rate * (u * a1 - v * a0)
            for axis in range(2):
                row = R[i, axis]
                feet[i, leg, axis] = row[0] * J_a[0] + row[1] * J_a[1] + row[2] * J_a[2]


@kernel("void(f8[:,:,::1], f8[:,:,::1], b1[:,::1], f8, f8, f8, f8[:,::1])", nogil=True)
def slide(forces, creep, counts, friction, mass, dt, ways):
    """Fill how far every foot has slid since it began to count.

    A sliding block (Newmark 1965): what a force along the ground exceeds friction by accelerates
    the foot, which friction then stops. ``creep`` is its speed besides.
    """
    for leg in range(4):
        vx, vy, x, y = 0.0, 0.0, 0.0, 0.0
        for i in range(len(forces)):
            if not counts[i, leg]:
                vx, vy, x, y = 0.0, 0.0, 0.0, 0.0
                continue
            fx, fy = forces[i, leg, 0], forces[i, leg, 1]
            holds = friction * max(forces[i, leg, 2], 0.0)
            speed, force = np.hypot(vx, vy), np.hypot(fx, fy)
            if speed == 0.0 and force <= holds:
                ux, uy = fx, fy
            elif speed == 0.0:
                ux, uy = holds * fx / force, holds * fy / force
            else:
                ux, uy = holds * vx / speed, holds * vy / speed
            nx, ny = vx + dt * (fx - ux) / mass, vy + dt * (fy - uy) / mass
            if force <= holds and nx * vx + ny * vy <= 0.0:
                nx, ny = 0.0, 0.0
            vx, vy = nx, ny
            x, y = x + dt * (vx + creep[i, leg, 0]), y + dt * (vy + creep[i, leg, 1])
            ways[i, leg] = np.hypot(x, y)


@kernel("void(f8[:,::1], f8[::1], f8[::1], f8, f8[:,::1])", nogil=True)
def lag(pushes, kp, kd, dt, errors):
    """Fill errors e that obey e'' + kd e' + kp e = push, from rest."""
    for axis in range(pushes.shape[1]):
        e, rate = 0.0, 0.0
        for i in range(len(pushes)):
            errors[i, axis] = e
            rate += dt * (pushes[i, axis] - kp[axis] * e - kd[axis] * rate)
            e += dt * rate
