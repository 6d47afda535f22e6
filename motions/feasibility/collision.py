"""Distances between links that must not touch, on the convex hulls of their collision meshes.

The distance of two convex bodies is found by GJK, the depth of an overlap by EPA (Gilbert, Johnson
& Keerthi 1988; van den Bergen 2001), both in Coal. A hull contains its mesh, so a distance is never
overrated.
"""

from __future__ import annotations

import warnings

import coal
import numpy as np
import pinocchio as pin
from jaxtyping import Float

from go2_wbc.robot.description import RobotDescription
from go2_wbc.robot.model import RobotModel
from motions.feasibility.limits import FeasibilityLimits
from motions.feasibility.report import Series
from motions.trajectory import Trajectory

STRIDE = 4
"""Every fourth sample is looked at, 25 a second: at 1 m/s a link moves 4 cm between two of them."""


class SelfCollision:
    """The robot's collision geometry, without the pairs that its SRDF lets touch."""

    def __init__(self, model: RobotModel) -> None:
        """Load the meshes: a tenth of a second."""
        self._model = model.pin_model
        self._data = self._model.createData()
        self._geometry = _load(model.pin_model, model.description)
        self._results = self._geometry.createData()
        objects = self._geometry.geometryObjects
        self._pairs = [
            (objects[pair.first].name, objects[pair.second].name)
            for pair in self._geometry.collisionPairs
        ]

    def nearest(self, q: Float[np.ndarray, "19"]) -> tuple[float, str]:
        """Least distance [m] of any pair, negative if they overlap, and the pair's name."""
        pin.updateGeometryPlacements(self._model, self._data, self._geometry, self._results, q)
        index = pin.computeDistances(self._geometry, self._results)
        first, second = (name.rsplit("_", 1)[0] for name in self._pairs[index])
        return float(self._results.distanceResults[index].min_distance), f"{first}-{second}"


def self_distance(
    motion: Trajectory, collision: SelfCollision, limits: FeasibilityLimits
) -> Series:
    """Least distance of any two links that must not touch."""
    rows = slice(None, None, STRIDE)
    found = [collision.nearest(q) for q in motion.q[rows]]
    values = np.array([[distance] for distance, _ in found])
    worst = found[int(np.argmin(values))][1]
    what = ("self-collision", "m", (worst,), motion.times[rows], values)
    return Series.against(*what, limits.self_distance, is_floor=True)


def _load(model: pin.Model, description: RobotDescription) -> pin.GeometryModel:
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
