"""How high the links are over the ground: every point of them, by their hulls' lowest ones.

Over level ground the lowest point of a body is one of its convex hull's corners, the one that is
farthest down: h = p_z + min_k r' c_k, with r the world's vertical in the link's frame, p_z the
height of the link's joint and c_k the corners (the hull's support function, Ericson 2005,
*Real-Time Collision Detection*, sec. 9.3). The legs turn about x, y and y.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache
from typing import final

import numpy as np
import pinocchio as pin
from jaxtyping import Float
from scipy.spatial import ConvexHull

from go2_wbc.legs import LEGS, Leg
from go2_wbc.robot.description import RobotDescription
from go2_wbc.robot.model import RobotModel
from motions.batch_kinematics import attitudes
from motions.feasibility.collision import geometry_of, written
from motions.plan.trajectory import Trajectory

TRUNK_JOINT = 1
"""Pinocchio's number of the base; those of hip, thigh and calf of every leg follow."""
PARTS = ("hip", "thigh", "calf")
FAR = 0.05
"""Height [m] of a link's box above which its hull is not looked at: far from every limit."""


@dataclass(frozen=True, slots=True)
class LinkHull:
    """The hull of one link.

    Attributes:
        name: "trunk", or leg and part.
        joint: Pinocchio's number of the joint that carries it.
        corners: (k, 3) in that joint's frame [m].
        box: (8, 3) corners of the box around them.
    """

    name: str
    joint: int
    corners: Float[np.ndarray, "k 3"]
    box: Float[np.ndarray, "8 3"]

    @staticmethod
    def of(joint: int, points: Float[np.ndarray, "m 3"]) -> LinkHull:
        """The hull of ``points`` [m] in the joint's frame."""
        corners = points[ConvexHull(points).vertices]
        ends = np.array([corners.min(axis=0), corners.max(axis=0)])
        box = np.stack(np.meshgrid(*ends.T), axis=-1).reshape(-1, 3)
        return LinkHull(_name(joint), joint, corners, box)

    def heights(
        self, up: Float[np.ndarray, "n 3"], height: Float[np.ndarray, " n"]
    ) -> Float[np.ndarray, " n"]:
        """Of its lowest point [m]; above ``FAR`` that of its box, which is no higher.

        Args:
            up: the world's vertical in the joint's frame.
            height: of the joint [m].
        """
        lowest = height + (up @ self.box.T).min(axis=1)
        near = lowest < FAR
        lowest[near] = height[near] + (up[near] @ self.corners.T).min(axis=1)
        return lowest


@final
class LinkHulls:
    """The robot's links without the feet, which are spheres that may touch the ground.

    Attributes:
        links: trunk first.
    """

    def __init__(self, model: RobotModel, geometry: pin.GeometryModel) -> None:
        """Take the corners of ``geometry``, whose bodies are convex."""
        self._origins = np.array([T.translation for T in model.pin_model.jointPlacements])
        points: dict[int, list[Float[np.ndarray, "m 3"]]] = {}
        for item in geometry.geometryObjects:
            if not item.name.rsplit("_", 1)[0].endswith("foot"):
                own, T = np.array(item.geometry.points()), item.placement
                points.setdefault(item.parentJoint, []).append(own @ T.rotation.T + T.translation)
        self.links = tuple(LinkHull.of(joint, np.vstack(points[joint])) for joint in sorted(points))

    @property
    def names(self) -> tuple[str, ...]:
        """Of the links."""
        return tuple(link.name for link in self.links)

    def heights(self, motion: Trajectory) -> Float[np.ndarray, "n k"]:
        """Of the lowest point of every link over the ground [m]; see ``LinkHull.heights``."""
        up, height = attitudes(motion.rpy)[:, 2], motion.q[:, 2]
        frames = {TRUNK_JOINT: (up, height)}
        for leg in LEGS:
            frames |= self._leg_frames(leg, up, height, motion.q[:, 7:][:, leg.joints])
        return np.column_stack([link.heights(*frames[link.joint]) for link in self.links])

    def _leg_frames(
        self,
        leg: Leg,
        up: Float[np.ndarray, "n 3"],
        height: Float[np.ndarray, " n"],
        joints: Float[np.ndarray, "n 3"],
    ) -> dict[int, tuple[Float[np.ndarray, "n 3"], Float[np.ndarray, " n"]]]:
        """The world's vertical in the frame of each joint of a leg, and the joint's height [m]."""
        frames, (x, y, z) = {}, up.T
        for part, angle in enumerate(joints.T):
            joint = TRUNK_JOINT + 1 + leg.joints.start + part
            height = height + np.column_stack([x, y, z]) @ self._origins[joint]
            c, s = np.cos(angle), np.sin(angle)
            if part == 0:
                y, z = c * y + s * z, c * z - s * y
            else:
                x, z = c * x - s * z, c * z + s * x
            frames[joint] = np.column_stack([x, y, z]), height
        return frames


def _name(joint: int) -> str:
    if joint == TRUNK_JOINT:
        return "trunk"
    leg, part = divmod(joint - TRUNK_JOINT - 1, len(PARTS))
    return f"{LEGS[leg].name} {PARTS[part]}"


def hulls_of(description: RobotDescription) -> LinkHulls:
    """The hulls of a robot's links; the first time takes 20 ms, see ``geometry_of``."""
    return _hulls(description, written(description))


@lru_cache(maxsize=4)
def _hulls(description: RobotDescription, _written: tuple[int, ...]) -> LinkHulls:
    return LinkHulls(RobotModel(description), geometry_of(description))
