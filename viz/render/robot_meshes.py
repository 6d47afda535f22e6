"""The Go2's visual meshes, colours and placements, each mesh loaded once and shared by the legs."""

from __future__ import annotations

import functools
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
import pinocchio as pin

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
