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
"""

from __future__ import annotations

from dataclasses import dataclass
from weakref import WeakKeyDictionary

import numpy as np
from jaxtyping import Float

from go2_wbc.errors import DescriptionError
from go2_wbc.legs import JOINT_NAMES, LEGS, Leg
from go2_wbc.robot.model import LEG_AXES, RobotModel


@dataclass(frozen=True, slots=True)
class LegGeometry:
    """Lengths of a leg.

    Attributes:
        p_base_hip: origin of the hip's axis in the base frame [m].
        width: distance [m] from the hip's axis to the plane of the leg, positive to the left.
        thigh: from the thigh's axis to the knee [m].
        calf: from the knee to the foot's centre [m].
    """

    p_base_hip: Float[np.ndarray, "3"]
    width: float
    thigh: float
    calf: float

    @staticmethod
    def of(model: RobotModel, leg: Leg) -> LegGeometry:
        """The lengths of ``leg``, read from the robot's description."""
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
        return LegGeometry(np.array(hip), float(thigh[1]), float(-calf[2]), float(-foot[2]))

    @property
    def row(self) -> Float[np.ndarray, "6"]:
        """Its numbers one after the other, for the kernels."""
        return np.array([*self.p_base_hip, self.width, self.thigh, self.calf])


def leg_table(model: RobotModel) -> Float[np.ndarray, "4 6"]:
    """The geometry of each leg, for the kernels."""
    return np.array([LegGeometry.of(model, leg).row for leg in LEGS])


def link_table(model: RobotModel) -> Float[np.ndarray, "13 7"]:
    """Of the trunk and the legs' links, for the kernels: share of the mass, CoM, joint's place.

    The CoM [m] is given in the frame of the link's joint, the joint's place [m] in that of the link
    before it. The trunk's joint is its own.

    Raises:
        DescriptionError: if a leg's joints do not turn about x, y and y.
    """
    pin_model = model.pin_model
    table = np.zeros((13, 7))
    for row, (inertia, place) in enumerate(
        zip(pin_model.inertias[1:], pin_model.jointPlacements[1:], strict=True)
    ):
        table[row, 0] = inertia.mass / model.mass
        table[row, 1:4] = inertia.lever
        if row == 0:
            continue
        table[row, 4:] = place.translation
        axis, expected = pin_model.joints[row + 1].shortname(), LEG_AXES[(row - 1) % 3]
        if axis != expected or not np.array_equal(place.rotation, np.eye(3)):
            raise DescriptionError(
                f"{JOINT_NAMES[row - 1]} is a {axis}; expected {expected}, not tilted"
            )
    return table


_KNOWN: WeakKeyDictionary[RobotModel, dict[Leg, LegGeometry]] = WeakKeyDictionary()
"""The legs of every living model that were asked for."""


@dataclass(frozen=True, slots=True)
class LegAngles:
    """Joint angles that bring a foot to its places, as near as the leg reaches.

    Attributes:
        q: (n, 3) hip, thigh and calf angle [rad].
        miss: (n,) distance [m] by which each place is out of the leg's reach; 0 within it.
    """

    q: Float[np.ndarray, "n 3"]
    miss: Float[np.ndarray, " n"]


def leg_angles(geometry: LegGeometry, p_base_foot: Float[np.ndarray, "n 3"]) -> LegAngles:
    """Joint angles for foot centres (n, 3) in the base frame [m]."""
    from go2_wbc.kernels.kinematics import solve_legs  # compiled; only who needs it waits for it

    found = LegAngles(np.empty((len(p_base_foot), 3)), np.empty(len(p_base_foot)))
    solve_legs(geometry.row, np.ascontiguousarray(p_base_foot, float), found.q, found.miss)
    return found


def readable_leg_angles(geometry: LegGeometry, p_base_foot: Float[np.ndarray, "n 3"]) -> LegAngles:
    """The same as ``leg_angles``, in numpy: what the kernel is held to."""
    x, y, z = (p_base_foot - geometry.p_base_hip).T
    width, thigh, calf = geometry.width, geometry.thigh, geometry.calf
    across = y * y + z * z - width * width
    down = np.where(z > 0.0, -1.0, 1.0) * np.sqrt(np.maximum(across, 0.0))
    # angle of (y, z) minus that of (w, -down)
    hip = _wrapped(np.arctan2(z, y) + np.arctan2(down, width))
    reach = np.hypot(x, down)
    cosine = (reach**2 - thigh**2 - calf**2) / (2.0 * thigh * calf)
    knee = -np.arccos(np.clip(cosine, -1.0, 1.0))
    # direction of the foot minus that of the leg with q2 = 0: (l2 + l3 cos q3, l3 sin q3)
    swing = np.arctan2(-x, down) - np.arctan2(calf * np.sin(knee), thigh + calf * np.cos(knee))
    # nearer to the hip's axis than the leg's plane, and outside the ring |l2 - l3| .. l2 + l3 in it
    too_near = np.maximum(abs(width) - np.hypot(y, z), 0.0)
    too_far = np.maximum(np.maximum(reach - thigh - calf, abs(thigh - calf) - reach), 0.0)
    return LegAngles(np.column_stack([hip, _wrapped(swing), knee]), np.hypot(too_near, too_far))


def _wrapped(angle: Float[np.ndarray, " n"]) -> Float[np.ndarray, " n"]:
    return np.arctan2(np.sin(angle), np.cos(angle))


def foot_places(geometry: LegGeometry, q: Float[np.ndarray, "n 3"]) -> Float[np.ndarray, "n 3"]:
    """Foot centres (n, 3) in the base frame [m] at joint angles (n, 3)."""
    hip, thigh, calf = q.T
    x = -geometry.thigh * np.sin(thigh) - geometry.calf * np.sin(thigh + calf)
    down = geometry.thigh * np.cos(thigh) + geometry.calf * np.cos(thigh + calf)
    y = geometry.width * np.cos(hip) + down * np.sin(hip)
    z = geometry.width * np.sin(hip) - down * np.cos(hip)
    return geometry.p_base_hip + np.column_stack([x, y, z])
