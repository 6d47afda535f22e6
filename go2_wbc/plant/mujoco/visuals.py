"""Adds the URDF's .dae visual meshes, which MuJoCo cannot read itself, to a MuJoCo spec."""

from __future__ import annotations

import xml.etree.ElementTree as ET
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import mujoco
import numpy as np
from jaxtyping import Float, Int

from go2_wbc.errors import MissingDependency
from go2_wbc.robot.description import RobotDescription

VISUAL_GROUP = 2  # MuJoCo's usual group of visual geoms; collision geoms go to 3, hidden at first
COLLISION_GROUP = 3
_INSTALL_LINE = "pip install trimesh pycollada"


def add_visuals(spec: mujoco.MjSpec, description: RobotDescription) -> None:
    """Adds one geom per coloured part of each visual mesh; physics ignores them.

    Collision meshes of the robot move to ``COLLISION_GROUP``, which viewers hide.

    Raises:
        MissingDependency: if trimesh or pycollada is not installed.
        DescriptionError: if a mesh file is missing.
    """
    for geom in spec.geoms:
        if geom.parent.name != "world":
            geom.group = COLLISION_GROUP
    parts: dict[Path, list[tuple[str, tuple[float, ...]]]] = {}
    for link in ET.parse(description.urdf_path).getroot().findall("link"):
        for visual in link.findall("visual"):
            mesh = visual.find("geometry/mesh")
            if mesh is None:
                continue
            path = description.mesh_path(mesh.get("filename", ""))
            if path not in parts:
                parts[path] = _add_meshes(spec, path)
            _add_geoms(spec.body(link.get("name", "")), parts[path], visual.find("origin"))


def _add_meshes(spec: mujoco.MjSpec, path: Path) -> list[tuple[str, tuple[float, ...]]]:
    """Names and colours of the mesh assets that one file becomes."""
    added: list[tuple[str, tuple[float, ...]]] = []
    for index, part in enumerate(_load_parts(path)):
        name = f"visual_{path.stem}_{index}"
        spec.add_mesh(
            name=name,
            uservert=part.vertices.ravel(),
            userface=part.faces.ravel(),
            inertia=mujoco.mjtMeshInertia.mjMESH_INERTIA_SHELL,
        )
        added.append((name, part.rgba))
    return added


@dataclass(frozen=True, slots=True)
class _Part:
    """One mesh of a file, of one colour."""

    vertices: Float[np.ndarray, "v 3"]
    faces: Int[np.ndarray, "f 3"]
    rgba: tuple[float, ...]


def _load_parts(path: Path) -> list[_Part]:
    try:
        import collada  # noqa: F401 - trimesh reads .dae through it
        import trimesh
    except ImportError as error:
        raise MissingDependency(f"showing the robot's meshes needs: {_INSTALL_LINE}") from error
    scene: Any = trimesh.load_scene(path)
    return [
        _Part(
            vertices=np.asarray(mesh.vertices, dtype=float),
            faces=np.asarray(mesh.faces, dtype=np.int32),
            rgba=tuple(float(value) / 255.0 for value in mesh.visual.material.main_color),
        )
        for mesh in scene.dump()
        if len(mesh.faces)
    ]


def _add_geoms(
    body: mujoco.MjsBody, parts: list[tuple[str, tuple[float, ...]]], origin: ET.Element | None
) -> None:
    position = _triple(origin, "xyz")
    quaternion = np.empty(4)
    mujoco.mju_euler2Quat(quaternion, _triple(origin, "rpy"), "XYZ")  # capitals: fixed axes
    for name, rgba in parts:
        body.add_geom(
            type=mujoco.mjtGeom.mjGEOM_MESH,
            meshname=name,
            pos=position,
            quat=quaternion,
            rgba=rgba,
            contype=0,
            conaffinity=0,
            group=VISUAL_GROUP,
            mass=0.0,
        )


def _triple(origin: ET.Element | None, attribute: str) -> Float[np.ndarray, "3"]:
    text = None if origin is None else origin.get(attribute)
    return np.zeros(3) if text is None else np.array(text.split(), dtype=float)
