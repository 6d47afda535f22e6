"""The links as convex bodies: distances between those that must not touch, heights above ground.

The distance of two convex bodies is found by GJK, the depth of an overlap by EPA (Gilbert, Johnson
& Keerthi 1988; van den Bergen 2001), both in Coal. A hull contains its mesh, so a distance is never
overestimated.

Along a motion, most pairs need not be checked in most samples, since none of their points can have
moved far. Let the joints between the two links of a pair turn by dq_k. If they turn one after the
other, the outermost first, joint k moves the links beyond it as one rigid body, and no point of
them by more than |dq_k| times the point's distance from the joint's axis, which a lever arm l_k
bounds in every configuration. So no point of one body moves by more than

    m = sum_k l_k |dq_k|

as seen from the other one. The signed distance of two convex bodies A and B is the greatest value,
over all directions u of length 1, of -h(u), where h is the support function of A - B (Ericson 2005,
*Real-Time Collision Detection*, sec. 9.3): positive apart, minus the depth when they overlap. A
move of points by m at most changes h by m at most, and so the distance d: d - m is a lower bound of
the new distance. A pair whose bound lies above the distance of another pair cannot be the nearest,
and is left out. The least distance and its pair are the same as from checking all pairs.

Over level ground the lowest point of a body is a corner of its convex hull: h = p_z + min_k r' c_k,
with r the world's vertical in the link's frame, p_z the height of the link's joint and c_k the
corners. The legs turn about x, y and y.
"""

from __future__ import annotations

import warnings
from dataclasses import dataclass
from functools import lru_cache

import coal
import numpy as np
import pinocchio as pin
from jaxtyping import Float
from scipy.spatial import ConvexHull

from go2_wbc.legs import LEGS, Leg
from go2_wbc.robot.description import RobotDescription
from go2_wbc.robot.model import RobotModel
from motions.batch_kinematics import attitudes
from motions.feasibility.forces import Case
from motions.feasibility.report import Series
from motions.memory import Memory, Rows, by_rows
from motions.plan.trajectory import Trajectory

STRIDE = 4
"""Every fourth sample is looked at, 25 a second: at 1 m/s a link moves 4 cm between two of them."""
SLACK = 1e-4
"""What a distance [m] may be wrong: GJK and EPA stop within 1e-6 of it, relative or in metres."""
TRUNK_JOINT = 1  #: Pinocchio's number of the base; those of hip, thigh and calf of every leg follow
PARTS = ("hip", "thigh", "calf")
FAR = 0.05
"""Height [m] of a link's box above which its hull is not looked at: far from every limit."""


class SelfCollision:
    """The robot's collision geometry, without the pairs that its SRDF lets touch.

    Attributes:
        geometry: convex bodies.
        names: of the two bodies of each pair.
        levers: (pairs, 12) greatest distance [m] of a point of one body of a pair from a joint's
            axis, for the joints between the two; else 0.
    """

    def __init__(self, model: RobotModel) -> None:
        self._model = model.pin_model
        self._data = self._model.createData()
        self.geometry = geometry_of(model.description)
        self._results = self.geometry.createData()
        objects = self.geometry.geometryObjects
        pairs = self.geometry.collisionPairs
        self.names = [(objects[pair.first].name, objects[pair.second].name) for pair in pairs]
        arms = np.array([_lever_arms(self._model, item) for item in objects])
        both = [(arms[pair.first], arms[pair.second]) for pair in pairs]
        self.levers = np.array(
            [np.where((one > 0.0) & (two > 0.0), 0.0, np.maximum(one, two)) for one, two in both]
        )

    def nearest(self, q: Float[np.ndarray, "19"]) -> tuple[float, str]:
        """Least distance [m] of any pair, negative if they overlap, and the pair's name."""
        ((distance, pair),) = self.nearest_along(q[None])
        return distance, self.pair_name(pair)

    def nearest_along(self, q: Float[np.ndarray, "n 19"]) -> list[tuple[float, int]]:
        """What ``nearest`` says of each configuration, by the numbers of pairs.

        Faster if they follow one another.
        """
        joints, found = q[:, 7:], []
        last, seen = np.full(len(self.names), -np.inf), np.zeros_like(self.levers)
        nearest = 0
        for row in range(len(q)):
            pin.updateGeometryPlacements(
                self._model, self._data, self.geometry, self._results, q[row]
            )
            moved = np.einsum("ij,ij->i", self.levers, np.abs(joints[row] - seen))
            bounds, likely = last - moved, nearest  # where nothing moves far it stays so
            least = self._distance(likely)
            last[likely], seen[likely] = least, joints[row]
            for pair in np.flatnonzero(bounds <= least + SLACK).tolist():
                if pair == likely or bounds[pair] > least + SLACK:
                    continue
                distance = self._distance(pair)
                last[pair], seen[pair] = distance, joints[row]
                if (distance, pair) < (least, nearest):
                    least, nearest = distance, pair
            found.append((least, nearest))
        return found

    def _distance(self, pair: int) -> float:
        return float(pin.computeDistance(self.geometry, self._results, pair).min_distance)

    def pair_name(self, pair: int) -> str:
        """The two bodies of a pair."""
        first, second = (name.rsplit("_", 1)[0] for name in self.names[pair])
        return f"{first}-{second}"


def self_distance(case: Case, collision: SelfCollision) -> Series:
    """Least distance of any two links that must not touch; joints stay at their stops."""
    rows, model = slice(None, None, STRIDE), case.model
    q = case.path.q[rows].copy()
    q[:, 7:] = np.clip(q[:, 7:], model.q_lower, model.q_upper)

    def nearest(rows: Rows) -> Float[np.ndarray, "k 2"]:
        return np.array(collision.nearest_along(q[rows]))

    found = by_rows(case.memory, "collision", q[:, 7:], nearest)
    values = found[:, :1]
    worst = collision.pair_name(int(found[np.argmin(values), 1]))
    what, times = ("self-collision", "m", (worst,), values), case.path.times[rows]
    return case.series(*what, case.limits.self_distance, is_floor=True, times=times)


def _lever_arms(model: pin.Model, body: pin.GeometryObject) -> Float[np.ndarray, "12"]:
    """Greatest distance [m] of a point of ``body`` from the axis of each joint that carries it.

    Of the corners of its box, from the joint's origin, plus the lengths of the links between; 0 for
    a joint that does not carry it.
    """
    body.geometry.computeLocalAABB()
    box = body.geometry.aabb_local
    places = _box(box.min_, box.max_) @ body.placement.rotation.T + body.placement.translation
    arms, joint = np.zeros(12), body.parentJoint
    reach = float(np.linalg.norm(places, axis=1).max())
    while joint > 1:
        arms[model.idx_vs[joint] - 6] = reach
        reach += float(np.linalg.norm(model.jointPlacements[joint].translation))
        joint = model.parents[joint]
    return arms


def geometry_of(description: RobotDescription) -> pin.GeometryModel:
    """The convex bodies of a robot, which all that ask for them share: never change them.

    The first time takes a tenth of a second, and again if the URDF or the SRDF has been written.
    """
    return _geometry(description, written(description))


def written(description: RobotDescription) -> tuple[int, ...]:
    """When URDF and SRDF were written last [ns]."""
    files = (description.urdf_path, description.srdf_path)
    return tuple(file.stat().st_mtime_ns for file in files if file is not None)


@lru_cache(maxsize=4)
def _geometry(description: RobotDescription, _written: tuple[int, ...]) -> pin.GeometryModel:
    model = RobotModel(description).pin_model
    folders = [str(folder) for folder in description.package_dirs]
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", UserWarning)  # pin talks about its own argument names
        geometry = pin.buildGeomFromUrdf(
            model, str(description.urdf_path), pin.GeometryType.COLLISION, folders
        )
    for item in geometry.geometryObjects:
        if isinstance(item.geometry, coal.BVHModelBase):
            item.geometry.buildConvexRepresentation(False)
            item.geometry = item.geometry.convex
    geometry.addAllCollisionPairs()
    if description.srdf_path is not None:
        pin.removeCollisionPairs(model, geometry, str(description.srdf_path))
    return geometry


@dataclass(frozen=True, slots=True)
class LinkHull:
    """The hull of one link."""

    name: str  #: "trunk", or leg and part
    joint: int  #: Pinocchio's number of the joint that carries it
    corners: Float[np.ndarray, "k 3"]  #: (k, 3) in that joint's frame [m]
    box: Float[np.ndarray, "8 3"]  #: (8, 3) corners of the box around them [m]

    @staticmethod
    def of(joint: int, points: Float[np.ndarray, "m 3"]) -> LinkHull:
        """The hull of ``points`` [m] in the joint's frame."""
        corners = points[ConvexHull(points).vertices]
        box = _box(corners.min(axis=0), corners.max(axis=0))
        return LinkHull(_name(joint), joint, corners, box)

    def heights(
        self, up: Float[np.ndarray, "n 3"], height: Float[np.ndarray, " n"]
    ) -> Float[np.ndarray, " n"]:
        """Of its lowest point [m]; above ``FAR`` that of its box, which is no higher.

        Args:
            up: the world's vertical in the joint's frame.
            height: of the joint [m].
        """
        lowest = height + (self.box @ up.T).min(axis=0)
        near = lowest < FAR
        lowest[near] = height[near] + (self.corners @ up[near].T).min(axis=0)
        return lowest


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
                own, T = _points(item.geometry), item.placement
                points.setdefault(item.parentJoint, []).append(own @ T.rotation.T + T.translation)
        self.links = tuple(LinkHull.of(joint, np.vstack(points[joint])) for joint in sorted(points))

    @property
    def names(self) -> tuple[str, ...]:
        """Of the links."""
        return tuple(link.name for link in self.links)

    def heights(self, motion: Trajectory, memory: Memory | None = None) -> Float[np.ndarray, "n k"]:
        """Of the lowest point of every link over the ground [m]; see ``LinkHull.heights``.

        ``memory``: of motions that are like it.
        """
        vertical, places = attitudes(motion.rpy)[:, 2], motion.q[:, 2]

        def work(rows: Rows) -> Float[np.ndarray, "m k"]:
            up, height, joints = vertical[rows], places[rows], motion.q[rows, 7:]
            frames = {TRUNK_JOINT: (up, height)}
            for leg in LEGS:
                frames |= self._leg_frames(leg, up, height, joints[:, leg.joints])
            return np.column_stack([link.heights(*frames[link.joint]) for link in self.links])

        given = np.hstack([vertical, places[:, None], motion.q[:, 7:]])
        return by_rows(memory, "heights", given, work)

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


def _points(geometry: coal.CollisionGeometry) -> Float[np.ndarray, "m 3"]:
    """Of a convex body; of one that is none, as a cylinder, the corners of the box around it."""
    if isinstance(geometry, coal.ConvexBase):
        return np.array(geometry.points())
    geometry.computeLocalAABB()
    return _box(geometry.aabb_local.min_, geometry.aabb_local.max_)


def _name(joint: int) -> str:
    if joint == TRUNK_JOINT:
        return "trunk"
    leg, part = divmod(joint - TRUNK_JOINT - 1, len(PARTS))
    return f"{LEGS[leg].name} {PARTS[part]}"


def _box(
    least: Float[np.ndarray, "3"], greatest: Float[np.ndarray, "3"]
) -> Float[np.ndarray, "8 3"]:
    """The corners of a box along the axes."""
    ends = np.array([least, greatest])
    return np.stack(np.meshgrid(*ends.T), axis=-1).reshape(-1, 3)


def hulls_of(description: RobotDescription) -> LinkHulls:
    """The hulls of a robot's links; the first time takes 20 ms, see ``geometry_of``."""
    return _hulls(description, written(description))


@lru_cache(maxsize=4)
def _hulls(description: RobotDescription, _written: tuple[int, ...]) -> LinkHulls:
    return LinkHulls(RobotModel(description), geometry_of(description))
