"""The Go2's visual meshes, colours and placements, each mesh loaded once and shared by the legs."""

from __future__ import annotations

import functools
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pinocchio as pin
import trimesh
from jaxtyping import Float
from trimesh.visual import TextureVisuals

from go2_wbc.errors import DescriptionError
from go2_wbc.robot.description import find_description
from viz.render.mesh import SurfaceMesh, simplify, smooth_surface

_CREASE = np.deg2rad(22.0)  # the files have lost their smoothing; 22 deg looks like it
_COARSE_CREASE = np.deg2rad(32.0)  # a coarse surface has larger angles between its faces
_BLACK_LIFT = 34  # least 8-bit value of a colour: pure black would show no shape

_UNPAINTED = (171, 177, 197)  # a part without a material gets the trunk's grey


@dataclass(frozen=True, slots=True)
class MeshPart:
    """All faces of one mesh file that have one colour.

    Attributes:
        surface: geometry in the frame of the visual.
        color: red, green, blue in 0..255.
    """

    surface: SurfaceMesh
    color: tuple[int, int, int]


@dataclass(frozen=True, slots=True)
class Visual:
    """One visual of the URDF: which mesh sits where.

    Attributes:
        name: name of the link, such as ``FL_thigh``.
        mesh: key into ``RobotVisuals.meshes``.
        joint: index of the Pinocchio joint that carries it.
        T_joint_visual: homogeneous placement in the joint's frame.
    """

    name: str
    mesh: str
    joint: int
    T_joint_visual: Float[np.ndarray, "4 4"]


@dataclass(frozen=True, slots=True)
class RobotVisuals:
    """Everything that is drawn of the robot.

    Attributes:
        meshes: the parts of each mesh file, by file stem.
        visuals: the placements of the meshes, in the URDF's order.
        model: Pinocchio's kinematic model (free flyer).
    """

    meshes: dict[str, tuple[MeshPart, ...]]
    visuals: tuple[Visual, ...]
    model: pin.Model

    def simplified(self, cell: float) -> RobotVisuals:
        """A coarser copy: details below ``cell`` [m] are merged."""
        meshes = {
            name: tuple(
                MeshPart(simplify(part.surface, cell=cell, crease=_COARSE_CREASE), part.color)
                for part in parts
            )
            for name, parts in self.meshes.items()
        }
        return RobotVisuals(meshes, self.visuals, self.model)


@functools.cache
def load_robot_visuals() -> RobotVisuals:
    """Load the Go2's visual meshes at full detail; the second call costs nothing.

    Raises:
        DescriptionError: if the robot's files are missing or hold no triangles.
    """
    description = find_description()
    model = pin.buildModelFromUrdf(str(description.urdf_path), pin.JointModelFreeFlyer())
    geometry = pin.GeometryModel()
    pin.buildGeomFromUrdf(
        model,
        str(description.urdf_path),
        pin.GeometryType.VISUAL,
        geometry,
        [str(folder) for folder in description.package_dirs],
    )
    visuals = tuple(_visual(model, item) for item in geometry.geometryObjects)
    paths = {Path(item.meshPath).stem: Path(item.meshPath) for item in geometry.geometryObjects}
    meshes = {name: load_mesh_file(path) for name, path in paths.items()}
    return RobotVisuals(meshes, visuals, model)


def load_mesh_file(path: Path) -> tuple[MeshPart, ...]:
    """Read one COLLADA file, one part per colour.

    Raises:
        DescriptionError: if the file cannot be read or holds no triangles.
    """
    try:
        scene = trimesh.load_scene(path)
    except (OSError, ValueError) as error:
        raise DescriptionError(f"cannot read the mesh {path}: {error}") from error
    parts = []
    for node in scene.graph.nodes_geometry:
        T_visual_node, name = scene.graph[node]
        mesh = scene.geometry[name]
        points = trimesh.transform_points(mesh.vertices, T_visual_node)
        surface = smooth_surface(points, np.asarray(mesh.faces), crease=_CREASE)
        parts.append(MeshPart(surface, _color(mesh)))
    if not parts:
        raise DescriptionError(f"the mesh {path} holds no triangles")
    return tuple(parts)


def _visual(model: pin.Model, item: pin.GeometryObject) -> Visual:
    link = model.frames[item.parentFrame].name
    return Visual(link, Path(item.meshPath).stem, item.parentJoint, item.placement.homogeneous)


def _color(mesh: trimesh.Trimesh) -> tuple[int, int, int]:
    if not isinstance(mesh.visual, TextureVisuals):
        return _UNPAINTED
    red, green, blue = (
        max(int(value), _BLACK_LIFT) for value in mesh.visual.material.main_color[:3]
    )
    return red, green, blue
