"""The Go2's visual meshes, each loaded once and shared by the legs, and the robot in a pose."""

from __future__ import annotations

import functools
from dataclasses import dataclass, replace
from pathlib import Path
from typing import final

import numpy as np
import pinocchio as pin
from jaxtyping import Float

from go2_wbc.legs import FOOT_NAMES
from go2_wbc.robot.description import find_description, read_mesh
from viz.render.mesh import Surface, simplify, smooth_surface

_CREASE = np.deg2rad(22.0)  # the files have lost their smoothing; 22 deg looks like it
_COARSE_CREASE = np.deg2rad(32.0)  # a coarse surface has larger angles between its faces
_BLACK_LIFT = 34 / 255  # least value of a colour: pure black would show no shape


@dataclass(frozen=True, slots=True)
class RobotVisuals:
    """Everything that is drawn of the robot.

    Attributes:
        meshes: the surfaces of each mesh file in its own frame, one for each colour, by its path.
        geometry: which mesh sits where, in the URDF's order.
        model: Pinocchio's kinematic model (free flyer).
    """

    meshes: dict[str, tuple[Surface, ...]]
    geometry: pin.GeometryModel
    model: pin.Model

    def simplified(self, cell: float) -> RobotVisuals:
        """A coarser copy: details below ``cell`` [m] are merged."""
        meshes = {
            path: tuple(simplify(part, cell=cell, crease=_COARSE_CREASE) for part in parts)
            for path, parts in self.meshes.items()
        }
        return replace(self, meshes=meshes)


@functools.cache
def load_robot_visuals() -> RobotVisuals:
    """Load the Go2's visual meshes at full detail; the second call costs nothing.

    Raises:
        DescriptionError: if the robot's files are missing or hold no triangles.
    """
    description = find_description()
    urdf, folders = str(description.urdf_path), [str(folder) for folder in description.package_dirs]
    model = pin.buildModelFromUrdf(urdf, pin.JointModelFreeFlyer())
    kind, geometry = pin.GeometryType.VISUAL, pin.GeometryModel()
    pin.buildGeomFromUrdf(model, urdf, kind, geometry, folders)
    paths = dict.fromkeys(item.meshPath for item in geometry.geometryObjects)
    return RobotVisuals({path: _surfaces(path) for path in paths}, geometry, model)


def _surfaces(path: str) -> tuple[Surface, ...]:
    return tuple(
        smooth_surface(
            part.points, part.triangles, np.maximum(part.rgba[:3], _BLACK_LIFT), crease=_CREASE
        )
        for part in read_mesh(Path(path))
    )


@final
class PosedRobot:
    """Places the robot's surface in the world."""

    def __init__(self, visuals: RobotVisuals) -> None:
        """Gather the surfaces of each link in the frame of its joint."""
        self._model = visuals.model
        self._data = visuals.model.createData()
        self._foot_frames = [visuals.model.getFrameId(name) for name in FOOT_NAMES]
        self._links = [
            (item.parentJoint, Surface.joined(visuals.meshes[item.meshPath]).placed(item.placement))
            for item in visuals.geometry.geometryObjects
        ]

    def at(self, q: Float[np.ndarray, "19"]) -> Surface:
        """The robot's surface in the configuration ``q`` (quaternion x y z w)."""
        pin.forwardKinematics(self._model, self._data, q)
        return Surface.joined([link.placed(self._data.oMi[joint]) for joint, link in self._links])

    def feet(self, q: Float[np.ndarray, "19"]) -> Float[np.ndarray, "4 3"]:
        """Centres of the four feet in the world [m]."""
        pin.framesForwardKinematics(self._model, self._data, q)
        return np.array([self._data.oMf[frame].translation for frame in self._foot_frames])

    def on_trunk(self, points: Float[np.ndarray, "k 3"]) -> Float[np.ndarray, "k 3"]:
        """Points of the base frame in the world [m], in the configuration placed last."""
        T_world_base = self._data.oMi[1]
        return points @ T_world_base.rotation.T + T_world_base.translation
