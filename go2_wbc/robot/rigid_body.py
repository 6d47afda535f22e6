"""Every quantity of a snapshot from q and v in one pass, for a robot whose legs are a Go2's.

That is a trunk with four legs of three joints, which turn about x, y and y; ``robot.snapshot`` says
what each quantity is. Mass matrix: composite rigid bodies; bias: Newton and Euler (Featherstone,
*Rigid Body Dynamics Algorithms*, 2008, sec. 6.2 and 5.3):

    M_ij = s_i' I_C s_j       s: axes of the joints, I_C: inertia of all that lies beyond the later
    h = (f, m) on the base, and s_i' m_i, of the wrenches that move the bodies at zero acceleration

The first rows of M are the robot's linear momentum, from which the CoM's terms follow (Wieber,
Tedrake & Kuindersma 2016, eq. 48.16): J_com = R M_p / m, drift_com = R h_p / m - g. A leg is
computed along the axes of its hip, which the hip's angle turns about x from the base's: thigh and
calf turn about y of these axes, so that few rotations are left.

A body is its mass m, its first moment h = m c and its inertia I = (xx, xy, xz, yy, yz, zz), both
about the origin of its joint. The trunk may carry a
point mass beside its own parts.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import pinocchio as pin
from jaxtyping import Float

from go2_wbc.algebra.linear import (
    Axes,
    about_x,
    about_y,
    along,
    cross,
    plus,
    plus_scaled,
    put,
    rotation_of,
    triple,
)
from go2_wbc.compilation import Foreign, kernel, subroutine
from go2_wbc.records import V3, Array4x3, Array12, Array18, Array19, Record
from go2_wbc.robot.state import Snapshot
from go2_wbc.validation import FINITE, NOT_NEGATIVE, ranged


@dataclass(frozen=True, slots=True)
@ranged(mass=NOT_NEGATIVE, place=FINITE)
class Payload:
    """A point mass that is fixed to the trunk."""

    mass: float = 0.0  #: [kg]
    place: tuple[float, float, float] = (0.0, 0.0, 0.0)  #: in the base frame [m]

    @property
    def inertia(self) -> pin.Inertia:
        """About the base's origin."""
        return pin.Inertia(self.mass, np.array(self.place), np.zeros((3, 3)))


NO_PAYLOAD = Payload()  #: The robot carries nothing


Inertia = tuple[float, float, float, float, float, float]
Body = tuple[float, V3, Inertia]
LegBodies = tuple[float, float, V3, V3, V3, V3, Body, Body, Body]
"""Cosine and sine of the hip's angle, places and bodies: see ``place_leg``."""
Wrench = tuple[V3, V3]  #: Force and moment
_ZERO = (0.0, 0.0, 0.0)


class RigidBodies(Record):
    """The robot's numbers: of trunk, then hip, thigh and calf of each leg."""

    mass: float  #: of all [kg], with the payload
    gravity: float  #: [m/s^2]
    foot_radius: float  #: [m]
    link_mass: Float[np.ndarray, "13"]  #: [kg]; the payload is in the trunk's, as in the next two
    link_moment: Float[np.ndarray, "13 3"]  #: first moment [kg m]
    link_inertia: Float[np.ndarray, "13 6"]  #: as of a body [kg m^2]
    p_joints: Float[np.ndarray, "12 3"]  #: places of the joints [m] in the frame of the link before
    p_calf_feet: Array4x3  #: places of the feet's centres [m]
    armature: Array12  #: inertia of the rotors [kg m^2]
    payload: Payload  #: what the trunk carries


@subroutine
def times(inertia: Inertia, a: V3) -> V3:
    """Inertia times a vector."""
    xx, xy, xz, yy, yz, zz = inertia
    x, y, z = a
    return xx * x + xy * y + xz * z, xy * x + yy * y + yz * z, xz * x + yz * y + zz * z


@subroutine
def inertia_about_x(c: float, s: float, inertia: Inertia) -> Inertia:
    """An inertia turned about x."""
    xx, xy, xz, yy, yz, zz = inertia
    cc, cs, ss = c * c, c * s, s * s
    return (
        xx,
        c * xy - s * xz,
        s * xy + c * xz,
        cc * yy - 2.0 * cs * yz + ss * zz,
        cs * (yy - zz) + (cc - ss) * yz,
        ss * yy + 2.0 * cs * yz + cc * zz,
    )


@subroutine
def inertia_about_y(c: float, s: float, inertia: Inertia) -> Inertia:
    """An inertia turned about y."""
    xx, xy, xz, yy, yz, zz = inertia
    cc, cs, ss = c * c, c * s, s * s
    return (
        cc * xx + 2.0 * cs * xz + ss * zz,
        c * xy + s * yz,
        cs * (zz - xx) + (cc - ss) * xz,
        yy,
        c * yz - s * xy,
        ss * xx - 2.0 * cs * xz + cc * zz,
    )


@subroutine
def joined(a: Body, b: Body, d: V3) -> Body:
    """The body of a and of b, which is given about a point at d.

    About the other point its inertia is I + m (d'd 1 - d d') + 2 h'd 1 - h d' - d h'.
    """
    m, h, inertia = b
    moment = plus_scaled(h, m, d)
    xx, yy, zz = d[0] * (h[0] + moment[0]), d[1] * (h[1] + moment[1]), d[2] * (h[2] + moment[2])
    moved = (
        a[2][0] + inertia[0] + yy + zz,
        a[2][1] + inertia[1] - d[0] * moment[1] - h[0] * d[1],
        a[2][2] + inertia[2] - d[0] * moment[2] - h[0] * d[2],
        a[2][3] + inertia[3] + xx + zz,
        a[2][4] + inertia[4] - d[1] * moment[2] - h[1] * d[2],
        a[2][5] + inertia[5] + xx + yy,
    )
    return a[0] + m, plus(a[1], moment), moved


@subroutine
def link(robot: RigidBodies, n: int) -> Body:
    """Link n along its own axes."""
    b = robot.link_inertia[n]
    inertia = b[0], b[1], b[2], b[3], b[4], b[5]
    return robot.link_mass[n], triple(robot.link_moment[n]), inertia


@subroutine
def body_about_x(c: float, s: float, body: Body) -> Body:
    """A body turned about x."""
    return body[0], about_x(c, s, body[1]), inertia_about_x(c, s, body[2])


@subroutine
def body_about_y(c: float, s: float, body: Body) -> Body:
    """A body turned about y."""
    return body[0], about_y(c, s, body[1]), inertia_about_y(c, s, body[2])


@subroutine
def acceleration_at(a: V3, w: V3, dw: V3, p: V3) -> V3:
    """Acceleration of a body's point at p from one with acceleration a: a + dw x p + w x w x p."""
    return plus(a, plus(cross(dw, p), cross(w, cross(w, p))))


@subroutine
def wrench_on(body: Body, a: V3, w: V3, dw: V3) -> Wrench:
    """Force, and moment about its origin, that move a body so."""
    m, h, inertia = body
    force = plus(cross(dw, h), plus_scaled(cross(w, cross(w, h)), m, a))
    moment = plus(plus(times(inertia, dw), cross(w, times(inertia, w))), cross(h, a))
    return force, moment


@subroutine
def put_twice(M: Float[np.ndarray, "18 18"], i: int, k: int, value: float) -> None:
    """Put a number in its two places in the mass matrix."""
    M[i, k], M[k, i] = value, value


@subroutine
def couple_to_base(
    now: Snapshot, n: int, mass: float, base: Axes, linear: V3, angular: V3, p_hip: V3
) -> None:
    """Fill what couples a joint to the base: the robot's momentum if it alone turns at 1 rad/s.

    ``angular`` is given about the hip, along the base's axes.
    """
    velocity, angular = along(base, linear), plus(angular, cross(p_hip, linear))
    for i in range(3):
        put_twice(now.mass_matrix, i, n, linear[i])
        put_twice(now.mass_matrix, 3 + i, n, angular[i])
        now.J_com[i, n] = velocity[i] / mass


@subroutine
def turning_about_y(body: Body, p: V3) -> tuple[V3, V3, float]:
    """Momentum, linear and angular, of a body that turns about y at 1 rad/s; and its inertia.

    The angular one is about a point from which the body's joint is at ``p``.
    """
    _, h, (_, xy, _, yy, yz, _) = body
    linear = (h[2], 0.0, -h[0])
    return linear, plus((xy, yy, yz), cross(p, linear)), yy


@subroutine
def fill_foot_column(
    now: Snapshot, leg: int, column: int, radius: float, linear: V3, angular: V3
) -> None:
    """Fill a column of a foot's Jacobians."""
    J = now.J_contacts[leg]
    for i in range(3):
        now.J_feet[leg, i, column] = linear[i]
    J[0, column] = linear[0] - radius * angular[1]
    J[1, column] = linear[1] + radius * angular[0]
    J[2, column] = linear[2]


@subroutine
def place_leg(robot: RigidBodies, now: Snapshot, leg: int) -> LegBodies:
    """Where a leg's parts are: cosine and sine of the hip's angle, places, and bodies.

    The places are those of hip, thigh, calf and foot, each from the one before; but for the first
    they, and the bodies, are given along the hip's axes.
    """
    hip, thigh, knee = now.q[7 + 3 * leg], now.q[8 + 3 * leg], now.q[9 + 3 * leg]
    shin = thigh + knee
    c, s = np.cos(thigh), np.sin(thigh)
    c_shin, s_shin = np.cos(shin), np.sin(shin)
    first, joint = 1 + 3 * leg, 3 * leg
    return (
        np.cos(hip),
        np.sin(hip),
        triple(robot.p_joints[joint]),
        triple(robot.p_joints[joint + 1]),
        about_y(c, s, triple(robot.p_joints[joint + 2])),
        about_y(c_shin, s_shin, triple(robot.p_calf_feet[leg])),
        link(robot, first),
        body_about_y(c, s, link(robot, first + 1)),
        body_about_y(c_shin, s_shin, link(robot, first + 2)),
    )


@subroutine
def composite_leg(robot: RigidBodies, now: Snapshot, n: int, base: Axes, leg: LegBodies) -> Body:
    """Fill rows and columns n to n + 2, a leg's, of M and J_com; returns the stiff leg.

    A column is the momentum of all that lies beyond the joint, turning at 1 rad/s about it. The leg
    is given about its hip, along the base's axes.
    """
    c, s, p_hip, p_thigh, p_calf, _, hip, thigh, calf = leg
    M, mass, armature = now.mass_matrix, robot.mass, robot.armature[n - 6 : n - 3]
    lower = joined(thigh, calf, p_calf)
    whole = joined(hip, lower, p_thigh)
    linear, angular, yy = turning_about_y(calf, plus(p_thigh, p_calf))
    M[n + 2, n + 2] = yy + armature[2]
    put_twice(M, n + 1, n + 2, yy + p_calf[2] * linear[0] - p_calf[0] * linear[2])
    put_twice(M, n, n + 2, angular[0])
    couple_to_base(now, n + 2, mass, base, about_x(c, s, linear), about_x(c, s, angular), p_hip)
    linear, angular, yy = turning_about_y(lower, p_thigh)
    M[n + 1, n + 1] = yy + armature[1]
    put_twice(M, n, n + 1, angular[0])
    couple_to_base(now, n + 1, mass, base, about_x(c, s, linear), about_x(c, s, angular), p_hip)
    whole = body_about_x(c, s, whole)
    _, h, (xx, xy, xz, _, _, _) = whole
    M[n, n] = xx + armature[0]
    couple_to_base(now, n, mass, base, (0.0, -h[2], h[1]), (xx, xy, xz), p_hip)
    return whole


@subroutine
def newton_euler(
    robot: RigidBodies, now: Snapshot, n: int, base: Axes, acceleration: V3, leg: LegBodies
) -> Wrench:
    """Fill bias of joints n to n + 2, velocities and drifts of the foot; returns the leg's wrench.

    ``acceleration`` is that of the base's origin, with gravity, when no joint accelerates and the
    base's spatial acceleration is zero. The wrench is that on the leg, about the base's origin.
    """
    c, s, p_hip, p_thigh, p_calf, p_foot, hip, thigh, calf = leg
    v, w = triple(now.v[:3]), triple(now.v[3:6])
    hip_rate, thigh_rate, calf_rate = now.v[n], now.v[n + 1], now.v[n + 2]
    v = about_x(c, -s, plus(v, cross(w, p_hip)))
    a1 = about_x(c, -s, plus(acceleration, cross(w, cross(w, p_hip))))
    w = about_x(c, -s, w)
    dw1 = (0.0, hip_rate * w[2], -hip_rate * w[1])
    w1 = (w[0] + hip_rate, w[1], w[2])
    dw2 = (dw1[0] - thigh_rate * w1[2], dw1[1], dw1[2] + thigh_rate * w1[0])
    w2 = (w1[0], w1[1] + thigh_rate, w1[2])
    dw3 = (dw2[0] - calf_rate * w2[2], dw2[1], dw2[2] + calf_rate * w2[0])
    w3 = (w2[0], w2[1] + calf_rate, w2[2])
    a2 = acceleration_at(a1, w1, dw1, p_thigh)
    a3 = acceleration_at(a2, w2, dw2, p_calf)
    f3, m3 = wrench_on(calf, a3, w3, dw3)
    f2, m2 = wrench_on(thigh, a2, w2, dw2)
    f1, m1 = wrench_on(hip, a1, w1, dw1)
    m2, f2 = plus(plus(m2, m3), cross(p_calf, f3)), plus(f2, f3)
    m1, f1 = plus(plus(m1, m2), cross(p_thigh, f2)), plus(f1, f2)
    now.bias[n], now.bias[n + 1], now.bias[n + 2] = m1[0], m2[1], m3[1]
    v = plus(plus(v, cross(w1, p_thigh)), plus(cross(w2, p_calf), cross(w3, p_foot)))
    axes = hip_axes(base, c, s)
    a = acceleration_at(a3, w3, dw3, p_foot)
    motion = along(axes, v), along(axes, w3), along(axes, a), along(axes, dw3)
    fill_foot_motion(robot, now, n // 3 - 2, motion)
    f1 = about_x(c, s, f1)
    return f1, plus(about_x(c, s, m1), cross(p_hip, f1))


@subroutine
def hip_axes(base: Axes, c: float, s: float) -> Axes:
    """The axes of a hip from those of the base."""
    x, y, z = base
    return (
        x,
        (c * y[0] + s * z[0], c * y[1] + s * z[1], c * y[2] + s * z[2]),
        (c * z[0] - s * y[0], c * z[1] - s * y[1], c * z[2] - s * y[2]),
    )


@subroutine
def fill_foot_motion(
    robot: RigidBodies, now: Snapshot, leg: int, motion: tuple[V3, V3, V3, V3]
) -> None:
    """Fill velocities and drifts of a foot's centre and its contact."""
    v, w, a, dw = motion
    radius, a = robot.foot_radius, (a[0], a[1], a[2] - robot.gravity)
    put(v, now.v_world_feet[leg])
    put((v[0] - radius * w[1], v[1] + radius * w[0], v[2]), now.v_world_contacts[leg])
    put(a, now.drift_feet[leg])
    put((a[0] - radius * dw[1], a[1] + radius * dw[0], a[2]), now.drift_contacts[leg])


@subroutine
def fill_foot(
    robot: RigidBodies, now: Snapshot, leg_index: int, base: Axes, leg: LegBodies
) -> None:
    """Fill the place of a foot's centre, its Jacobian and that of its contact."""
    c, s, p_hip, p_thigh, p_calf, p_foot, _, _, _ = leg
    radius, n = robot.foot_radius, 6 + 3 * leg_index
    axes = hip_axes(base, c, s)
    p_calf = plus(p_calf, p_foot)  # from the axes of thigh and of hip to the foot
    p_thigh = plus(p_thigh, p_calf)
    x, y, z = plus(p_hip, about_x(c, s, p_thigh))
    put(plus(triple(now.q[:3]), along(base, (x, y, z))), now.p_world_feet[leg_index])
    for k in range(3):
        fill_foot_column(now, leg_index, k, radius, base[k], _ZERO)
    fill_foot_column(now, leg_index, 3, radius, along(base, (0.0, -z, y)), base[0])
    fill_foot_column(now, leg_index, 4, radius, along(base, (z, 0.0, -x)), base[1])
    fill_foot_column(now, leg_index, 5, radius, along(base, (-y, x, 0.0)), base[2])
    turned = along(axes, (0.0, -p_thigh[2], p_thigh[1]))
    fill_foot_column(now, leg_index, n, radius, turned, axes[0])
    turned = along(axes, (p_calf[2], 0.0, -p_calf[0]))
    fill_foot_column(now, leg_index, n + 1, radius, turned, axes[1])
    turned = along(axes, (p_foot[2], 0.0, -p_foot[0]))
    fill_foot_column(now, leg_index, n + 2, radius, turned, axes[1])


@subroutine
def fill_base(
    robot: RigidBodies, now: Snapshot, base: Axes, whole: Body, force: V3, moment: V3
) -> None:
    """Fill the base's part of M and h, and what is left of the CoM: the robot's momentum."""
    (m, h, (xx, xy, xz, yy, yz, zz)), (x, y, z), mass = whole, whole[1], robot.mass
    M = now.mass_matrix
    columns = (0.0, -z, y), (z, 0.0, -x), (-y, x, 0.0)
    for k in range(3):
        M[k, k] = m
        velocity, turning = base[k], along(base, columns[k])
        for i in range(3):
            put_twice(M, i, 3 + k, columns[k][i])
            now.J_com[i, k] = velocity[i] * m / mass
            now.J_com[i, 3 + k] = turning[i] / mass
    put_twice(M, 3, 4, xy)
    put_twice(M, 3, 5, xz)
    put_twice(M, 4, 5, yz)
    M[3, 3], M[4, 4], M[5, 5] = xx, yy, zz
    put(force, now.bias[:3])
    put(moment, now.bias[3:6])
    x, y, z = along(base, force)
    put((x / mass, y / mass, z / mass - robot.gravity), now.drift_com)
    put(plus_scaled(triple(now.q[:3]), 1.0 / mass, along(base, h)), now.p_world_com)
    for i in range(3):
        velocity = 0.0
        for k in range(18):
            velocity += now.J_com[i, k] * now.v[k]
        now.v_world_com[i] = velocity


@subroutine
def fill_payload(robot: RigidBodies, now: Snapshot, base: Axes, moment: V3) -> None:
    """Fill what is carried, and by how much it moves the CoM.

    ``moment`` is the first moment of the robot with the payload.
    """
    carried, mass = robot.payload.mass, robot.mass
    now.payload[0], now.payload[1] = carried, carried * robot.gravity
    if carried == 0.0:
        return
    x, y, z = robot.payload.place
    own = plus_scaled(moment, -carried, (x, y, z))
    factor = -mass / (mass - carried)
    shift = along(base, plus_scaled(moment, factor, own))
    put((shift[0] / mass, shift[1] / mass, shift[2] / mass), now.com_shift)


@kernel
def fill_snapshot(
    q: Foreign[Array19], v: Foreign[Array18], robot: RigidBodies, now: Snapshot
) -> None:
    """Fill a snapshot, from the measured q and v, for ``robot``."""
    now.q[:], now.v[:], now.foot_radius = q, v, robot.foot_radius
    now.mass_matrix[:], now.J_feet[:], now.J_contacts[:], now.com_shift[:] = 0.0, 0.0, 0.0, 0.0
    R = now.R_world_base
    rotation_of(q[3], q[4], q[5], q[6], R)
    base = ((R[0, 0], R[1, 0], R[2, 0]), (R[0, 1], R[1, 1], R[2, 1]), (R[0, 2], R[1, 2], R[2, 2]))
    gravity, w = robot.gravity, triple(now.v[3:6])
    up = gravity * R[2, 0], gravity * R[2, 1], gravity * R[2, 2]
    acceleration = plus(up, cross(w, triple(now.v[:3])))
    whole = link(robot, 0)
    force, moment = wrench_on(whole, acceleration, w, _ZERO)
    for n in range(4):
        leg, first = place_leg(robot, now, n), 6 + 3 * n
        whole = joined(whole, composite_leg(robot, now, first, base, leg), leg[2])
        f, m = newton_euler(robot, now, first, base, acceleration, leg)
        force, moment = plus(force, f), plus(moment, m)
        fill_foot(robot, now, n, base, leg)
    fill_base(robot, now, base, whole, force, moment)
    fill_payload(robot, now, base, whole[1])
