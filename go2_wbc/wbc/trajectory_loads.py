"""Loads of the feet: as they are expected to lie now, and along a trajectory, with its torques.

A foot slips where it is asked for more force along the ground than friction gives, which is in
proportion to its load. So what feet are asked for along the ground is shared in this proportion.

Of all loads that act together at the zero-moment point c, as far as there are any, those nearest to
an even share are taken: with the feet r_i, their mean m and S = sum (r_i - m)(r_i - m)', the load
over its mean is 1 + k (r_i - m)' S^-1 (c - m). It is kept between ``LEAST_LOAD`` and ``MOST_LOAD``.

Along a trajectory many instants are solved in one call (see ``motions.feasibility.forces``). The
forces f of k loaded feet share the load by a QP, with the columns of A the wrenches on the base of
forces along the world's axes, s what makes moments comparable, and e the evenness:

    min |s (A f - w)|^2 + e (|f_z|^2 - 2 f_z' (weight shares) + |f_xy|^2 / loads),  f in pyramids
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from jaxtyping import Bool, Float, Int

from go2_wbc.algebra.active_set import SOLVED, solve_qp
from go2_wbc.algebra.linear import Square, Vector, cross, triple, turned, turned_back
from go2_wbc.compilation import kernel, subroutine
from go2_wbc.records import Array3, Array3x3, Array4, Array6, Array12, ArrayNx3x3, ArrayNx12
from go2_wbc.reference import STANCE, Target
from go2_wbc.robot.leg_kinematics import LegGeometry, Legs
from go2_wbc.robot.state import Snapshot

LEAST_LOAD, MOST_LOAD = 0.05, 2.0
"""Bounds of a foot's load, over the mean of the standing feet, by which it is spared: own
choice."""
LEAST_PRESSURE = 0.2
"""Share of the weight by which moments are divided at least: the zero-moment point stays near."""
SPREAD = 1e-6
"""[m^2] by which two feet, between which there is no area, count as spread to all sides."""


@subroutine
def share_load(
    places: Float[np.ndarray, "k 2"],
    x: float,
    y: float,
    most: Float[np.ndarray, " k"],
    loads: Float[np.ndarray, " k"],
) -> None:
    """Fill the normal forces of k feet, over their mean.

    Args:
        places: of the feet on the ground [m].
        x, y: the zero-moment point c [m].
        most: what each foot may bear, over the mean.
        loads: is filled.
    """
    k = len(loads)
    mx, my, xx, xy, yy = 0.0, 0.0, SPREAD, 0.0, SPREAD
    for foot in range(k):
        mx += places[foot, 0] / k
        my += places[foot, 1] / k
    for foot in range(k):
        dx, dy = places[foot, 0] - mx, places[foot, 1] - my
        xx, xy, yy = xx + dx * dx, xy + dx * dy, yy + dy * dy
    determinant = xx * yy - xy * xy
    slope_x = (yy * (x - mx) - xy * (y - my)) / determinant
    slope_y = (xx * (y - my) - xy * (x - mx)) / determinant
    for foot in range(k):
        dx, dy = places[foot, 0] - mx, places[foot, 1] - my
        load = min(1.0 + k * (dx * slope_x + dy * slope_y), most[foot])
        loads[foot] = min(max(load, LEAST_LOAD), MOST_LOAD)


@subroutine
def plan_loads(now: Snapshot, target: Target, weight_of_robot: float, loads: Array4) -> None:
    """Fill the load of each foot, over the mean, while the trunk does what is asked for.

    1 for a foot that does not stand. ``weight_of_robot`` [N] is without what it carries.
    """
    places, most, turn = np.empty((4, 2)), np.empty(4), np.zeros(3)
    k = 0
    for leg in range(4):
        loads[leg] = 1.0
        if target.legs[leg] == STANCE:
            k += 1
    if k == 0:
        return
    R, M, com = now.R_world_base, now.mass_matrix, now.p_world_com
    mass, height = M[0, 0], com[2]
    weight = weight_of_robot + now.payload[1]
    pressure = max(weight + mass * target.a_world[2], LEAST_PRESSURE * weight)
    foot = 0
    for leg in range(4):
        if target.legs[leg] == STANCE:
            p = now.p_world_feet[leg]
            places[foot, 0], places[foot, 1] = p[0], p[1]
            height -= p[2] / k
            most[foot] = target.normal_force_max[leg] * k / pressure
            foot += 1
    for i in range(3):
        moment = 0.0
        for n in range(3):
            for m in range(3):
                rate = R[m, n] * target.dw_world[m]
                moment += M[3 + i, 3 + n] * rate
        turn[i] = moment
    moment_x = R[0, 0] * turn[0] + R[0, 1] * turn[1] + R[0, 2] * turn[2]
    moment_y = R[1, 0] * turn[0] + R[1, 1] * turn[1] + R[1, 2] * turn[2]
    x = com[0] - (mass * height * target.a_world[0] + moment_y) / pressure
    y = com[1] - (mass * height * target.a_world[1] - moment_x) / pressure
    standing = np.empty(k)
    share_load(places[:k], x, y, most[:k], standing)
    foot = 0
    for leg in range(4):
        if target.legs[leg] == STANCE:
            loads[leg] = standing[foot]
            foot += 1


Facets = Float[np.ndarray, "r 3"]
LegPoints = Float[np.ndarray, "5 3"]
"""Of a leg, in the base frame: points of the axes of hip, thigh and calf, the contact, a foot's
radius below the foot's centre, and the direction of the axes of thigh and calf."""


@dataclass(frozen=True, slots=True)
class LoadNumbers:
    """What the shares of the load depend on, besides the robot's geometry."""

    evenness: float  #: weight of an even share, against 1 of the wrench
    weight: float  #: of the robot [N]
    force_max: float  #: greatest normal force [N] of a foot
    foot_radius: float  #: [m]


class LoadedFeet(NamedTuple):
    """The feet that bear something at an instant, one after the other; there are k of them."""

    leg: Int[np.ndarray, "4"]  #: of each
    share: Array4  #: of the load that each may bear
    load: Array4  #: what each is expected to bear, over their mean
    points: Float[np.ndarray, "4 5 3"]  #: of all legs, see ``LegPoints``
    A: Float[np.ndarray, "6 12"]
    """The wrench on the base of a force on each foot along each of the world's axes."""
    f: Array12  #: their forces [N]
    missing: Array6  #: what these leave of the wrench


@subroutine
def room_for_feet() -> LoadedFeet:
    """Of any number, nothing filled."""
    leg, points, A = np.empty(4, dtype=np.int64), np.empty((4, 5, 3)), np.empty((6, 12))
    return LoadedFeet(leg, np.empty(4), np.empty(4), points, A, np.empty(12), np.empty(6))


@subroutine
def fill_leg_points(
    leg: LegGeometry, q: Array3, R: Array3x3, radius: float, points: LegPoints
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
def gather(
    feet: LoadedFeet, joints: Array12, R: Array3x3, load_share: Array4, legs: Legs, radius: float
) -> int:
    """Fill all but loads and forces; returns k."""
    k = 0
    for leg in range(4):
        if load_share[leg] > 0.0:
            feet.leg[k], feet.share[k] = leg, load_share[leg]
            points = feet.points[leg]
            fill_leg_points(legs.geometry[leg], joints[3 * leg : 3 * leg + 3], R, radius, points)
            for axis in range(3):
                along = triple(R[axis])
                moment = cross(triple(points[3]), along)
                for i in range(3):
                    feet.A[i, 3 * k + axis], feet.A[3 + i, 3 * k + axis] = along[i], moment[i]
            k += 1
    return k


@subroutine
def expect_loads(feet: LoadedFeet, k: int, R: Array3x3, wrench: Array6, c: LoadNumbers) -> None:
    """Fill the expected loads."""
    places, most = np.empty((k, 2)), np.empty(k)
    F, N, depth = turned(R, triple(wrench[:3])), turned(R, triple(wrench[3:])), 0.0
    pressure = max(F[2], LEAST_PRESSURE * c.weight)
    for foot in range(k):
        x, y, z = turned(R, triple(feet.points[feet.leg[foot], 3]))
        places[foot, 0], places[foot, 1] = x, y
        depth -= z / k
        most[foot] = c.force_max * feet.share[foot] * k / pressure
    x, y = -(N[1] + depth * F[0]) / pressure, (N[0] - depth * F[1]) / pressure
    share_load(places, x, y, most, feet.load[:k])


@subroutine
def fill_cost(
    feet: LoadedFeet, wrench: Array6, scale: Array6, c: LoadNumbers, H: Square, g: Vector
) -> None:
    """Fill the cost x'Hx/2 + g'x of the forces x (3 k,)."""
    A, load, share, n, total = feet.A, feet.load, feet.share, len(g), 0.0
    for foot in range(n // 3):
        total += share[foot]
    for i in range(n):
        g[i] = 0.0 if i % 3 < 2 else -c.evenness * c.weight * share[i // 3] / total
        for r in range(6):
            g[i] -= scale[r] * A[r, i] * scale[r] * wrench[r]
        for j in range(i + 1):
            value = 0.0
            if i == j:
                value = c.evenness if i % 3 == 2 else c.evenness / load[i // 3]
            for r in range(6):
                value += scale[r] * A[r, i] * scale[r] * A[r, j]
            H[i, j], H[j, i] = value, value


@subroutine
def solve_forces(
    feet: LoadedFeet, k: int, wrench: Array6, facets: Facets, scale: Array6, c: LoadNumbers
) -> None:
    """Fill the forces, none if no loads are within the ``facets``, and what they leave.

    The facets of a foot's force are those of friction and, the last one, its normal force.
    """
    n, rows, x = 3 * k, len(facets), feet.f[: 3 * k]
    m = rows * k
    H, g, C, lower, upper = (
        np.empty((n, n)),
        np.empty(n),
        np.zeros((m, n)),
        np.empty(m),
        np.empty(m),
    )
    for row in range(m):
        foot, kind = row // rows, row % rows
        is_friction = kind < rows - 1
        for axis in range(3):
            C[row, 3 * foot + axis] = facets[kind, axis]
        lower[row] = -np.inf if is_friction else 0.0
        upper[row] = 0.0 if is_friction else c.force_max * feet.share[foot]
    if k > 0:
        fill_cost(feet, wrench, scale, c, H, g)
        none = np.empty(0)
        if solve_qp(H, g, np.empty((0, n)), none, C, lower, upper, x, none) != SOLVED:
            x[:] = 0.0
    for r in range(6):
        feet.missing[r] = wrench[r]
        for j in range(n):
            feet.missing[r] -= feet.A[r, j] * x[j]


@subroutine
def take_from_torques(points: LegPoints, R: Array3x3, force: Array3, tau: Array3) -> None:
    """Take from a leg's torques what a force on its foot does to them."""
    f = turned_back(R, triple(force))
    for joint in range(3):
        p, o = points[3], points[joint]
        x, y, z = cross((p[0] - o[0], p[1] - o[1], p[2] - o[2]), f)
        tau[joint] -= x if joint == 0 else points[4, 1] * y + points[4, 2] * z


@kernel(nogil=True)
def share_loads(
    joints: ArrayNx12,
    R: ArrayNx3x3,
    needed: Float[np.ndarray, "n 6"],
    load_share: Float[np.ndarray, "n 4"],
    legs: Legs,
    pyramid: Facets,
    scale: Array6,
    c: LoadNumbers,
    contact: Float[np.ndarray, "n 4 3"],
    tau: ArrayNx12,
    missing: Float[np.ndarray, "n 2"],
) -> None:
    """Fill contact forces, torques, and what of force and moment the feet cannot give.

    ``needed``: the base's rows of M a + h. ``contact`` comes with zeros, ``tau`` with the joints'.
    """
    feet = room_for_feet()
    for i in range(len(joints)):
        k = gather(feet, joints[i], R[i], load_share[i], legs, c.foot_radius)
        if k > 0:
            expect_loads(feet, k, R[i], needed[i], c)
        solve_forces(feet, k, needed[i], pyramid, scale, c)
        for foot in range(k):
            leg, f = feet.leg[foot], feet.f[3 * foot : 3 * foot + 3]
            take_from_torques(feet.points[leg], R[i], f, tau[i, 3 * leg : 3 * leg + 3])
            contact[i, leg, :] = f
        left = feet.missing
        missing[i, 0] = np.sqrt(left[0] ** 2 + left[1] ** 2 + left[2] ** 2)
        missing[i, 1] = np.sqrt(left[3] ** 2 + left[4] ** 2 + left[5] ** 2)


@kernel(nogil=True)
def least_friction(
    joints: ArrayNx12,
    R: ArrayNx3x3,
    needed: Float[np.ndarray, "n 6"],
    load_share: Float[np.ndarray, "n 4"],
    legs: Legs,
    cone: Facets,
    scale: Array6,
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
    feet, facets = room_for_feet(), cone.copy()
    for i in range(len(joints)):
        low, high = 0.0, highest[i]
        if high == 0.0:
            continue
        k = gather(feet, joints[i], R[i], load_share[i], legs, c.foot_radius)
        if k > 0:
            expect_loads(feet, k, R[i], needed[i], c)
        for _ in range(7 if k > 0 else 0):
            middle = 0.5 * (low + high)
            for facet in range(len(cone) - 1):
                facets[facet, 2] = middle * cone[facet, 2]
            solve_forces(feet, k, needed[i], facets, scale, c)
            missing = 0.0
            for r in range(6):
                missing += (scale[r] * feet.missing[r]) ** 2
            if missing > tolerance * tolerance:
                low = middle
            else:
                high = middle
        friction[i] = high


@kernel(nogil=True)
def accelerate(
    joints: ArrayNx12,
    R: ArrayNx3x3,
    a: Float[np.ndarray, "n 18"],
    legs: Legs,
    radius: float,
    feet: Float[np.ndarray, "n 4 2"],
) -> None:
    """Fill J a along the ground, of the contact point of every foot, with a of base and joints."""
    points, J_a = np.empty((5, 3)), np.empty(3)
    for i in range(len(joints)):
        for leg in range(4):
            q = joints[i, 3 * leg : 3 * leg + 3]
            fill_leg_points(legs.geometry[leg], q, R[i], radius, points)
            p = points[3]
            for k in range(3):
                m, n = (k + 1) % 3, (k + 2) % 3
                J_a[k] = a[i, k] + a[i, 3 + m] * p[n] - a[i, 3 + n] * p[m]
            for joint in range(3):
                axis, o = triple(points[4]) if joint > 0 else (1.0, 0.0, 0.0), points[joint]
                turning = cross(axis, (p[0] - o[0], p[1] - o[1], p[2] - o[2]))
                for k in range(3):
                    J_a[k] += a[i, 6 + 3 * leg + joint] * turning[k]
            feet[i, leg, 0], feet[i, leg, 1], _ = turned(R[i], triple(J_a))


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
