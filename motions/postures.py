"""Resting postures and the ways between them, all on four feet that stay where they are."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from weakref import WeakKeyDictionary

import numpy as np
from jaxtyping import Float

from go2_wbc.curves import Curve
from go2_wbc.motion_plan import MotionPlan, Posture
from go2_wbc.reference import Anchor, Reference, Target, TrackedPoint
from go2_wbc.robot.description import RobotProfile, find_profile
from go2_wbc.robot.model import RobotModel
from go2_wbc.robot.rotations import yaw_rotation
from go2_wbc.tracking.plan_curves import stand
from motions.batch_kinematics import Wanted, attitudes, place

NORMAL_FORCE_MIN = 0.0
"""Least normal force [N] of a foot: none, so that a pushed robot may tip and come back."""
NORMAL_FORCE_MAX = 400.0
"""Greatest normal force [N]: 2.5 times the robot's weight, never active in slow motions."""
LEAST_REACH = 0.03
"""Least reach [m] of a sitting robot's rear legs in their planes; 0.05 on feet below the hips."""
MOST_RAISED = 0.012  #: Most that narrow feet raise a sit [m], inside of ``checks.HEIGHT_TOLERANCE``
SETTLING_STEPS = 10  #: Steps that put the CoM of a standing robot in its place; see ``place``


def __getattr__(name: str) -> Float[np.ndarray, "6"]:
    """``STAND_POSE``: that of a Go2, as it could be imported before there were other robots."""
    if name == "STAND_POSE":
        return find_profile().stand_pose
    raise AttributeError(name)


def standing_feet(model: RobotModel) -> Float[np.ndarray, "4 3"]:
    """Where the feet's centres stand [m]: below the hips, a foot's radius above the ground."""
    p_feet = model.p_base_feet_nominal.copy()
    p_feet[:, 2] = model.foot_radius
    return p_feet


def standing_on(
    p_feet: Float[np.ndarray, "4 3"],
    p_com: Float[np.ndarray, "3"],
    R: Float[np.ndarray, "3 3"],
    model: RobotModel,
) -> tuple[Float[np.ndarray, "3"], Float[np.ndarray, "12"]]:
    """Place of the base [m] and joint angles of a robot that stands on ``p_feet`` [m].

    ``p_com``: where its CoM is [m]; ``R``: the trunk's attitude.
    """
    wanted = Wanted(
        p=p_com[None],
        is_com=np.ones(1, dtype=bool),
        R=R[None],
        q_joints=np.zeros((1, 12)),
        raised=np.zeros((1, 4), dtype=bool),
        p_feet=p_feet[None],
    )
    placed = place(wanted, SETTLING_STEPS, model)
    return placed.p_base[0], placed.q_joints[0]


def home_poses(model: RobotModel) -> Mapping[Posture, Float[np.ndarray, "6"]]:
    """Pose of the base in every resting posture, on four feet below the hips.

    Standing is given by its CoM. They are found once for each model.
    """
    home = _HOMES.get(model)
    if home is None:
        own = model.profile
        pose, R = own.stand_pose, attitudes(own.stand_pose[None, 3:])[0]
        p_base, _ = standing_on(standing_feet(model), pose[:3], R, model)
        stand = np.concatenate([p_base, pose[3:]])
        home = {Posture.STAND: stand, Posture.SIT: own.sit_pose, Posture.LIE: own.lie_pose}
        _HOMES[model] = home
    return home


_HOMES: WeakKeyDictionary[RobotModel, Mapping[Posture, np.ndarray]] = WeakKeyDictionary()
"""The resting postures of every living model for which they were asked."""


@dataclass(frozen=True, slots=True)
class PosturePlan(MotionPlan):
    """The trunk goes from one pose to another by minimum jerk."""

    name: str  #: see ``MotionPlan``, as for the next two
    entry: Posture
    exit: Posture
    point: TrackedPoint  #: which point the first three components of ``body`` move
    body: Curve  #: from x, y, z [m] and roll, pitch, yaw [rad] (6,) to others

    @property
    def duration(self) -> float:  # type: ignore[override]
        """Length of the motion [s]."""
        return self.body.duration

    def at(self, t: float) -> Reference:
        """The reference at ``t``; see ``MotionPlan.at``."""
        return Reference.of_row(self.row_at(t))

    def row_at(self, t: float) -> Float[np.ndarray, " size"]:
        """Its numbers, by a kernel; see ``MotionPlan.row_at``."""
        target, is_com = Target(), self.point is TrackedPoint.COM
        stand(is_com, np.array(self.body.at(t)), NORMAL_FORCE_MIN, NORMAL_FORCE_MAX, target)
        return target.row


def rise(
    start: Float[np.ndarray, "6"],
    entry: Posture,
    duration: float = 1.2,
    profile: RobotProfile | None = None,
) -> PosturePlan:
    """From a CoM pose (6,) to standing; a Go2 without a ``profile``, as all of these."""
    way = Curve((0.0, duration), (start, (profile or find_profile()).stand_pose))
    return PosturePlan("stand", entry, Posture.STAND, TrackedPoint.COM, way)


def lean(
    start: Float[np.ndarray, "6"],
    rpy: Float[np.ndarray, "3"],
    duration: float = 1.0,
    profile: RobotProfile | None = None,
) -> PosturePlan:
    """From a standing CoM pose (6,) to standing with the trunk at roll, pitch, yaw [rad]."""
    stand = (profile or find_profile()).stand_pose
    way = Curve((0.0, duration), (start, np.concatenate([stand[:3], rpy])))
    return PosturePlan("lean", Posture.STAND, Posture.STAND, TrackedPoint.COM, way)


def sit_down(
    start: Float[np.ndarray, "6"],
    duration: float = 1.5,
    profile: RobotProfile | None = None,
    raised: float = 0.0,
) -> PosturePlan:
    """From a standing base pose (6,) to the dog-like sit; ``raised``: see ``sit_raise``."""
    pose = (profile or find_profile()).sit_pose
    pose[2] += raised
    way = Curve((0.0, duration), (start, pose))
    return PosturePlan("sit", Posture.STAND, Posture.SIT, TrackedPoint.BASE, way)


def sit_raise(p_world_feet: Float[np.ndarray, "4 3"], model: RobotModel) -> float:
    """How much higher [m] than its profile's sit a robot on narrow feet sits, MOST_RAISED at most.

    With the foot at (y, z) from the axis of hip abduction, y^2 + z^2 = w^2 + l^2, where w is the
    width of the hip and l how far the leg reaches in its plane. At l = 0 the leg is singular: on
    the other side of it the calf folds onto its stop.
    """
    _, _, height, _, pitch, _ = model.profile.sit_pose
    anchor = Anchor.of_feet(p_world_feet, model.foot_radius)
    p_feet = (p_world_feet - anchor.p_world) @ yaw_rotation(anchor.yaw)
    p_hips = model.p_base_hips[2:]
    x = p_feet[2:, 0]
    y = p_feet[2:, 1] - p_hips[:, 1]
    z = np.sqrt(np.maximum(0.0, model.hip_width**2 + LEAST_REACH**2 - y**2))
    needed = model.foot_radius + (z + np.sin(pitch) * x - p_hips[:, 2]) / np.cos(pitch)
    return float(np.clip(needed.max() - height, 0.0, MOST_RAISED))


def lie_down(
    start: Float[np.ndarray, "6"], duration: float = 1.5, profile: RobotProfile | None = None
) -> PosturePlan:
    """From a standing base pose (6,) down to the ground."""
    way = Curve((0.0, duration), (start, (profile or find_profile()).lie_pose))
    return PosturePlan("lie down", Posture.STAND, Posture.LIE, TrackedPoint.BASE, way)
