"""Contact forces and torques along a trajectory, for many instants in one call.

``motions.feasibility.dynamic`` and ``friction`` say which equations these are and what they are
for. The forces f of k loaded feet share the load by a QP, with the columns of A the wrenches on the
base of forces along the world's axes, s what makes moments comparable, and e the evenness:

    min |s (A f - w)|^2 + e (|f_z|^2 - 2 f_z' (weight shares) + |f_xy|^2 / loads),  f in pyramids
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Float, Int

from go2_wbc.algebra.active_set import SOLVED, solve_qp
from go2_wbc.compilation import kernel, subroutine
from go2_wbc.robot.leg_kinematics import LegGeometry, Legs
from go2_wbc.wbc.loads import LEAST_PRESSURE, share_load

LegPoints = Float[np.ndarray, "5 3"]
"""Of a leg, in the base frame: points of the axes of hip, thigh and calf, the contact, a foot's
radius below the foot's centre, and the direction of the axes of thigh and calf."""


@dataclass(frozen=True, slots=True)
class LoadNumbers:
    """What the shares of the load depend on, besides the robot's geometry.

    Attributes:
        evenness: weight of an even share, against 1 of the wrench.
        weight: of the robot [N].
        force_max: greatest normal force [N] of a foot.
        foot_radius: [m].
    """

    evenness: float
    weight: float
    force_max: float
    foot_radius: float


@subroutine
def fill_leg_points(
    leg: LegGeometry,
    q: Float[np.ndarray, "3"],
    R: Float[np.ndarray, "3 3"],
    radius: float,
    points: LegPoints,
) -> None:
    """Fill the points of a leg, whose trunk is at R in the world."""
    ch, sh = np.cos(q[0]), np.sin(q[0])
    x, down = 0.0, 0.0
    for k in range(3):
        points[0, k] = leg.p_base_hip[k]
    for k in range(1, 4):  # thigh, calf, foot
        points[k, 0] = leg.p_base_hip[0] + x
        points[k, 1] = leg.p_base_hip[1] + leg.width * ch + down * sh
        points[k, 2] = leg.p_base_hip[2] + leg.width * sh - down * ch
        if k == 1:
            x, down = -leg.thigh * np.sin(q[1]), leg.thigh * np.cos(q[1])
        elif k == 2:
            x -= leg.calf * np.sin(q[1] + q[2])
            down += leg.calf * np.cos(q[1] + q[2])
    for k in range(3):
        points[3, k] -= radius * R[2, k]
    points[4, 0], points[4, 1], points[4, 2] = 0.0, ch, sh


@subroutine
def fill_expected_loads(
    points: Float[np.ndarray, "4 5 3"],
    R: Float[np.ndarray, "3 3"],
    wrench: Float[np.ndarray, "6"],
    loaded: Int[np.ndarray, "4"],
    shares: Float[np.ndarray, "4"],
    c: LoadNumbers,
    loads: Float[np.ndarray, " k"],
) -> None:
    """Fill the expected loads of the loaded feet, over their mean."""
    k = len(loads)
    places, most = np.empty((k, 2)), np.empty(k)
    F, N, depth = np.zeros(3), np.zeros(3), 0.0
    for axis in range(3):
        for m in range(3):
            F[axis] += R[axis, m] * wrench[m]
            N[axis] += R[axis, m] * wrench[3 + m]
    pressure = max(F[2], LEAST_PRESSURE * c.weight)
    for foot in range(k):
        p = points[loaded[foot], 3]
        for axis in range(2):
            places[foot, axis] = R[axis, 0] * p[0] + R[axis, 1] * p[1] + R[axis, 2] * p[2]
        depth -= (R[2, 0] * p[0] + R[2, 1] * p[1] + R[2, 2] * p[2]) / k
        most[foot] = c.force_max * shares[foot] * k / pressure
    x, y = -(N[1] + depth * F[0]) / pressure, (N[0] - depth * F[1]) / pressure
    share_load(places, x, y, most, loads)


@subroutine
def fill_cost(
    A: Float[np.ndarray, "6 n"],
    wrench: Float[np.ndarray, "6"],
    shares: Float[np.ndarray, " k"],
    loads: Float[np.ndarray, " k"],
    scale: Float[np.ndarray, "6"],
    c: LoadNumbers,
    H: Float[np.ndarray, "n n"],
    g: Float[np.ndarray, " n"],
) -> None:
    """Fill the cost x'Hx/2 + g'x of the forces x (3 k,) of k loaded feet."""
    evenness, weight, n, total = c.evenness, c.weight, len(g), 0.0
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


@subroutine
def fill_bounds(
    shares: Float[np.ndarray, " k"],
    pyramid: Float[np.ndarray, "r 3"],
    force_max: float,
    C: Float[np.ndarray, "m n"],
    lower: Float[np.ndarray, " m"],
    upper: Float[np.ndarray, " m"],
) -> None:
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


@subroutine
def fill_wrench_columns(
    points: LegPoints, R: Float[np.ndarray, "3 3"], foot: int, A: Float[np.ndarray, "6 12"]
) -> None:
    """Fill a foot's columns of A: the wrench on the base of a force along each world axis."""
    p0, p1, p2 = points[3, 0], points[3, 1], points[3, 2]
    for axis in range(3):
        r0, r1, r2 = R[axis, 0], R[axis, 1], R[axis, 2]
        column = 3 * foot + axis
        A[0, column], A[1, column], A[2, column] = r0, r1, r2
        A[3, column], A[4, column] = p1 * r2 - p2 * r1, p2 * r0 - p0 * r2
        A[5, column] = p0 * r1 - p1 * r0


@subroutine
def take_from_torques(
    points: LegPoints,
    R: Float[np.ndarray, "3 3"],
    f: Float[np.ndarray, "3"],
    tau: Float[np.ndarray, "3"],
) -> None:
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


@subroutine
def gather_loaded_feet(
    joints: Float[np.ndarray, "12"],
    R: Float[np.ndarray, "3 3"],
    load_share: Float[np.ndarray, "4"],
    legs: Legs,
    radius: float,
    points: Float[np.ndarray, "4 5 3"],
    loaded: Int[np.ndarray, "4"],
    shares: Float[np.ndarray, "4"],
    A: Float[np.ndarray, "6 12"],
) -> int:
    """Fill the loaded feet's c, shares and columns of A; returns how many there are."""
    k = 0
    for leg in range(4):
        if load_share[leg] > 0.0:
            loaded[k], shares[k] = leg, load_share[leg]
            fill_leg_points(
                legs.geometry[leg], joints[3 * leg : 3 * leg + 3], R, radius, points[leg]
            )
            fill_wrench_columns(points[leg], R, k, A)
            k += 1
    return k


@subroutine
def solve_forces(
    A: Float[np.ndarray, "6 n"],
    wrench: Float[np.ndarray, "6"],
    shares: Float[np.ndarray, " k"],
    loads: Float[np.ndarray, " k"],
    pyramid: Float[np.ndarray, "r 3"],
    scale: Float[np.ndarray, "6"],
    c: LoadNumbers,
    x: Float[np.ndarray, " n"],
) -> None:
    """Fill the forces of the loaded feet; zeros if there are none."""
    n, m = len(x), len(pyramid) * len(shares)
    H, g, C, lower, upper = (
        np.empty((n, n)),
        np.empty(n),
        np.empty((m, n)),
        np.empty(m),
        np.empty(m),
    )
    fill_cost(A, wrench, shares, loads, scale, c, H, g)
    fill_bounds(shares, pyramid, c.force_max, C, lower, upper)
    if solve_qp(H, g, np.empty((0, n)), np.empty(0), C, lower, upper, x, np.empty(m)) != SOLVED:
        for j in range(n):
            x[j] = 0.0


@subroutine
def fill_missing_wrench(
    A: Float[np.ndarray, "6 n"],
    wrench: Float[np.ndarray, "6"],
    x: Float[np.ndarray, " n"],
    left: Float[np.ndarray, "6"],
) -> None:
    """Fill what the forces leave of the wrench."""
    for r in range(6):
        left[r] = wrench[r]
        for j in range(len(x)):
            left[r] -= A[r, j] * x[j]


@kernel(nogil=True)
def share_loads(
    joints: Float[np.ndarray, "n 12"],
    R: Float[np.ndarray, "n 3 3"],
    needed: Float[np.ndarray, "n 6"],
    load_share: Float[np.ndarray, "n 4"],
    legs: Legs,
    pyramid: Float[np.ndarray, "r 3"],
    scale: Float[np.ndarray, "6"],
    c: LoadNumbers,
    contact: Float[np.ndarray, "n 4 3"],
    tau: Float[np.ndarray, "n 12"],
    missing: Float[np.ndarray, "n 2"],
) -> None:
    """Fill contact forces, torques, and what of force and moment the feet cannot give.

    ``needed``: the base's rows of M a + h. ``contact`` comes with zeros, ``tau`` with the joints'.
    """
    points, loaded, shares = np.empty((4, 5, 3)), np.empty(4, dtype=np.int64), np.empty(4)
    left, whole, loads = np.empty(6), np.empty((6, 12)), np.empty(4)
    for i in range(len(joints)):
        k = gather_loaded_feet(
            joints[i], R[i], load_share[i], legs, c.foot_radius, points, loaded, shares, whole
        )
        n = 3 * k
        A, x = whole[:, :n].copy(), np.zeros(n)
        if k > 0:
            fill_expected_loads(points, R[i], needed[i], loaded, shares, c, loads[:k])
            solve_forces(A, needed[i], shares[:k], loads[:k], pyramid, scale, c, x)
        for foot in range(k):
            leg, f = loaded[foot], x[3 * foot : 3 * foot + 3]
            take_from_torques(points[leg], R[i], f, tau[i, 3 * leg : 3 * leg + 3])
            for axis in range(3):
                contact[i, leg, axis] = f[axis]
        fill_missing_wrench(A, needed[i], x, left)
        missing[i, 0] = np.sqrt(left[0] ** 2 + left[1] ** 2 + left[2] ** 2)
        missing[i, 1] = np.sqrt(left[3] ** 2 + left[4] ** 2 + left[5] ** 2)


@kernel(nogil=True)
def least_friction(
    joints: Float[np.ndarray, "n 12"],
    R: Float[np.ndarray, "n 3 3"],
    needed: Float[np.ndarray, "n 6"],
    load_share: Float[np.ndarray, "n 4"],
    legs: Legs,
    cone: Float[np.ndarray, "r 3"],
    scale: Float[np.ndarray, "6"],
    c: LoadNumbers,
    highest: Float[np.ndarray, " n"],
    tolerance: float,
    friction: Float[np.ndarray, " n"],
) -> None:
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
        k = gather_loaded_feet(
            joints[i], R[i], load_share[i], legs, c.foot_radius, points, loaded, shares, whole
        )
        A, x = whole[:, : 3 * k].copy(), np.zeros(3 * k)
        if k > 0:
            fill_expected_loads(points, R[i], needed[i], loaded, shares, c, loads[:k])
        for _ in range(7 if k > 0 else 0):
            middle = 0.5 * (low + high)
            for facet in range(len(cone) - 1):
                facets[facet, 2] = middle * cone[facet, 2]
            solve_forces(A, needed[i], shares[:k], loads[:k], facets, scale, c, x)
            fill_missing_wrench(A, needed[i], x, left)
            missing = 0.0
            for r in range(6):
                missing += (scale[r] * left[r]) ** 2
            if missing > tolerance * tolerance:
                low = middle
            else:
                high = middle
        friction[i] = high


@kernel(nogil=True)
def accelerate(
    joints: Float[np.ndarray, "n 12"],
    R: Float[np.ndarray, "n 3 3"],
    a: Float[np.ndarray, "n 18"],
    legs: Legs,
    radius: float,
    feet: Float[np.ndarray, "n 4 2"],
) -> None:
    """Fill J a along the ground, of the contact point of every foot, with a of base and joints."""
    points, J_a = np.empty((5, 3)), np.empty(3)
    for i in range(len(joints)):
        for leg in range(4):
            fill_leg_points(
                legs.geometry[leg], joints[i, 3 * leg : 3 * leg + 3], R[i], radius, points
            )
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


@kernel(nogil=True)
def slide(
    forces: Float[np.ndarray, "n 4 3"],
    creep: Float[np.ndarray, "n 4 2"],
    counts: Bool[np.ndarray, "n 4"],
    friction: float,
    mass: float,
    dt: float,
    ways: Float[np.ndarray, "n 4"],
) -> None:
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


@kernel(nogil=True)
def lag(
    pushes: Float[np.ndarray, "n m"],
    kp: Float[np.ndarray, " m"],
    kd: Float[np.ndarray, " m"],
    dt: float,
    errors: Float[np.ndarray, "n m"],
) -> None:
    """Fill errors e that obey e'' + kd e' + kp e = push, from rest."""
    for axis in range(pushes.shape[1]):
        e, rate = 0.0, 0.0
        for i in range(len(pushes)):
            errors[i, axis] = e
            rate += dt * (pushes[i, axis] - kp[axis] * e - kd[axis] * rate)
            e += dt * rate
