"""Adds the URDF's .dae visual meshes, which MuJoCo cannot read itself, to a MuJoCo spec."""

from __future__ import annotations

import xml.etree.ElementTree as ET
from collections.abc import Mapping
from pathlib import Path

import mujoco
import numpy as np

from go2_wbc.robot.description import RobotDescription, read_mesh

VISUAL_GROUP = 2  # MuJoCo's usual group of visual geoms; collision geoms go to 3, hidden at first
COLLISION_GROUP = 3


def add_visuals(spec: mujoco.MjSpec, description: RobotDescription) -> None:
    """Adds one geom per coloured part of each visual mesh; physics ignores them.

    Collision meshes of the robot move to ``COLLISION_GROUP``, which viewers hide.

    Raises:
        DescriptionError: if a mesh file is missing or cannot be read.
    """
    for geom in spec.geoms:
        if geom.parent.name != "world":
            geom.group = COLLISION_GROUP
    colors: dict[Path, dict[str, tuple[float, ...]]] = {}
    for link in ET.parse(description.urdf_path).getroot().findall("link"):
        for visual in link.findall("visual"):
            mesh = visual.find("geometry/mesh")
            if mesh is None:
                continue
            path = description.mesh_path(mesh.get("filename", ""))
            if path not in colors:
                colors[path] = _add_meshes(spec, path)
            _add_geoms(spec.body(link.get("name", "")), colors[path], visual.find("origin"))


def _add_meshes(spec: mujoco.MjSpec, path: Path) -> dict[str, tuple[float, ...]]:
    """The colours of the mesh assets that one file becomes, by name."""
    colors = {}
    for index, part in enumerate(read_mesh(path)):
        name = f"visual_{path.stem}_{index}"
        spec.add_mesh(
            name=name,
            uservert=part.points.ravel(),
            userface=part.triangles.astype(np.int32).ravel(),
            inertia=mujoco.mjtMeshInertia.mjMESH_INERTIA_SHELL,
        )
        colors[name] = part.rgba
    return colors


def _add_geoms(
    body: mujoco.MjsBody, colors: Mapping[str, tuple[float, ...]], origin: ET.Element | None
) -> None:
    place = {} if origin is None else origin.attrib
    position, angles = (
        np.array(place.get(name, "0 0 0").split(), dtype=float) for name in ("xyz", "rpy")
    )
    quaternion = np.empty(4)
    mujoco.mju_euler2Quat(quaternion, angles, "XYZ")  # capitals: fixed axes
    for name, rgba in colors.items():
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
