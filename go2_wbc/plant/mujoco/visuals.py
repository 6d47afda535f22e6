"""Looks: the URDF's .dae meshes for MuJoCo, which cannot read them, and those of a user's MJCF."""

from __future__ import annotations

import xml.etree.ElementTree as ET
from collections.abc import Mapping
from pathlib import Path
from typing import NamedTuple

import mujoco
import numpy as np
from jaxtyping import Float

from go2_wbc.errors import DescriptionError
from go2_wbc.legs import JOINT_NAMES
from go2_wbc.robot.description import MeshPart, RobotDescription, read_mesh, solid

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


class DrawnShape(NamedTuple):
    """A shape that MuJoCo's own viewer shows.

    Attributes:
        joint: that moves it; empty for the trunk.
        link, mesh: names of its body and its mesh.
        T_base_shape: its pose in the base frame when all joints are at 0.
    """

    joint: str
    link: str
    mesh: str
    T_base_shape: Float[np.ndarray, "4 4"]


def drawn_shapes(mjcf: Path | str) -> tuple[dict[str, MeshPart], list[DrawnShape]]:
    """The meshes by name, and the shapes that they draw of the robot of a user's MJCF.

    Raises:
        DescriptionError: if MuJoCo cannot read it, or it shows nothing of the robot.
    """
    try:
        model = mujoco.MjModel.from_xml_path(str(mjcf))
        joints = {model.joint(name).bodyid[0]: name for name in JOINT_NAMES}
    except (ValueError, KeyError) as error:
        raise DescriptionError(f"cannot draw the robot of {mjcf}: {error}") from error
    data, base = mujoco.MjData(model), model.body_rootid[next(iter(joints))]
    data.qpos[[model.joint(name).qposadr[0] for name in JOINT_NAMES]] = 0.0
    mujoco.mj_kinematics(model, data)
    T_world_base = _pose(data.xpos[base], data.xmat[base])
    meshes: dict[str, MeshPart] = {}
    shapes = []
    for geom in range(model.ngeom):
        body, rgba = model.geom_bodyid[geom], _rgba(model, geom)
        if model.body_rootid[body] != base or model.geom_group[geom] > VISUAL_GROUP or not rgba[3]:
            continue
        link = model.body(body).name
        while body not in joints and body != base:
            body = model.body_parentid[body]
        found = _shape(model, geom, rgba)
        if found is not None:
            name, part = found
            meshes.setdefault(name, part)
            T_world_shape = _pose(data.geom_xpos[geom], data.geom_xmat[geom])
            T_base_shape = np.linalg.solve(T_world_base, T_world_shape)
            shapes.append(DrawnShape(joints.get(body, ""), link, name, T_base_shape))
    if not shapes:
        raise DescriptionError(f"{mjcf} shows nothing of the robot: no shape in groups 0 to 2")
    return meshes, shapes


def _pose(place: Float[np.ndarray, "3"], turn: Float[np.ndarray, "9"]) -> Float[np.ndarray, "4 4"]:
    T = np.eye(4)
    T[:3, :3], T[:3, 3] = turn.reshape(3, 3), place
    return T


def _rgba(model: mujoco.MjModel, geom: int) -> tuple[float, ...]:
    material = model.geom_matid[geom]
    return tuple((model.mat_rgba[material] if material >= 0 else model.geom_rgba[geom]).tolist())


def _shape(
    model: mujoco.MjModel, geom: int, rgba: tuple[float, ...]
) -> tuple[str, MeshPart] | None:
    """A name and the triangles of a shape in its own frame; None of what is no solid."""
    kind = mujoco.mjtGeom(model.geom_type[geom]).name.removeprefix("mjGEOM_").lower()
    if kind != "mesh":
        found = solid(kind, model.geom_size[geom], rgba)
        return None if found is None else (f"{kind} {model.geom_size[geom]} {rgba}", found)
    mesh = model.mesh(model.geom_dataid[geom])
    points, faces = mesh.vertadr[0], mesh.faceadr[0]
    part = MeshPart(
        model.mesh_vert[points : points + mesh.vertnum[0]].astype(float),
        model.mesh_face[faces : faces + mesh.facenum[0]].astype(int),
        rgba,
    )
    return f"{mesh.id} {rgba}", part
