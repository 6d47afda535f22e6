"""Where trunk and joints are when the feet stand in their places and the CoM is where it is wanted.

For many instants at once, compiled (``robot.leg_kinematics``).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Float

from go2_wbc.robot import leg_kinematics
from go2_wbc.robot.leg_kinematics import leg_table, link_table, settle
from go2_wbc.robot.model import RobotModel
from go2_wbc.robot.rotations import quaternions_from_rpy, rotations_from_rpy


@dataclass(frozen=True, slots=True, kw_only=True)
class Wanted:
    """What is asked of trunk and legs at every instant.

    Attributes:
        p: (n, 3) place [m] of the CoM, or of the base.
        is_com: (n,) of which.
        R: (n, 3, 3) attitude of the trunk.
        q_joints: (n, 12) angles [rad] of the raised legs; those of the others do not count.
        raised: (n, 4) legs that follow their joints; the others, their feet.
        p_feet: (n, 4, 3) where the feet of the other legs are [m].
    """

    p: Float[np.ndarray, "n 3"]
    is_com: Bool[np.ndarray, " n"]
    R: Float[np.ndarray, "n 3 3"]
    q_joints: Float[np.ndarray, "n 12"]
    raised: Bool[np.ndarray, "n 4"]
    p_feet: Float[np.ndarray, "n 4 3"]


@dataclass(frozen=True, slots=True)
class Placed:
    """What comes of it.

    Attributes:
        p_base: (n, 3) origin of the base [m].
        q_joints: (n, 12) joint angles [rad].
        p_com: (n, 3) CoM [m].
        miss: (n, 4) distance [m] by which such a foot is out of its leg's reach.
    """

    p_base: Float[np.ndarray, "n 3"]
    q_joints: Float[np.ndarray, "n 12"]
    p_com: Float[np.ndarray, "n 3"]
    miss: Float[np.ndarray, "n 4"]


def place(wanted: Wanted, steps: int, model: RobotModel) -> Placed:
    """Trunk and joints that give what is wanted; ``steps`` put the CoM in its place.

    With the feet in their places and the attitude given, the CoM c is a function of the base's
    place p alone; p <- p + (c* - c(p)) converges, since the legs follow the base only in part: each
    step leaves an eighth of the error (measured). The legs are solved once more after the last one,
    so that the feet are exactly in their places.
    """
    p, joints = _own(wanted.p), _own(wanted.q_joints)
    miss, com = np.empty((len(p), 4)), np.empty((len(p), 3))
    settle(
        _own(wanted.p),
        _own(wanted.is_com),
        _own(wanted.raised),
        _own(wanted.R),
        _own(wanted.p_feet),
        leg_table(model),
        link_table(model),
        steps,
        p,
        joints,
        miss,
        com,
    )
    return Placed(p, joints, com, miss)


def attitudes(rpy: Float[np.ndarray, "n 3"]) -> Float[np.ndarray, "n 3 3"]:
    """R_world_base = Rz(yaw) Ry(pitch) Rx(roll) of every row [rad]."""
    R = np.empty((len(rpy), 3, 3))
    rotations_from_rpy(_own(rpy), R)
    return R


def turned(R: Float[np.ndarray, "n 3 3"], p: Float[np.ndarray, "n 3"]) -> Float[np.ndarray, "n 3"]:
    """R p of every row."""
    return (R @ p[:, :, None])[:, :, 0]


def turned_back(
    R: Float[np.ndarray, "n 3 3"], p: Float[np.ndarray, "n 3"]
) -> Float[np.ndarray, "n 3"]:
    """R' p of every row."""
    return (p[:, None] @ R)[:, 0]


def configurations(
    poses: Float[np.ndarray, "n 6"], joints: Float[np.ndarray, "n 12"]
) -> Float[np.ndarray, "n 19"]:
    """q of a trunk at ``poses`` (position, then roll, pitch, yaw) with these joint angles."""
    xyzw = np.empty((len(poses), 4))
    quaternions_from_rpy(_own(poses[:, 3:]), xyzw)
    return np.hstack([poses[:, :3], xyzw, joints])


def centres_of_mass(
    poses: Float[np.ndarray, "n 6"], joints: Float[np.ndarray, "n 12"], model: RobotModel
) -> Float[np.ndarray, "n 3"]:
    """CoM [m] of a trunk at ``poses`` with these joint angles."""
    com, R = np.empty((len(poses), 3)), attitudes(poses[:, 3:])
    leg_kinematics.centres_of_mass(link_table(model), _own(poses[:, :3]), R, _own(joints), com)
    return com


def _own(array: np.ndarray) -> np.ndarray:
    """A copy in the one layout that kernels take."""
    return np.array(array, order="C")
