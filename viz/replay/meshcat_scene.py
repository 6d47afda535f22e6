"""Builds the replay's scene with meshcat, without a server and with each mesh stored once.

meshcat's own static export repeats a mesh for every link that shows it. Here the commands are kept
instead of being sent, and meshes in them are references that the page resolves against one table.
"""

from __future__ import annotations

import base64
import gzip
import json
import re
import uuid
from collections import Counter
from collections.abc import Mapping
from types import SimpleNamespace
from typing import final

import meshcat
import meshcat.geometry as shapes
import numpy as np
import pinocchio as pin
from jaxtyping import Shaped
from meshcat.transformations import rotation_matrix, translation_matrix

from go2_wbc.legs import LEGS
from viz.render.mesh import Surface
from viz.render.robot_meshes import RobotVisuals
from viz.style import FORCE, INK, LEG_COLORS

_ALIGNMENT = 8  # [bytes] typed arrays in a browser must start at a multiple of their item size
_QUANTISED_LEVELS = 65535  # of an unsigned 16-bit number


@final
class Pack:
    """Collects arrays; ``packed`` gives them as one gzipped base64 text.

    Layout, little-endian: length of the header (uint32), header (JSON, UTF-8), padding, arrays.
    """

    def __init__(self) -> None:
        """Start empty."""
        self._blobs: list[bytes] = []
        self._entries: dict[str, dict[str, object]] = {}
        self._size = 0

    def add(
        self, name: str, array: Shaped[np.ndarray, "..."], extra: Mapping[str, object] | None = None
    ) -> None:
        """Store an array of one of the types that a browser knows; ``extra`` is told with it."""
        blob = np.ascontiguousarray(array).tobytes()
        kind = f"{array.dtype.name.capitalize()}Array"  # float32 is a browser's Float32Array
        entry = {"type": kind, "shape": array.shape, "offset": self._size}
        self._entries[name] = {**entry, **(extra or {})}
        blob += b"\0" * (-len(blob) % _ALIGNMENT)
        self._blobs.append(blob)
        self._size += len(blob)

    def add_quantised(self, name: str, array: Shaped[np.ndarray, "n k"]) -> None:
        """Store each column as 16-bit numbers between its own extremes."""
        low = array.min(axis=0, initial=0.0)
        span = np.maximum(array.max(axis=0, initial=0.0) - low, 1e-9)
        levels = np.round((array - low) / span * _QUANTISED_LEVELS).astype(np.uint16)
        scale = span / _QUANTISED_LEVELS
        self.add(name, levels, {"low": low.tolist(), "scale": scale.tolist()})

    def packed(self, header: dict[str, object]) -> str:
        """Everything, with ``header`` beside the table of the arrays."""
        table = json.dumps({**header, "arrays": self._entries}, separators=(",", ":"))
        head = table.encode()
        start = 4 + len(head)
        padding = b"\0" * (-start % _ALIGNMENT)
        content = len(head).to_bytes(4, "little") + head + padding + b"".join(self._blobs)
        return compressed_text(content)


def compressed_text(content: bytes) -> str:
    """Gzipped and base64; the same content always gives the same text."""
    return base64.b64encode(gzip.compress(content, 9, mtime=0)).decode("ascii")


_NORMAL_LEVELS = 127  # of a signed 8-bit number
_SHAFT_RADIUS, _HEAD_RADIUS, _HEAD_LENGTH = 0.007, 0.018, 0.035  # [m] force arrow
_COM_RADIUS = 0.016  # [m]
_SPOT_RADIUS = 0.014  # [m]
_UUID = re.compile(r"[0-9a-f]{8}(?:-[0-9a-f]{4}){3}-[0-9a-f]{12}")
_UPRIGHT = rotation_matrix(np.pi / 2, [1, 0, 0])  # meshcat's cylinders lie along y


@final
class SharedMesh(shapes.Geometry):
    """A geometry that refers to a row of the page's mesh table."""

    def __init__(self, index: int) -> None:
        """Refer to mesh ``index``."""
        self.uuid = str(uuid.UUID(int=index))
        self._index = index

    def lower(self, _object_data: dict[str, object]) -> dict[str, object]:
        """The reference, in the place of the vertices."""
        return {"uuid": self.uuid, "type": "SharedMesh", "index": self._index}


def robot_scene(visuals: RobotVisuals, pack: Pack) -> dict[str, object]:
    """The commands that build the scene, and how the page moves it; ``pack`` gets the vertices.

    Returns:
        Header entries: ``meshes`` (count), ``commands``, ``base`` (path of the moving trunk) and
        ``joints`` (path and axis of each joint, in the order of q).
    """
    commands: list[object] = []
    window = SimpleNamespace(send=lambda command: commands.append(command.lower()))
    scene, model = meshcat.Visualizer(window=window), visuals.model
    table = _add_meshes(visuals, pack)
    paths = _joint_paths(model)
    joints = []
    for joint in range(2, model.njoints):
        fixed = scene[paths[joint].removesuffix("/turn")]
        fixed.set_transform(model.jointPlacements[joint].homogeneous)
        # The lower half of a revolute joint's motion subspace is its axis, in its own frame.
        axis = np.ravel(model.joints[joint].createData().S)[3:].tolist()
        joints.append({"path": paths[joint], "axis": axis})
    used: Counter[str] = Counter()
    for item in visuals.geometry.geometryObjects:
        link = "base" if item.parentJoint == 1 else model.frames[item.parentFrame].name
        for row, part in enumerate(visuals.meshes[item.meshPath]):
            node = scene[f"{paths[item.parentJoint]}/{link}_{used[link]}"]
            used[link] += 1
            node.set_object(SharedMesh(table[item.meshPath, row]), _material(part))
            node.set_transform(item.placement.homogeneous)
    _add_markers(scene)
    return {"meshes": len(table), "commands": _plain(commands), "base": paths[1], "joints": joints}


def _plain(commands: list[object]) -> object:
    """The commands in types that JSON knows, with counted names for meshcat's random ones."""
    names: dict[str, str] = {}
    text = json.dumps(commands, default=np.generic.item)
    return json.loads(_UUID.sub(lambda found: names.setdefault(found[0], f"{len(names)}"), text))


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
    cone = shapes.Cylinder(_HEAD_LENGTH, radiusTop=0.0, radiusBottom=_HEAD_RADIUS)
    for leg, color in zip(LEGS, LEG_COLORS, strict=True):
        arrow, orange = scene[f"forces/{leg.name}"], _flat(FORCE)
        _put_upright(arrow["shaft/body"], shapes.Cylinder(1.0, _SHAFT_RADIUS), orange, 0.5)
        _put_upright(arrow["head/body"], cone, orange, _HEAD_LENGTH / 2)
        ring = shapes.Cylinder(0.002, 0.032)
        _put_upright(scene[f"contacts/{leg.name}"], ring, _flat(color, glow=0.15))
    scene["com/ball"].set_object(shapes.Sphere(_COM_RADIUS), _flat(INK))
    _put_upright(scene["com/line/body"], shapes.Cylinder(1.0, 0.002), _flat(INK), 0.5)
    _put_upright(scene["com/spot"], shapes.Cylinder(0.003, _SPOT_RADIUS), _flat(INK))


def _put_upright(
    node: meshcat.Visualizer, shape: shapes.Geometry, material: shapes.Material, middle: float = 0.0
) -> None:
    """Show a cylinder upright, its middle this far [m] above the node."""
    node.set_object(shape, material)
    node["<object>"].set_transform(translation_matrix([0, 0, middle]) @ _UPRIGHT)


def _flat(color: str, *, glow: float = 0.4) -> shapes.MeshLambertMaterial:
    value = int(color.removeprefix("#"), 16)
    return shapes.MeshLambertMaterial(color=value, emissive=value, emissiveIntensity=glow)
