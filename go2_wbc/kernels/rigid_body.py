"""Every quantity of a snapshot from q and v in one pass, as one kernel.

``robot.snapshot`` says what each quantity is; ``RobotModel.readable_snapshot`` computes the same
with Pinocchio's own functions, for any robot. This one knows its robot: a trunk with four legs of
three joints, which turn about x, y and y. Mass matrix: composite rigid bodies; bias: Newton and
Euler (Featherstone, *Rigid Body Dynamics Algorithms*, 2008, sec. 6.2 and 5.3). A leg is computed
along the axes of its hip, which the hip's angle turns about x from the base's: thigh and calf turn
about y of these axes, so that few rotations are left.

A body is its mass, its first moment h = m c and its inertia I = (xx, xy, xz, yy, yz, zz), both
about the origin of its joint.
"""

from __future__ import annotations

import numpy as np

from go2_wbc.algebra.vectors import about_x, about_y, along, cross, plus, plus_scaled, rotation_of
from go2_wbc.kernels.compilation import kernel, subroutine
from go2_wbc.kernels.layout import ROBOT, SNAPSHOT
from go2_wbc.kernels.vectors import AXES, V3, put, vector

_R, _M, _H = (SNAPSHOT.start[n] for n in ("R_world_base", "mass_matrix", "bias"))
_P_COM, _V_COM, _J_COM, _DRIFT_COM = (
    SNAPSHOT.start[n] for n in ("p_world_com", "v_world_com", "J_com", "drift_com")
)
_P_FEET, _V_FEET, _J_FEET, _DRIFT_FEET = (
    SNAPSHOT.start[n] for n in ("p_world_feet", "v_world_feet", "J_feet", "drift_feet")
)
_J_CONTACTS, _DRIFT_CONTACTS, _V_CONTACTS = (
    SNAPSHOT.start[n] for n in ("J_contacts", "drift_contacts", "v_world_contacts")
)
_MASS, _GRAVITY, _RADIUS, _ARMATURE = (
    ROBOT.start[n] for n in ("mass", "gravity", "foot_radius", "armature")
)
_LINKS, _JOINTS, _FEET = (ROBOT.start[n] for n in ("links", "p_joints", "p_calf_feet"))
_PAYLOAD, _SHIFT = (SNAPSHOT.start[n] for n in ("payload", "com_shift"))
_CARRIED = ROBOT.start["payload"]

_I6 = "UniTuple(f8, 6)"
_BODY = f"Tuple((f8, {V3}, {_I6}))"
_LEG = f"Tuple((f8, f8, {V3}, {V3}, {V3}, {V3}, {_BODY}, {_BODY}, {_BODY}))"
_WRENCH = f"Tuple(({V3}, {V3}))"
_ZERO = (0.0, 0.0, 0.0)


@subroutine(f"{V3}({_I6}, {V3})")
def times(inertia, a):
    """Inertia times a vector."""
    xx, xy, xz, yy, yz, zz = inertia
    x, y, z = a
    return xx * x + xy * y + xz * z, xy * x + yy * y + yz * z, xz * x + yz * y + zz * z


@subroutine(f"{_I6}(f8, f8, {_I6})")
def inertia_about_x(c, s, inertia):
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


@subroutine(f"{_I6}(f8, f8, {_I6})")
def inertia_about_y(c, s, inertia):
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


@subroutine(f"{_BODY}({_BODY}, {_BODY}, {V3})")
def joined(a, b, d):
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


@subroutine(f"{_BODY}(f8[::1], i8)")
def link(robot, n):
    """Link n along its own axes."""
    b = robot[_LINKS + 10 * n : _LINKS + 10 * n + 10]
    return b[0], (b[1], b[2], b[3]), (b[4], b[5], b[6], b[7], b[8], b[9])


@subroutine(f"{_BODY}(f8, f8, {_BODY})")
def body_about_x(c, s, body):
    """A body turned about x."""
    return body[0], about_x(c, s, body[1]), inertia_about_x(c, s, body[2])


@subroutine(f"{_BODY}(f8, f8, {_BODY})")
def body_about_y(c, s, body):
    """A body turned about y."""
    return body[0], about_y(c, s, body[1]), inertia_about_y(c, s, body[2])


@subroutine(f"{V3}({V3}, {V3}, {V3}, {V3})")
def acceleration_at(a, w, dw, p):
    """Acceleration of a body's point at p from one with acceleration a: a + dw x p + w x w x p."""
    return plus(a, plus(cross(dw, p), cross(w, cross(w, p))))


@subroutine(f"{_WRENCH}({_BODY}, {V3}, {V3}, {V3})")
def wrench_on(body, a, w, dw):
    """Force, and moment about its origin, that move a body so."""
    m, h, inertia = body
    force = plus(cross(dw, h), plus_scaled(cross(w, cross(w, h)), m, a))
    moment = plus(plus(times(inertia, dw), cross(w, times(inertia, w))), cross(h, a))
    return force, moment


@subroutine("void(f8[::1], i8, i8, f8)")
def put_twice(row, i, k, value):
    """Put a number in its two places in the mass matrix."""
    row[_M + 18 * i + k], row[_M + 18 * k + i] = value, value


@subroutine(f"void(f8[::1], i8, f8, {AXES}, {V3}, {V3})")
def couple(row, n, mass, base, linear, angular):
    """Fill what couples a joint to the base: the robot's momentum if it alone turns at 1 rad/s."""
    velocity = along(base, linear)
    for i in range(3):
        put_twice(row, i, n, linear[i])
        put_twice(row, 3 + i, n, angular[i])
        row[_J_COM + 18 * i + n] = velocity[i] / mass


@subroutine(f"void(f8[::1], i8, f8, {V3}, {V3})")
def fill_foot_column(row, place, radius, linear, angular):
    """Fill a column of a foot's Jacobians; ``place`` is that of its first number."""
    for i in range(3):
        row[_J_FEET + place + 18 * i] = linear[i]
    row[_J_CONTACTS + place] = linear[0] - radius * angular[1]
    row[_J_CONTACTS + place + 18] = linear[1] + radius * angular[0]
    row[_J_CONTACTS + place + 36] = linear[2]


@subroutine(f"{_LEG}(f8[::1], f8[::1], i8)")
def place_leg(robot, row, leg):
    """Where a leg's parts are: cosine and sine of the hip's angle, places, and bodies.

    The places are those of hip, thigh, calf and foot, each from the one before; but for the first
    they, and the bodies, are given along the hip's axes.
    """
    hip, thigh, knee = vector(row, 7 + 3 * leg)
    shin = thigh + knee
    c, s = np.cos(thigh), np.sin(thigh)
    c_shin, s_shin = np.cos(shin), np.sin(shin)
    first, joints = 1 + 3 * leg, _JOINTS + 9 * leg
    return (
        np.cos(hip),
        np.sin(hip),
        vector(robot, joints),
        vector(robot, joints + 3),
        about_y(c, s, vector(robot, joints + 6)),
        about_y(c_shin, s_shin, vector(robot, _FEET + 3 * leg)),
        link(robot, first),
        body_about_y(c, s, link(robot, first + 1)),
        body_about_y(c_shin, s_shin, link(robot, first + 2)),
    )


@subroutine(f"{_BODY}(f8[::1], f8[::1], i8, {AXES}, {_LEG})")
def compose(robot, row, n, base, leg):
    """Fill rows and columns n to n + 2, a leg's, of M and J_com; returns the stiff leg.

    A column is the momentum of all that lies beyond the joint, turning at 1 rad/s about it. The leg
    is given about its hip, along the base's axes.
    """
    c, s, p_hip, p_thigh, p_calf, _, hip, thigh, calf = leg
    mass, armature = robot[_MASS], _ARMATURE + n - 6
    lower = joined(thigh, calf, p_calf)
    whole = joined(hip, lower, p_thigh)
    _, h, (_, xy, _, yy, yz, _) = calf
    linear = (h[2], 0.0, -h[0])
    angular = plus((xy, yy, yz), cross(plus(p_thigh, p_calf), linear))
    row[_M + 19 * n + 38] = yy + robot[armature + 2]
    put_twice(row, n + 1, n + 2, yy + p_calf[2] * linear[0] - p_calf[0] * linear[2])
    put_twice(row, n, n + 2, angular[0])
    linear = about_x(c, s, linear)
    angular = plus(about_x(c, s, angular), cross(p_hip, linear))
    couple(row, n + 2, mass, base, linear, angular)
    _, h, (_, xy, _, yy, yz, _) = lower
    linear = (h[2], 0.0, -h[0])
    angular = plus((xy, yy, yz), cross(p_thigh, linear))
    row[_M + 19 * n + 19] = yy + robot[armature + 1]
    put_twice(row, n, n + 1, angular[0])
    linear = about_x(c, s, linear)
    angular = plus(about_x(c, s, angular), cross(p_hip, linear))
    couple(row, n + 1, mass, base, linear, angular)
    whole = body_about_x(c, s, whole)
    _, h, (xx, xy, xz, _, _, _) = whole
    row[_M + 19 * n] = xx + robot[armature]
    linear = (0.0, -h[2], h[1])
    angular = plus((xx, xy, xz), cross(p_hip, linear))
    couple(row, n, mass, base, linear, angular)
    return whole


@subroutine(f"{_WRENCH}(f8[::1], f8[::1], i8, {AXES}, {V3}, {_LEG})")
def move(robot, row, n, base, acceleration, leg):
    """Fill bias of joints n to n + 2, velocities and drifts of the foot; returns the leg's wrench.

    ``acceleration`` is that of the base's origin, with gravity, when no joint accelerates and the
    base's spatial acceleration is zero. The wrench is that on the leg, about the base's origin.
    """
    c, s, p_hip, p_thigh, p_calf, p_foot, hip, thigh, calf = leg
    v, w, (hip_rate, thigh_rate, calf_rate) = vector(row, 19), vector(row, 22), vector(row, 19 + n)
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
    put(row, _H + n, (m1[0], m2[1], m3[1]))
    v = plus(plus(v, cross(w1, p_thigh)), plus(cross(w2, p_calf), cross(w3, p_foot)))
    axes = hip_axes(base, c, s)
    a = acceleration_at(a3, w3, dw3, p_foot)
    roll(robot, row, n - 6, (along(axes, v), along(axes, w3), along(axes, a), along(axes, dw3)))
    f1 = about_x(c, s, f1)
    return f1, plus(about_x(c, s, m1), cross(p_hip, f1))


@subroutine(f"{AXES}({AXES}, f8, f8)")
def hip_axes(base, c, s):
    """The axes of a hip from those of the base."""
    x, y, z = base
    return (
        x,
        (c * y[0] + s * z[0], c * y[1] + s * z[1], c * y[2] + s * z[2]),
        (c * z[0] - s * y[0], c * z[1] - s * y[1], c * z[2] - s * y[2]),
    )


@subroutine(f"void(f8[::1], f8[::1], i8, UniTuple({V3}, 4))")
def roll(robot, row, n, motion):
    """Fill velocities and drifts of a foot's centre and its contact; n: its first joint."""
    v, w, a, dw = motion
    radius, a = robot[_RADIUS], (a[0], a[1], a[2] - robot[_GRAVITY])
    put(row, _V_FEET + n, v)
    put(row, _V_CONTACTS + n, (v[0] - radius * w[1], v[1] + radius * w[0], v[2]))
    put(row, _DRIFT_FEET + n, a)
    put(row, _DRIFT_CONTACTS + n, (a[0] - radius * dw[1], a[1] + radius * dw[0], a[2]))


@subroutine(f"void(f8[::1], f8[::1], i8, {AXES}, {_LEG})")
def fill_foot(robot, row, leg_index, base, leg):
    """Fill the place of a foot's centre, its Jacobian and that of its contact."""
    c, s, p_hip, p_thigh, p_calf, p_foot, _, _, _ = leg
    radius, place = robot[_RADIUS], 54 * leg_index
    axes = hip_axes(base, c, s)
    p_calf = plus(p_calf, p_foot)  # from the axes of thigh and of hip to the foot
    p_thigh = plus(p_thigh, p_calf)
    x, y, z = plus(p_hip, about_x(c, s, p_thigh))
    put(row, _P_FEET + 3 * leg_index, plus(vector(row, 0), along(base, (x, y, z))))
    for k in range(3):
        fill_foot_column(row, place + k, radius, base[k], _ZERO)
    fill_foot_column(row, place + 3, radius, along(base, (0.0, -z, y)), base[0])
    fill_foot_column(row, place + 4, radius, along(base, (z, 0.0, -x)), base[1])
    fill_foot_column(row, place + 5, radius, along(base, (-y, x, 0.0)), base[2])
    place += 6 + 3 * leg_index
    turned = along(axes, (0.0, -p_thigh[2], p_thigh[1]))
    fill_foot_column(row, place, radius, turned, axes[0])
    turned = along(axes, (p_calf[2], 0.0, -p_calf[0]))
    fill_foot_column(row, place + 1, radius, turned, axes[1])
    turned = along(axes, (p_foot[2], 0.0, -p_foot[0]))
    fill_foot_column(row, place + 2, radius, turned, axes[1])


@subroutine(f"void(f8[::1], f8[::1], {AXES}, {_BODY}, {V3}, {V3})")
def fill_base(robot, row, base, whole, force, moment):
    """Fill the base's part of M and h, and what is left of the CoM: the robot's momentum."""
    (m, h, (xx, xy, xz, yy, yz, zz)), (x, y, z), mass = whole, whole[1], robot[_MASS]
    columns = (0.0, -z, y), (z, 0.0, -x), (-y, x, 0.0)
    for k in range(3):
        row[_M + 19 * k] = m
        velocity, turning = base[k], along(base, columns[k])
        for i in range(3):
            put_twice(row, i, 3 + k, columns[k][i])
            row[_J_COM + 18 * i + k] = velocity[i] * m / mass
            row[_J_COM + 18 * i + 3 + k] = turning[i] / mass
    put_twice(row, 3, 4, xy)
    put_twice(row, 3, 5, xz)
    put_twice(row, 4, 5, yz)
    row[_M + 57], row[_M + 76], row[_M + 95] = xx, yy, zz
    put(row, _H, force)
    put(row, _H + 3, moment)
    x, y, z = along(base, force)
    put(row, _DRIFT_COM, (x / mass, y / mass, z / mass - robot[_GRAVITY]))
    put(row, _P_COM, plus_scaled(vector(row, 0), 1.0 / mass, along(base, h)))
    for i in range(3):
        velocity = 0.0
        for k in range(18):
            velocity += row[_J_COM + 18 * i + k] * row[19 + k]
        row[_V_COM + i] = velocity


@subroutine(f"void(f8[::1], f8[::1], {AXES}, {V3})")
def fill_payload(robot, row, base, moment):
    """Fill what is carried, and by how much it moves the CoM.

    ``moment`` is the first moment of the robot with the payload.
    """
    carried, mass = robot[_CARRIED], robot[_MASS]
    row[_PAYLOAD], row[_PAYLOAD + 1] = carried, carried * robot[_GRAVITY]
    if carried == 0.0:
        return
    own = plus_scaled(moment, -carried, vector(robot, _CARRIED + 1))
    factor = -mass / (mass - carried)
    shift = along(base, plus_scaled(moment, factor, own))
    put(row, _SHIFT, (shift[0] / mass, shift[1] / mass, shift[2] / mass))


_MEASURED = "Array(f8, 1, 'A', readonly=True)"


@kernel(f"void({_MEASURED}, {_MEASURED}, f8[::1], f8[::1])")
def fill_snapshot(q, v, robot, row):
    """Fill the row of a snapshot, which begins with the measured q and v."""
    for i in range(19):
        row[i] = q[i]
    for i in range(18):
        row[19 + i] = v[i]
    row[_R:] = 0.0
    R = row[_R : _R + 9].reshape(3, 3)
    rotation_of(row[3], row[4], row[5], row[6], R)
    x, y, z = R[:, 0], R[:, 1], R[:, 2]
    base = (x[0], x[1], x[2]), (y[0], y[1], y[2]), (z[0], z[1], z[2])
    gravity, w = robot[_GRAVITY], vector(row, 22)
    up = gravity * R[2, 0], gravity * R[2, 1], gravity * R[2, 2]
    acceleration = plus(up, cross(w, vector(row, 19)))
    whole = link(robot, 0)
    force, moment = wrench_on(whole, acceleration, w, _ZERO)
    for n in range(4):
        leg, first = place_leg(robot, row, n), 6 + 3 * n
        whole = joined(whole, compose(robot, row, first, base, leg), leg[2])
        f, m = move(robot, row, first, base, acceleration, leg)
        force, moment = plus(force, f), plus(moment, m)
        fill_foot(robot, row, n, base, leg)
    fill_base(robot, row, base, whole, force, moment)
    fill_payload(robot, row, base, whole[1])
