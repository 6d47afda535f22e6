"""Closed-form inverse kinematics of the four legs, for whole trajectories at once.

A leg is a hip that turns about x, and a thigh and a calf that turn about y, at a distance from the
plane of the hip's axis; see Spong, Hutchinson & Vidyasagar (2006, sec. 3.3.3) for the same arm
upside down. Two branches exist for the side on which the foot lies: below the hip's axis, as in
standing, or above it, as for a raised paw. The knee always points backwards, as the limits demand.

With the angles q1, q2, q3 (hip, thigh, calf), lengths w, l2, l3, and (x, y, z) from the hip's axis
to the foot's centre in the base frame (x ahead, y left, z up):

    down = l2 cos q2 + l3 cos(q2 + q3)           from the thigh's axis, along the leg's plane
    x = -l2 sin q2 - l3 sin(q2 + q3)
    y = w cos q1 + down sin q1
    z = w sin q1 - down cos q1

Seen along x, y^2 + z^2 = w^2 + down^2 gives down; (y, z) is (w, -down) turned by q1. In the leg's
plane, the law of cosines on l2, l3 and the reach sqrt(x^2 + down^2) gives q3, and then q2.

The CoM of a configuration is the sum of its links' places by their shares of the mass
(``weigh_leg``); with feet that stand and an attitude that is given it is a function of the base's
place alone, which ``settle`` solves.
"""

from __future__ import annotations

from dataclasses import dataclass
from weakref import WeakKeyDictionary

import numpy as np
from jaxtyping import Bool, Float

from go2_wbc.algebra.linear import turned_back
from go2_wbc.compilation import kernel, subroutine
from go2_wbc.errors import DescriptionError
from go2_wbc.legs import JOINT_NAMES, LEGS, Leg
from go2_wbc.records import (
    Array3,
    Array3x3,
    Array4x3,
    Array6,
    ArrayNx3,
    ArrayNx3x3,
    ArrayNx12,
    Record,
    packed,
)
from go2_wbc.robot.model import LEG_AXES, RobotModel


@dataclass(frozen=True, slots=True)
class LegGeometry:
    """Lengths of a leg."""

    p_base_hip: Array3  #: origin of the hip's axis in the base frame [m]
    width: float  #: distance [m] from the hip's axis to the plane of the leg, positive to the left
    thigh: float  #: from the thigh's axis to the knee [m]
    calf: float  #: and from there to the foot's centre [m]

    @staticmethod
    def of(model: RobotModel, leg: Leg) -> LegGeometry:
        """The lengths of ``leg``, read from the robot's description, packed."""
        known = _KNOWN.setdefault(model, {})
        if leg not in known:
            known[leg] = LegGeometry._read(model, leg)
        return known[leg]

    @staticmethod
    def _read(model: RobotModel, leg: Leg) -> LegGeometry:
        pin_model = model.pin_model
        joints = [pin_model.getJointId(name) for name in JOINT_NAMES[leg.joints]]
        hip, thigh, calf = (pin_model.jointPlacements[joint].translation for joint in joints)
        foot = pin_model.frames[pin_model.getFrameId(leg.foot)].placement.translation
        lengths = float(thigh[1]), float(-calf[2]), float(-foot[2])
        return packed(LegGeometry(np.array(hip), *lengths))


class Legs(Record):
    """The four legs: ``legs.geometry[leg]``."""

    geometry: tuple[LegGeometry, LegGeometry, LegGeometry, LegGeometry]


class Links(Record):
    """Trunk, then hip, thigh and calf of each leg."""

    share: Float[np.ndarray, "13"]  #: of the robot's mass
    p_com: Float[np.ndarray, "13 3"]  #: CoM [m] in the frame of the link's joint
    p_joint: Float[np.ndarray, "13 3"]
    """Place of that joint [m] in the frame of the link before; the trunk's is its own."""


def leg_table(model: RobotModel) -> Legs:
    """The geometry of each leg."""
    return Legs(geometry=[LegGeometry.of(model, leg) for leg in LEGS])


def link_table(model: RobotModel) -> Links:
    """What the CoM depends on, of trunk and legs.

    Raises:
        DescriptionError: if a leg's joints do not turn about x, y and y.
    """
    pin_model = model.pin_model
    links = Links()
    for n, (inertia, place) in enumerate(
        zip(pin_model.inertias[1:], pin_model.jointPlacements[1:], strict=True)
    ):
        links.share[n], links.p_com[n] = inertia.mass / model.mass, inertia.lever
        if n == 0:
            continue
        links.p_joint[n] = place.translation
        axis, expected = pin_model.joints[n + 1].shortname(), LEG_AXES[(n - 1) % 3]
        if axis != expected or not np.array_equal(place.rotation, np.eye(3)):
            raise DescriptionError(
                f"{JOINT_NAMES[n - 1]} is a {axis}; expected {expected}, not tilted"
            )
    return links


_KNOWN: WeakKeyDictionary[RobotModel, dict[Leg, LegGeometry]] = WeakKeyDictionary()
"""The legs of every living model that were asked for."""


@subroutine
def wrapped(angle: float) -> float:
    """An angle between -2 pi and 2 pi, brought between -pi and pi."""
    if angle > np.pi:
        return angle - 2.0 * np.pi
    if angle < -np.pi:
        return angle + 2.0 * np.pi
    return angle


@subroutine
def solve_leg(leg: LegGeometry, x: float, y: float, z: float, q: Array3) -> float:
    """Fill the three angles that bring a foot to a place in the base frame; returns the miss."""
    x, y, z = x - leg.p_base_hip[0], y - leg.p_base_hip[1], z - leg.p_base_hip[2]
    width, thigh, calf = leg.width, leg.thigh, leg.calf
    across = y * y + z * z - width * width
    down = 0.0 if across < 0.0 else np.sqrt(across)
    if z > 0.0:
        down = -down
    reach = np.hypot(x, down)
    cosine = (reach * reach - thigh * thigh - calf * calf) / (2.0 * thigh * calf)
    cosine = min(max(cosine, -1.0), 1.0)
    knee = -np.arccos(cosine)
    swing = np.arctan2(-x, down)
    swing -= np.arctan2(calf * np.sin(knee), thigh + calf * np.cos(knee))
    q[0] = wrapped(np.arctan2(z, y) + np.arctan2(down, width))
    q[1] = wrapped(swing)
    q[2] = knee
    near = max(abs(width) - np.hypot(y, z), 0.0)
    far = max(reach - thigh - calf, abs(thigh - calf) - reach)
    return near if far <= 0.0 else np.hypot(near, far)


@kernel(nogil=True)
def solve_legs(
    leg: LegGeometry, places: ArrayNx3, q: ArrayNx3, miss: Float[np.ndarray, " n"]
) -> None:
    """Fill angles and misses for foot centres in the base frame."""
    for i in range(len(places)):
        miss[i] = solve_leg(leg, places[i, 0], places[i, 1], places[i, 2], q[i])


@subroutine
def turns_of(q: Array3, turns: Array6) -> None:
    """Fill cosine and sine of the hip, of the thigh, and of thigh and calf together."""
    turns[0], turns[1] = np.cos(q[0]), np.sin(q[0])
    turns[2], turns[3] = np.cos(q[1]), np.sin(q[1])
    turns[4], turns[5] = np.cos(q[1] + q[2]), np.sin(q[1] + q[2])


@subroutine
def turns_to(leg: LegGeometry, x: float, y: float, z: float, turns: Array6) -> None:
    """The same of the angles that ``solve_leg`` finds, without the angles: no more than roots."""
    x, y, z = x - leg.p_base_hip[0], y - leg.p_base_hip[1], z - leg.p_base_hip[2]
    width, thigh, calf = leg.width, leg.thigh, leg.calf
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
    cosine = min(max(cosine, -1.0), 1.0)
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


@subroutine
def weigh_leg(links: Links, leg: int, turns: Array6, moment: Array3) -> None:
    """Fill what a leg adds to the CoM in the base frame: its links' places by their shares.

    With x, y, y the axes of hip, thigh and calf, o_k the places of the joints on the links before
    them, c_k and s_k the links' centres and shares of the mass:

        (s1 + s2 + s3) o1
        + Rx(q1) (s1 c1 + s2 (o2 + Ry(q2) c2) + s3 (o2 + Ry(q2) o3 + Ry(q2 + q3) c3))
    """
    n = 1 + 3 * leg
    s1, s2, s3 = links.share[n], links.share[n + 1], links.share[n + 2]
    c1, c2, c3 = links.p_com[n], links.p_com[n + 1], links.p_com[n + 2]
    o1, o2, o3 = links.p_joint[n], links.p_joint[n + 1], links.p_joint[n + 2]
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


@subroutine
def add_up(links: Links, moments: Array4x3, R: Array3x3, p: Array3, com: Array3) -> None:
    """Fill the CoM in the world from the four legs' moments, at R and p of the base."""
    share, c = links.share[0], links.p_com[0]
    x, y, z = share * c[0], share * c[1], share * c[2]
    for leg in range(4):
        x, y, z = x + moments[leg, 0], y + moments[leg, 1], z + moments[leg, 2]
    for i in range(3):
        com[i] = p[i] + R[i, 0] * x + R[i, 1] * y + R[i, 2] * z


@kernel(nogil=True)
def centres_of_mass(
    links: Links, p: ArrayNx3, R: ArrayNx3x3, joints: ArrayNx12, com: ArrayNx3
) -> None:
    """Fill the CoM in the world of every configuration."""
    moments, turns = np.empty((4, 3)), np.empty(6)
    for i in range(len(p)):
        for leg in range(4):
            turns_of(joints[i, 3 * leg : 3 * leg + 3], turns)
            weigh_leg(links, leg, turns, moments[leg])
        add_up(links, moments, R[i], p[i], com[i])


@kernel(nogil=True)
def settle(
    wanted: ArrayNx3,
    is_com: Bool[np.ndarray, " n"],
    raised: Bool[np.ndarray, "n 4"],
    R: ArrayNx3x3,
    p_feet: Float[np.ndarray, "n 4 3"],
    legs: Legs,
    links: Links,
    steps: int,
    p: ArrayNx3,
    joints: ArrayNx12,
    miss: Float[np.ndarray, "n 4"],
    com: ArrayNx3,
) -> None:
    """Put every trunk where its CoM, or its base, is wanted, with standing feet in their places.

    ``p`` starts at the base's place and ends there, ``joints`` of raised legs stay; the others,
    ``miss`` and ``com`` are filled. In every step but the last, p <- p + (c* - c(p)).
    """
    moments, turns = np.empty((4, 3)), np.empty(6)
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
                sizes, foot = legs.geometry[leg], p_feet[i, leg]
                away = foot[0] - p[i, 0], foot[1] - p[i, 1], foot[2] - p[i, 2]
                x, y, z = turned_back(R[i], away)  # as the base sees it
                if step == steps:
                    angles = joints[i, 3 * leg : 3 * leg + 3]
                    miss[i, leg] = solve_leg(sizes, x, y, z, angles)
                turns_to(sizes, x, y, z, turns)
                weigh_leg(links, leg, turns, moments[leg])
            add_up(links, moments, R[i], p[i], com[i])
            if step < steps and is_com[i]:
                for k in range(3):
                    p[i, k] += wanted[i, k] - com[i, k]


@dataclass(frozen=True, slots=True)
class LegAngles:
    """Joint angles that bring a foot to its places, as near as the leg reaches."""

    q: ArrayNx3  #: (n, 3) hip, thigh and calf angle [rad]
    miss: Float[np.ndarray, " n"]
    """(n,) distance [m] by which each place is out of the leg's reach; 0 within it."""


def leg_angles(geometry: LegGeometry, p_base_foot: ArrayNx3) -> LegAngles:
    """Joint angles for foot centres (n, 3) in the base frame [m]; ``geometry`` is packed."""
    found = LegAngles(np.empty((len(p_base_foot), 3)), np.empty(len(p_base_foot)))
    solve_legs(geometry, np.ascontiguousarray(p_base_foot, float), found.q, found.miss)
    return found


def foot_places(geometry: LegGeometry, q: ArrayNx3) -> ArrayNx3:
    """Foot centres (n, 3) in the base frame [m] at joint angles (n, 3)."""
    hip, thigh, calf = q.T
    x = -geometry.thigh * np.sin(thigh) - geometry.calf * np.sin(thigh + calf)
    down = geometry.thigh * np.cos(thigh) + geometry.calf * np.cos(thigh + calf)
    y = geometry.width * np.cos(hip) + down * np.sin(hip)
    z = geometry.width * np.sin(hip) - down * np.cos(hip)
    return geometry.p_base_hip + np.column_stack([x, y, z])
