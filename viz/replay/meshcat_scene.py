"""Builds the replay's scene with meshcat, without a server and with each mesh stored once.

meshcat's own static export repeats a mesh for every link that shows it. Here a recording window
takes the place of the server: it keeps the commands, and meshes in them are references that the
page resolves against one table.
"""

from __future__ import annotations

from typing import final

import meshcat
import meshcat.geometry as shapes
import numpy as np
import pinocchio as pin
from meshcat.commands import SetObject, SetTransform
from meshcat.transformations import rotation_matrix, translation_matrix

from go2_wbc.legs import LEGS
from viz.palette import FORCE, INK, LEG_COLORS
from viz.render.mesh import Surface
from viz.render.robot_meshes import RobotVisuals
from viz.replay.packing import Pack

_NORMAL_LEVELS = 127  # of a signed 8-bit number
_SHAFT_RADIUS, _HEAD_RADIUS, _HEAD_LENGTH = 0.007, 0.018, 0.035  # [m] force arrow
_COM_RADIUS = 0.016  # [m]
_SPOT_RADIUS = 0.014  # [m]
_NAME_KEYS = ("uuid", "geometry", "material")
_UPRIGHT = rotation_matrix(np.pi / 2, [1, 0, 0])  # meshcat's cylinders lie along y


@final
class RecordingWindow:
    """Takes the place of meshcat's window: keeps the commands instead of sending them."""

    def __init__(self) -> None:
        """Start with no command."""
        self.commands: list[object] = []
        self._names: dict[str, str] = {}

    def send(self, command: SetObject | SetTransform) -> None:
        """Keep one meshcat command in the form that the browser reads."""
        self.commands.append(self._plain(command.lower()))

    def _plain(self, value: object, key: str = "") -> object:
        """The same in types that JSON knows, with counted names for meshcat's random ones."""
        if isinstance(value, dict):
            return {name: self._plain(item, name) for name, item in value.items()}
        if isinstance(value, list | tuple):
            return [self._plain(item) for item in value]
        if isinstance(value, np.generic):
            return value.item()
        if key in _NAME_KEYS and isinstance(value, str):
            return self._names.setdefault(value, f"{len(self._names)}")
        return value


@final
class SharedMesh(shapes.Geometry):
    """A geometry that refers to a row of the page's mesh table."""

    def __init__(self, index: int) -> None:
        """Refer to mesh ``index``."""
        super().__init__()
        self.uuid = f"mesh-{index}"
        self._index = index

    def lower(self, _object_data: dict[str, object]) -> dict[str, object]:
        """The reference, in the place of the vertices."""
        return {"uuid": self.uuid, "type": "SharedMesh", "index": self._index}


def robot_scene(visuals: RobotVisuals, pack: Pack) -> dict[str, object]:
    """The commands that build the scene, and how the page moves it.

    Args:
        visuals: the robot.
        pack: receives the vertices.

    Returns:
        Header entries: ``meshes`` (count), ``commands``, ``base`` (path of the moving trunk) and
        ``joints`` (path and axis of each joint, in the order of q).
    """
    window = RecordingWindow()
    scene = meshcat.Visualizer(window=window)
    table = _add_meshes(visuals, pack)
    paths = _joint_paths(visuals.model)
    turning = list(paths.items())[1:]
    for joint, path in turning:
        placement = visuals.model.jointPlacements[joint].homogeneous
        scene[path.removesuffix("/turn")].set_transform(placement)
    for item in visuals.geometry.geometryObjects:
        link = visuals.model.frames[item.parentFrame].name
        for row, part in enumerate(visuals.meshes[item.meshPath]):
            node = scene[f"{paths[item.parentJoint]}/{link}_{row}"]
            node.set_object(SharedMesh(table[item.meshPath, row]), _material(part))
            node.set_transform(item.placement.homogeneous)
    _add_markers(scene)
    # The axis of a revolute joint, in its own frame, is the lower half of its motion subspace.
    axes = [np.ravel(visuals.model.joints[joint].createData().S)[3:] for joint, _ in turning]
    joints = [
        {"path": path, "axis": axis.tolist()} for (_, path), axis in zip(turning, axes, strict=True)
    ]
    return {
        "meshes": len(table),
        "commands": window.commands,
        "base": paths[1],
        "joints": joints,
    }


def _add_meshes(visuals: RobotVisuals, pack: Pack) -> dict[tuple[str, int], int]:
    """Store each mesh once; returns its row in the table by file and part."""
    table: dict[tuple[str, int], int] = {}
    for path, parts in visuals.meshes.items():
        for row, part in enumerate(parts):
            index = table[path, row] = len(table)
            pack.add_quantised(f"mesh{index}.points", part.points)
            normals = np.round(part.normals * _NORMAL_LEVELS).astype(np.int8)
            pack.add(f"mesh{index}.normals", normals)
            kind = np.uint16 if len(part.points) <= np.iinfo(np.uint16).max + 1 else np.uint32
            pack.add(f"mesh{index}.triangles", part.triangles.astype(kind))
    return table


def _joint_paths(model: pin.Model) -> dict[int, str]:
    """Scene path of each joint's moving frame; a fixed frame above it holds its placement."""
    paths = {1: "robot/base/turn"}
    for joint in range(2, model.njoints):
        paths[joint] = f"{paths[model.parents[joint]]}/{model.names[joint]}/turn"
    return paths


def _material(part: Surface) -> shapes.MeshPhongMaterial:
    color = int.from_bytes(np.round(255 * part.colors[0]).astype(np.uint8).tobytes())
    return shapes.MeshPhongMaterial(color=color, side=0, shininess=45, specular=0x3A3A3A)


def _add_markers(scene: meshcat.Visualizer) -> None:
    """Unit force arrows and the CoM's markers; the page moves and scales them."""
    for leg, color in zip(LEGS, LEG_COLORS, strict=True):
        arrow = scene[f"forces/{leg.name}"]
        material = _flat(FORCE)
        arrow["shaft/body"].set_object(shapes.Cylinder(1.0, _SHAFT_RADIUS), material)
        arrow["shaft/body"].set_transform(translation_matrix([0, 0, 0.5]) @ _UPRIGHT)
        cone = shapes.Cylinder(_HEAD_LENGTH, radiusTop=0.0, radiusBottom=_HEAD_RADIUS)
        arrow["head/body"].set_object(cone, material)
        arrow["head/body"].set_transform(translation_matrix([0, 0, _HEAD_LENGTH / 2]) @ _UPRIGHT)
        ring = shapes.Cylinder(0.002, 0.032)
        scene[f"contacts/{leg.name}"].set_object(ring, _flat(color, glow=0.15))
        scene[f"contacts/{leg.name}/<object>"].set_transform(_UPRIGHT)
    scene["com/ball"].set_object(shapes.Sphere(_COM_RADIUS), _flat(INK))
    scene["com/line/body"].set_object(shapes.Cylinder(1.0, 0.002), _flat(INK))
    scene["com/line/body"].set_transform(translation_matrix([0, 0, 0.5]) @ _UPRIGHT)
    scene["com/spot"].set_object(shapes.Cylinder(0.003, _SPOT_RADIUS), _flat(INK))
    scene["com/spot/<object>"].set_transform(_UPRIGHT)


def _flat(color: str, *, glow: float = 0.4) -> shapes.MeshLambertMaterial:
    value = int(color.removeprefix("#"), 16)
    return shapes.MeshLambertMaterial(color=value, emissive=value, emissiveIntensity=glow)
