"""Legs and trunk of many configurations in one call: angles, centres of mass, places of the trunk.

``robot.leg_kinematics`` describes the legs and their closed-form inverse kinematics,
``motions.trajectory`` how the trunk is put where its centre of mass is wanted. A row of ``legs`` is
``LegGeometry.row``, one of ``links`` is what ``link_table`` says.
"""

from __future__ import annotations

import numpy as np

from go2_wbc.kernels.compilation import kernel, subroutine


@kernel("void(f8[:,::1], f8[:,:,::1])", nogil=True)
def rotations(rpy, R):
    """Fill R = Rz(yaw) Ry(pitch) Rx(roll) of every row."""
    for i in range(len(rpy)):
        sr, sp, sy = np.sin(rpy[i, 0]), np.sin(rpy[i, 1]), np.sin(rpy[i, 2])
        cr, cp, cy = np.cos(rpy[i, 0]), np.cos(rpy[i, 1]), np.cos(rpy[i, 2])
        R[i, 0, 0], R[i, 0, 1], R[i, 0, 2] = cy * cp, cy * sp * sr - sy * cr, cy * sp * cr + sy * sr
        R[i, 1, 0], R[i, 1, 1], R[i, 1, 2] = sy * cp, sy * sp * sr + cy * cr, sy * sp * cr - cy * sr
        R[i, 2, 0], R[i, 2, 1], R[i, 2, 2] = -sp, cp * sr, cp * cr


@kernel("void(f8[:,::1], f8[:,::1])", nogil=True)
def quaternions(rpy, xyzw):
    """Fill the quaternions x y z w of the same rotations."""
    for i in range(len(rpy)):
        r, p, y = 0.5 * rpy[i, 0], 0.5 * rpy[i, 1], 0.5 * rpy[i, 2]
        sr, sp, sy = np.sin(r), np.sin(p), np.sin(y)
        cr, cp, cy = np.cos(r), np.cos(p), np.cos(y)
        xyzw[i, 0] = cy * cp * sr - sy * sp * cr
        xyzw[i, 1] = cy * sp * cr + sy * cp * sr
        xyzw[i, 2] = sy * cp * cr - cy * sp * sr
        xyzw[i, 3] = cy * cp * cr + sy * sp * sr


@subroutine("f8(f8)")
def wrapped(angle):
    """An angle between -2 pi and 2 pi, brought between -pi and pi."""
    if angle > np.pi:
        return angle - 2.0 * np.pi
    if angle < -np.pi:
        return angle + 2.0 * np.pi
    return angle


@subroutine("f8(f8[::1], f8, f8, f8, f8[::1])")
def solve_leg(leg, x, y, z, q):
    """Fill the three angles that bring a foot to a place in the base frame; returns the miss."""
    x, y, z = x - leg[0], y - leg[1], z - leg[2]
    width, thigh, calf = leg[3], leg[4], leg[5]
    across = y * y + z * z - width * width
    down = 0.0 if across < 0.0 else np.sqrt(across)
    if z > 0.0:
        down = -down
    reach = np.hypot(x, down)
    cosine = (reach * reach - thigh * thigh - calf * calf) / (2.0 * thigh * calf)
    if cosine > 1.0:
        cosine = 1.0
    elif cosine < -1.0:
        cosine = -1.0
    knee = -np.arccos(cosine)
    swing = np.arctan2(-x, down)
    swing -= np.arctan2(calf * np.sin(knee), thigh + calf * np.cos(knee))
    q[0] = wrapped(np.arctan2(z, y) + np.arctan2(down, width))
    q[1] = wrapped(swing)
    q[2] = knee
    near = max(abs(width) - np.hypot(y, z), 0.0)
    far = max(reach - thigh - calf, abs(thigh - calf) - reach)
    return near if far <= 0.0 else np.hypot(near, far)


@kernel("void(f8[::1], f8[:,::1], f8[:,::1], f8[::1])", nogil=True)
def solve_legs(leg, places, q, miss):
    """Fill angles and misses for foot centres in the base frame."""
    for i in range(len(places)):
        miss[i] = solve_leg(leg, places[i, 0], places[i, 1], places[i, 2], q[i])


@subroutine("void(f8[::1], f8[::1])")
def turns_of(q, turns):
    """Fill cosine and sine of the hip, of the thigh, and of thigh and calf together."""
    turns[0], turns[1] = np.cos(q[0]), np.sin(q[0])
    turns[2], turns[3] = np.cos(q[1]), np.sin(q[1])
    turns[4], turns[5] = np.cos(q[1] + q[2]), np.sin(q[1] + q[2])


@subroutine("void(f8[::1], f8, f8, f8, f8[::1])")
def turns_to(leg, x, y, z, turns):
    """The same of the angles that ``solve_leg`` finds, without the angles: no more than roots."""
    x, y, z = x - leg[0], y - leg[1], z - leg[2]
    width, thigh, calf = leg[3], leg[4], leg[5]
    square = y * y + z * z
    across = square - width * width
    down = 0.0 if across < 0.0 else np.sqrt(across)
    if z > 0.0:
        down = -down
    if square == 0.0:
        y, square = 1.0, 1.0
    length = np.sqrt(square * (width * width + down * down))
    turns[0], turns[1] = (y * width - z * down) / length, (z * width + y * down) / length
    reach = np.sqrt(x * x + down * down)
    cosine = (reach * reach - thigh * thigh - calf * calf) / (2.0 * thigh * calf)
    if cosine > 1.0:
        cosine = 1.0
    elif cosine < -1.0:
        cosine = -1.0
    sine = -np.sqrt(1.0 - cosine * cosine)
    if reach == 0.0:
        down, reach = 1.0, 1.0
    a, b = thigh + calf * cosine, calf * sine
    length = reach * np.sqrt(a * a + b * b)
    if length == 0.0:
        a, b, length = 0.0, -1.0, reach
    ct, st = (down * a - x * b) / length, (-x * a - down * b) / length
    turns[2], turns[3] = ct, st
    turns[4], turns[5] = ct * cosine - st * sine, st * cosine + ct * sine


@subroutine("void(f8[:,::1], i8, f8[::1], f8[::1])")
def weigh_leg(links, leg, turns, moment):
    """Fill what a leg adds to the CoM in the base frame: its links' places by their shares.

    With x, y, y the axes of hip, thigh and calf, o_k the places of the joints on the links before
    them, c_k and s_k the links' centres and shares of the mass:

        (s1 + s2 + s3) o1
        + Rx(q1) (s1 c1 + s2 (o2 + Ry(q2) c2) + s3 (o2 + Ry(q2) o3 + Ry(q2 + q3) c3))
    """
    n = 1 + 3 * leg
    s1, s2, s3 = links[n, 0], links[n + 1, 0], links[n + 2, 0]
    c1, c2, c3 = links[n, 1:4], links[n + 1, 1:4], links[n + 2, 1:4]
    o1, o2, o3 = links[n, 4:7], links[n + 1, 4:7], links[n + 2, 4:7]
    ch, sh, ct, st, ck, sk = turns[0], turns[1], turns[2], turns[3], turns[4], turns[5]
    a0, a1, a2 = s2 * c2[0] + s3 * o3[0], s2 * c2[1] + s3 * o3[1], s2 * c2[2] + s3 * o3[2]
    b0, b1, b2 = s3 * c3[0], s3 * c3[1], s3 * c3[2]
    x = s1 * c1[0] + (s2 + s3) * o2[0] + ct * a0 + st * a2 + ck * b0 + sk * b2
    y = s1 * c1[1] + (s2 + s3) * o2[1] + a1 + b1
    z = s1 * c1[2] + (s2 + s3) * o2[2] - st * a0 + ct * a2 - sk * b0 + ck * b2
    whole = s1 + s2 + s3
    moment[0] = whole * o1[0] + x
    moment[1] = whole * o1[1] + ch * y - sh * z
    moment[2] = whole * o1[2] + sh * y + ch * z


@subroutine("void(f8[:,::1], f8[:,::1], f8[:,::1], f8[::1], f8[::1])")
def add_up(links, moments, R, p, com):
    """Fill the CoM in the world from the four legs' moments, at R and p of the base."""
    x, y, z = links[0, 0] * links[0, 1], links[0, 0] * links[0, 2], links[0, 0] * links[0, 3]
    for leg in range(4):
        x, y, z = x + moments[leg, 0], y + moments[leg, 1], z + moments[leg, 2]
    for i in range(3):
        com[i] = p[i] + R[i, 0] * x + R[i, 1] * y + R[i, 2] * z


@kernel("void(f8[:,::1], f8[:,::1], f8[:,:,::1], f8[:,::1], f8[:,::1])", nogil=True)
def centres_of_mass(links, p, R, joints, com):
    """Fill the CoM in the world of every configuration."""
    moments, turns = np.empty((4, 3)), np.empty(6)
    for i in range(len(p)):
        for leg in range(4):
            turns_of(joints[i, 3 * leg : 3 * leg + 3], turns)
            weigh_leg(links, leg, turns, moments[leg])
        add_up(links, moments, R[i], p[i], com[i])


@subroutine("void(f8[:,::1], f8[::1], f8[::1], f8[::1])")
def see_foot(R, p, p_foot, seen):
    """Fill a place of the world as the base at R and p sees it."""
    d0, d1, d2 = p_foot[0] - p[0], p_foot[1] - p[1], p_foot[2] - p[2]
    for k in range(3):
        seen[k] = R[0, k] * d0 + R[1, k] * d1 + R[2, k] * d2


@kernel(
    "void(f8[:,::1], b1[::1], b1[:,::1], f8[:,:,::1], f8[:,:,::1], f8[:,::1], f8[:,::1], i8, "
    "f8[:,::1], f8[:,::1], f8[:,::1], f8[:,::1])",
    nogil=True,
)
def settle(wanted, is_com, raised, R, p_feet, legs, links, steps, p, joints, miss, com):
    """Put every trunk where its CoM, or its base, is wanted, with standing feet in their places.

    ``p`` starts at the base's place and ends there, ``joints`` of raised legs stay; the others,
    ``miss`` and ``com`` are filled. In every step but the last, p <- p + (c* - c(p)).
    """
    moments, turns, foot = np.empty((4, 3)), np.empty(6), np.empty(3)
    for i in range(len(wanted)):
        for leg in range(4):
            if raised[i, leg]:
                miss[i, leg] = 0.0
                turns_of(joints[i, 3 * leg : 3 * leg + 3], turns)
                weigh_leg(links, leg, turns, moments[leg])
        for step in range(steps + 1):
            for leg in range(4):
                if raised[i, leg]:
                    continue
                see_foot(R[i], p[i], p_feet[i, leg], foot)
                if step == steps:
                    angles = joints[i, 3 * leg : 3 * leg + 3]
                    miss[i, leg] = solve_leg(legs[leg], foot[0], foot[1], foot[2], angles)
                turns_to(legs[leg], foot[0], foot[1], foot[2], turns)
                weigh_leg(links, leg, turns, moments[leg])
            add_up(links, moments, R[i], p[i], com[i])
            if step < steps and is_com[i]:
                for k in range(3):
                    p[i, k] += wanted[i, k] - com[i, k]
