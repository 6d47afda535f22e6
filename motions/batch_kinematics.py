"""Kinematics of many instants at once, in compiled kernels.

The main function is ``place``: the pose of the trunk and the joint angles for given footholds and a
given CoM.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Float

from go2_wbc.legs import LEGS
from go2_wbc.robot import leg_kinematics
from go2_wbc.robot.leg_kinematics import LegGeometry, foot_places, leg_table, link_table, settle
from go2_wbc.robot.model import RobotModel
from go2_wbc.robot.rotations import quaternions_from_rpy, rotations_from_rpy
from motions.memory import Memory, Rows, by_rows

LEAST_WEIGHT = 1.0
"""Least vertical force [N] by which moments are divided: the zero-moment point stays finite."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Wanted:
    """What is asked of trunk and legs at every instant."""

    p: Float[np.ndarray, "n 3"]  #: (n, 3) place [m] of the CoM, or of the base
    is_com: Bool[np.ndarray, " n"]  #: (n,) of which
    R: Float[np.ndarray, "n 3 3"]  #: (n, 3, 3) attitude of the trunk
    q_joints: Float[np.ndarray, "n 12"]
    """(n, 12) angles [rad] of the raised legs; those of the others do not count."""
    raised: Bool[np.ndarray, "n 4"]  #: (n, 4) legs that follow their joints; the others, their feet
    p_feet: Float[np.ndarray, "n 4 3"]  #: (n, 4, 3) where the feet of the other legs are [m]


@dataclass(frozen=True, slots=True)
class Placed:
    """What comes of it."""

    p_base: Float[np.ndarray, "n 3"]  #: (n, 3) origin of the base [m]
    q_joints: Float[np.ndarray, "n 12"]  #: (n, 12) joint angles [rad]
    p_com: Float[np.ndarray, "n 3"]  #: (n, 3) CoM [m]
    miss: Float[np.ndarray, "n 4"]
    """(n, 4) distance [m] by which such a foot is out of its leg's reach."""


def place(wanted: Wanted, steps: int, model: RobotModel, memory: Memory | None = None) -> Placed:
    """Trunk and joints that give what is wanted; ``steps`` put the CoM in its place.

    With the feet in their places and the attitude given, the CoM c is a function of the base's
    place p alone; p <- p + (c* - c(p)) converges, since the legs follow the base only in part: each
    step leaves an eighth of the error (measured). The legs are solved once more after the last one,
    so that the feet are exactly in their places. ``memory``: of instants that are like these.
    """

    def work(rows: Rows) -> Float[np.ndarray, "k 22"]:
        p, joints = wanted.p[rows], wanted.q_joints[rows]
        miss, com = np.empty((len(p), 4)), np.empty((len(p), 3))
        settle(
            p.copy(),
            wanted.is_com[rows],
            wanted.raised[rows],
            wanted.R[rows],
            wanted.p_feet[rows],
            leg_table(model),
            link_table(model),
            steps,
            p,
            joints,
            miss,
            com,
        )
        return np.hstack([p, joints, com, miss])

    count = len(wanted.p)
    given = [wanted.p, wanted.R.reshape(count, 9), wanted.p_feet.reshape(count, 12)]
    given += [wanted.q_joints, wanted.is_com[:, None], wanted.raised]
    found = by_rows(memory, ("place", steps), np.hstack(given), work)
    return Placed(found[:, :3], found[:, 3:15], found[:, 15:18], found[:, 18:])


def attitudes(rpy: Float[np.ndarray, "n 3"]) -> Float[np.ndarray, "n 3 3"]:
    """R_world_base = Rz(yaw) Ry(pitch) Rx(roll) of every row [rad]."""
    R = np.empty((len(rpy), 3, 3))
    rotations_from_rpy(_own(rpy), R)
    return R


def angles_of(R: Float[np.ndarray, "n 3 3"]) -> Float[np.ndarray, "n 3"]:
    """Roll, pitch, yaw [rad] of every rotation, the pitch within a quarter turn.

    The roll is that of Rz(-yaw) R, which is well defined where the trunk stands on its end and yaw
    and roll are not told apart.
    """
    yaw = np.arctan2(R[:, 1, 0], R[:, 0, 0])
    pitch = np.arctan2(-R[:, 2, 0], np.hypot(R[:, 0, 0], R[:, 1, 0]))
    s, c = np.sin(yaw), np.cos(yaw)
    roll = np.arctan2(s * R[:, 0, 2] - c * R[:, 1, 2], c * R[:, 1, 1] - s * R[:, 0, 1])
    return np.column_stack([roll, pitch, yaw])


def turned(R: Float[np.ndarray, "n 3 3"], p: Float[np.ndarray, "n 3"]) -> Float[np.ndarray, "n 3"]:
    """R p of every row; summed up by columns, which is faster than as many small products."""
    x, y, z = p.T[:, :, None]
    return R[:, :, 0] * x + R[:, :, 1] * y + R[:, :, 2] * z


def turned_back(
    R: Float[np.ndarray, "n 3 3"], p: Float[np.ndarray, "n 3"]
) -> Float[np.ndarray, "n 3"]:
    """R' p of every row."""
    return turned(R.transpose(0, 2, 1), p)


def configurations(
    poses: Float[np.ndarray, "n 6"], joints: Float[np.ndarray, "n 12"]
) -> Float[np.ndarray, "n 19"]:
    """q of a trunk at ``poses`` (position, then roll, pitch, yaw) with these joint angles."""
    xyzw = np.empty((len(poses), 4))
    quaternions_from_rpy(_own(poses[:, 3:]), xyzw)
    return np.hstack([poses[:, :3], xyzw, joints])


def foot_centres(
    p_base: Float[np.ndarray, "n 3"],
    R: Float[np.ndarray, "n 3 3"],
    joints: Float[np.ndarray, "n 12"],
    model: RobotModel,
) -> Float[np.ndarray, "n 4 3"]:
    """Centres of the feet [m] of a trunk at ``p_base`` [m] with attitude ``R``."""
    seen = [foot_places(LegGeometry.of(model, leg), joints[:, leg.joints]) for leg in LEGS]
    return np.stack([p_base + turned(R, places) for places in seen], axis=1)


def centres_of_mass(
    poses: Float[np.ndarray, "n 6"], joints: Float[np.ndarray, "n 12"], model: RobotModel
) -> Float[np.ndarray, "n 3"]:
    """CoM [m] of a trunk at ``poses`` with these joint angles."""
    com, R = np.empty((len(poses), 3)), attitudes(poses[:, 3:])
    leg_kinematics.centres_of_mass(link_table(model), _own(poses[:, :3]), R, _own(joints), com)
    return com


def rates(
    times: Float[np.ndarray, " n"], q: Float[np.ndarray, "n 19"], rpy: Float[np.ndarray, "n 3"]
) -> tuple[Float[np.ndarray, "n 18"], Float[np.ndarray, "n 18"]]:
    """Velocity and acceleration (n, 18) as Pinocchio counts them: the base's in its own frame.

    With v_b = R' v_w, the acceleration is the derivative of these very components,
    dv_b/dt = R' a_w - w_b x v_b (Featherstone 2008, ch. 2: spatial, not classical); so that of
    w_b = R' w_w is R' dw_w.
    """
    from scipy.interpolate import CubicSpline  # a robot that plays no motion stands without scipy

    R = attitudes(rpy)
    spline = CubicSpline(times, np.hstack([q[:, :3], rpy, q[:, 7:]]), bc_type="clamped")
    (_, half, slope, _), end = spline.c, times[-1:]  # of each piece where it begins
    rate = np.vstack([slope, spline(end, 1)])
    acceleration = np.vstack([2.0 * half, spline(end, 2)])
    turning = _angular_rates(rpy, rate[:, 3:6], acceleration[:, 3:6])
    v, a = turned_back(R, rate[:, :3]), turned_back(R, acceleration[:, :3])
    w, dw = (turned_back(R, vectors) for vectors in turning)
    return np.hstack([v, w, rate[:, 6:]]), np.hstack([a - np.cross(w, v), dw, acceleration[:, 6:]])


def zero_moment_points(
    q: Float[np.ndarray, "n 19"], rpy: Float[np.ndarray, "n 3"], wrench: Float[np.ndarray, "n 6"]
) -> Float[np.ndarray, "n 2"]:
    """Where the ground's forces act together (Vukobratovic & Borovac 2004, eq. 3).

    ``wrench``: what the trunk needs, about the base in its frame. Moved to the origin on the
    ground, F = R F_b and N = R N_b + p x F; there is no moment about the level axes at the point
    x = -N_y / F_z, y = N_x / F_z. Where the feet hardly press, F_z counts as ``LEAST_WEIGHT``.
    """
    R = attitudes(rpy)
    force = turned(R, wrench[:, :3])
    moment = turned(R, wrench[:, 3:]) + np.cross(q[:, :3], force)
    vertical = np.maximum(force[:, 2], LEAST_WEIGHT)
    return np.column_stack([-moment[:, 1], moment[:, 0]]) / vertical[:, None]


def _angular_rates(
    rpy: Float[np.ndarray, "n 3"],
    rate: Float[np.ndarray, "n 3"],
    acceleration: Float[np.ndarray, "n 3"],
) -> tuple[Float[np.ndarray, "n 3"], Float[np.ndarray, "n 3"]]:
    """World-frame w [rad/s] and dw [rad/s^2] of every row (Craig, 3rd ed., eq. 5.44)."""
    _, p, y = rpy.T
    cp, sp, cy, sy = np.cos(p), np.sin(p), np.cos(y), np.sin(y)
    ahead, aside = np.column_stack([cy, sy, 0.0 * y]), np.column_stack([-sy, cy, 0.0 * y])
    up, (dr, dp, dy) = np.array([0.0, 0.0, 1.0]), rate.T[:, :, None]
    cp, sp = cp[:, None], sp[:, None]
    # w = dr e_roll + dp e_pitch + dy e_yaw; the first two axes turn
    roll_axis, d_roll_axis = cp * ahead - sp * up, cp * dy * aside - sp * dp * ahead - cp * dp * up
    w = roll_axis * dr + aside * dp + up * dy
    ddr, ddp, ddy = acceleration.T[:, :, None]
    dw = roll_axis * ddr + aside * ddp + up * ddy + d_roll_axis * dr - ahead * dy * dp
    return w, dw


def _own(array: np.ndarray) -> np.ndarray:
    """A copy in the one layout that kernels take."""
    return np.array(array, order="C")
