"""Distances between links that must not touch, on the convex hulls of their collision meshes.

The distance of two convex bodies is found by GJK, the depth of an overlap by EPA (Gilbert, Johnson
& Keerthi 1988; van den Bergen 2001), both in Coal. A hull contains its mesh, so a distance is never
overrated.

Along a motion, most pairs need not be looked at in most samples, since none of their points can
have moved far. Let the joints on the way from one link of a pair to the other turn by dq_k. Turned
one after the other, the outermost first, joint k carries what hangs on it along as one rigid body,
and moves no point of it by more than |dq_k| times the point's distance from the joint's axis, which
a lever arm l_k bounds in every configuration. So no point of one body moves by more than

    m = sum_k l_k |dq_k|

as seen from the other one. The signed distance of two convex bodies A and B is the greatest value,
over all directions u of length 1, of -h(u), where h is the support function of A - B (Ericson 2005,
*Real-Time Collision Detection*, sec. 9.3): positive apart, minus the depth when they overlap. A
move of points by m at most changes h by m at most, so the distance d as well: d - m is a lower
bound of what it has become. A pair whose bound lies above the distance of another one cannot be the
nearest, and is left out. The least distance and its pair are those of looking at all of them.
"""

from __future__ import annotations

import warnings
from functools import lru_cache

import coal
import numpy as np
import pinocchio as pin
from jaxtyping import Float

from go2_wbc.feasibility_limits import FeasibilityLimits
from go2_wbc.robot.description import RobotDescription
from go2_wbc.robot.model import RobotModel
from motions.feasibility.report import Series
from motions.plan.trajectory import Trajectory

STRIDE = 4
"""Every fourth sample is looked at, 25 a second: at 1 m/s a link moves 4 cm between two of them."""
SLACK = 1e-4
"""What a distance [m] may be wrong: GJK and EPA stop within 1e-6 of it, relative or in metres."""


class SelfCollision:
    """The robot's collision geometry, without the pairs that its SRDF lets touch.

    Attributes:
        geometry: convex bodies.
        names: of the two bodies of each pair.
        levers: (pairs, 12) greatest distance [m] of a point of one body of a pair from a joint's
            axis, for the joints between the two; else 0.
    """

    def __init__(self, model: RobotModel) -> None:
        """Take the convex bodies of ``model``; see ``geometry_of``."""
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
        return self.nearest_along(q[None])[0]

    def nearest_along(self, q: Float[np.ndarray, "n 19"]) -> list[tuple[float, str]]:
        """What ``nearest`` says of each configuration; faster if they follow one another."""
        joints, found = q[:, 7:], []
        last, seen = np.full(len(self.names), -np.inf), np.zeros_like(self.levers)
        for row in range(len(q)):
            pin.updateGeometryPlacements(
                self._model, self._data, self.geometry, self._results, q[row]
            )
            bounds = last - (self.levers * np.abs(joints[row] - seen)).sum(axis=1)
            likely = int(np.argmin(bounds))
            least, nearest = self._distance(likely), likely
            last[likely], seen[likely] = least, joints[row]
            for pair in np.flatnonzero(bounds <= least + SLACK).tolist():
                if pair == likely or bounds[pair] > least + SLACK:
                    continue
                distance = self._distance(pair)
                last[pair], seen[pair] = distance, joints[row]
                if (distance, pair) < (least, nearest):
                    least, nearest = distance, pair
            found.append((least, self._name(nearest)))
        return found

    def _distance(self, pair: int) -> float:
        return float(pin.computeDistance(self.geometry, self._results, pair).min_distance)

    def _name(self, pair: int) -> str:
        first, second = (name.rsplit("_", 1)[0] for name in self.names[pair])
        return f"{first}-{second}"


def self_distance(
    motion: Trajectory, collision: SelfCollision, model: RobotModel, limits: FeasibilityLimits
) -> Series:
    """Least distance of any two links that must not touch; joints stay at their stops."""
    rows = slice(None, None, STRIDE)
    q = motion.q[rows].copy()
    q[:, 7:] = np.clip(q[:, 7:], model.q_lower, model.q_upper)
    found = collision.nearest_along(q)
    values = np.array([[distance] for distance, _ in found])
    worst = found[int(np.argmin(values))][1]
    what = ("self-collision", "m", (worst,), motion.times[rows], values)
    return Series.against(*what, limits.self_distance, is_floor=True)


def _lever_arms(model: pin.Model, body: pin.GeometryObject) -> Float[np.ndarray, "12"]:
    """Greatest distance [m] of a point of ``body`` from the axis of each joint that carries it.

    Of the corners of its box, from the joint's origin, plus the lengths of the links between; 0 for
    a joint that does not carry it.
    """
    body.geometry.computeLocalAABB()
    box = body.geometry.aabb_local
    ends = np.array([box.min_, box.max_])
    corners = np.stack(np.meshgrid(*ends.T), axis=-1).reshape(-1, 3)
    places = corners @ body.placement.rotation.T + body.placement.translation
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
