"""A robot's visual meshes, each loaded once and shared by the legs, and the robot in a pose."""

from __future__ import annotations

import functools
import logging
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import NamedTuple, final

import coal
import numpy as np
import pinocchio as pin
from jaxtyping import Float, Int
from scipy.spatial.transform import Rotation

from go2_wbc.legs import FOOT_NAMES
from go2_wbc.recording import Recording
from go2_wbc.robot.description import (
    GO2,
    MeshPart,
    RobotDescription,
    find_description,
    is_urdf,
    read_mesh,
    solid,
)
from viz.render.mesh import Surface, simplify, smooth_surface

_CREASE = np.deg2rad(22.0)  # the files have lost their smoothing; 22 deg looks like it
_COARSE_CREASE = np.deg2rad(32.0)  # a coarse surface has larger angles between its faces
_MOST_TRIANGLES, _FINE = 100_000, 0.003  # a robot of more loses details smaller than this [m]
_logger = logging.getLogger(__name__)
_POSE = 7  # numbers of a configuration before those of the joints
_BLACK_LIFT = 34 / 255  # least value of a colour: pure black would show no shape


@dataclass(frozen=True, slots=True, eq=False)
class RobotVisuals:
    """Everything that is drawn of the robot; equal to itself only."""

    meshes: dict[str, tuple[Surface, ...]]
    """The surfaces of each mesh file in its own frame, one for each colour, by its path."""
    geometry: pin.GeometryModel  #: which mesh sits where, in the URDF's order
    model: pin.Model  #: Pinocchio's kinematic model (free flyer)
    description: RobotDescription  #: of the robot

    @property
    def foot_radius(self) -> float:
        """Radius [m] of the feet."""
        return self.description.profile.foot_radius

    def simplified(self, cell: float) -> RobotVisuals:
        """A coarser copy: details below ``cell`` [m] are merged; what is all detail stays."""

        def coarse(part: Surface) -> Surface:
            found = simplify(part, cell=cell, crease=_COARSE_CREASE)
            return found if len(found.triangles) else part

        meshes = {path: tuple(map(coarse, parts)) for path, parts in self.meshes.items()}
        return replace(self, meshes=meshes)


def visuals_of(recording: Recording) -> RobotVisuals:
    """What is drawn of the robot of a recording: its own file, if that is still there.

    Raises:
        ConfigError: for a robot that does not ship.
        DescriptionError: as ``load_robot_visuals``.
    """
    return load_robot_visuals(recording.robot, _file_of(recording))


def bare_robot_of(recording: Recording) -> RobotVisuals:
    """The same without meshes, which take their time; raises the same."""
    return _bare_robot(recording.robot, _file_of(recording))


def _file_of(recording: Recording) -> str:
    file = recording.model_file
    if file and not Path(file).is_file():
        _logger.warning("%s is gone: the robot is drawn as any %s", file, recording.robot)
        return ""
    return file


@functools.cache
def _bare_robot(robot: str, model_file: str) -> RobotVisuals:
    file = model_file if model_file and is_urdf(model_file) else None
    description = find_description(file, robot)
    model = pin.buildModelFromUrdf(str(description.urdf_path), pin.JointModelFreeFlyer())
    return RobotVisuals({}, pin.GeometryModel(), model, description)


@functools.cache
def load_robot_visuals(robot: str = GO2, model_file: str = "") -> RobotVisuals:
    """Load a robot's visual meshes at full detail; the second call costs nothing.

    Args:
        robot: name of its profile.
        model_file: a user's MJCF or URDF of it.

    Raises:
        ConfigError: for a robot that does not ship.
        DescriptionError: if files are missing or hold no triangles.
    """
    kind, geometry = pin.GeometryType.VISUAL, pin.GeometryModel()
    bare = replace(_bare_robot(robot, model_file), geometry=geometry)
    if model_file and not is_urdf(model_file):
        return _as_in_mjcf(model_file, bare)
    folders = [str(folder) for folder in bare.description.package_dirs]
    pin.buildGeomFromUrdf(bare.model, str(bare.description.urdf_path), kind, geometry, folders)
    meshes: dict[str, tuple[Surface, ...]] = {}
    for item in geometry.geometryObjects:
        part = _solid(item)
        if part is not None:
            item.meshPath = item.name
            meshes[item.name] = _surfaces([part])
        elif item.meshPath not in meshes:
            meshes[item.meshPath] = _surfaces(read_mesh(Path(item.meshPath)))
    return _slender(replace(bare, meshes=meshes))


def _slender(visuals: RobotVisuals) -> RobotVisuals:
    """The same, with fewer details if a page could not hold them."""
    parts = (part for parts in visuals.meshes.values() for part in parts)
    is_fine = sum(len(part.triangles) for part in parts) > _MOST_TRIANGLES
    return visuals.simplified(_FINE) if is_fine else visuals


def _solid(item: pin.GeometryObject) -> MeshPart | None:
    shape, kind = item.geometry, type(item.geometry).__name__.lower()
    round_size = [getattr(shape, name, 0.0) for name in ("radius", "halfLength")]
    size = shape.halfSide if kind == "box" else np.array([*round_size, 0.0])
    return solid(kind, size, tuple(item.meshColor.tolist()))


def _as_in_mjcf(path: str, empty: RobotVisuals) -> RobotVisuals:
    """The looks of a user's MJCF on the joints of the robot that it is.

    Where its bodies have their frames is its author's choice: shapes are placed as they lie when
    all joints are at 0, which means the same in both.
    """
    from go2_wbc.plant.mujoco.model import drawn_shapes

    meshes, shapes = drawn_shapes(path)
    data = empty.model.createData()
    pin.forwardKinematics(empty.model, data, pin.neutral(empty.model))
    for k, shape in enumerate(shapes):
        joint = empty.model.getJointId(shape.joint) if shape.joint else 1
        place = data.oMi[joint].inverse() * pin.SE3(shape.T_base_shape)
        link = shape.link if empty.model.existFrame(shape.link) else empty.model.names[joint]
        frame = empty.model.getFrameId(link)
        item = pin.GeometryObject(f"shape{k}", joint, frame, place, coal.Sphere(0.0), shape.mesh)
        empty.geometry.addGeometryObject(item)
    looks = {name: _surfaces([part]) for name, part in meshes.items()}
    return _slender(replace(empty, meshes=looks))


def _surfaces(parts: Sequence[MeshPart]) -> tuple[Surface, ...]:
    return tuple(
        smooth_surface(
            part.points, part.triangles, np.maximum(part.rgba[:3], _BLACK_LIFT), crease=_CREASE
        )
        for part in parts
    )


@final
class PosedRobot:
    """Places the robot's surface in the world."""

    def __init__(self, visuals: RobotVisuals) -> None:
        self._visuals, self._model = visuals, visuals.model
        self._data = visuals.model.createData()
        self._foot_frames = [visuals.model.getFrameId(name) for name in FOOT_NAMES]

    @functools.cached_property
    def _links(self) -> list[tuple[int, Surface]]:
        """The surfaces of each link in the frame of its joint; who asks for feet needs none."""
        meshes = self._visuals.meshes
        return [
            (item.parentJoint, Surface.joined(meshes[item.meshPath]).placed(item.placement))
            for item in self._visuals.geometry.geometryObjects
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


def feet_along(visuals: RobotVisuals, q: Float[np.ndarray, "n 19"]) -> Float[np.ndarray, "n 4 3"]:
    """What ``PosedRobot.feet`` says of every configuration, to a micrometre."""
    legs, single = _legs_of(visuals), np.float32  # half the time, of sines a tenth
    base = Rotation.from_quat(q[:, 3:7]).as_matrix().transpose(1, 2, 0).astype(single, order="C")
    joints = np.ascontiguousarray(q.T[_POSE:], dtype=single)
    sines, cosines, p = np.sin(joints), np.cos(joints), legs.p_feet
    for rows, turns, places in legs.joints:
        both = turns @ p
        p = both[:, :3] + places + sines[rows] * both[:, 3:6] + (1.0 - cosines[rows]) * both[:, 6:]
    found = np.empty((len(q), 4, 3))
    for leg, own in enumerate(p):
        found[:, leg] = q[:, :3] + (base * own).sum(axis=1).T
    return found


class _Legs(NamedTuple):
    """The joints of the four legs side by side, from the calves to the hips."""

    p_feet: Float[np.ndarray, "4 3 1"]  #: in the frames of the calves [m]
    joints: list[
        tuple[Int[np.ndarray, "4 1"], Float[np.ndarray, "4 9 3"], Float[np.ndarray, "4 3 1"]]
    ]
    """Rows of the joints; the turns that are there, across and back (Rodrigues: about a unit axis
    with the cross product K a joint turns by 1 + sin K + (1 - cos) K^2); where they are [m]."""


@functools.cache
def _legs_of(visuals: RobotVisuals) -> _Legs:
    model, found = visuals.model, []
    feet = [model.frames[model.getFrameId(name)] for name in FOOT_NAMES]
    chains = [model.supports[foot.parentJoint].tolist()[:1:-1] for foot in feet]
    for row in zip(*chains, strict=True):
        placed = [model.jointPlacements[joint] for joint in row]
        axes = (np.ravel(model.joints[joint].createData().S)[3:] for joint in row)
        turn, K = (
            np.array([T.rotation for T in placed]),
            np.array([pin.skew(axis) for axis in axes]),
        )
        turns = np.concatenate([turn, turn @ K, turn @ K @ K], axis=1).astype(np.float32)
        places = np.array([T.translation for T in placed], np.float32)[:, :, None]
        found.append((np.array([[model.idx_qs[joint] - _POSE] for joint in row]), turns, places))
    p_feet = np.array([foot.placement.translation for foot in feet], np.float32)
    return _Legs(p_feet[:, :, None], found)
