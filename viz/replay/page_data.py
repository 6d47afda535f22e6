"""What a page or a file for other viewers holds of a recording.

A page has the scene once, and what happens in it at even steps. It needs nothing else: no server,
no network.

The scene is built with meshcat, without a server and with each mesh stored once. meshcat's own
static export repeats a mesh for every link that shows it. Here the commands are kept instead of
being sent, and meshes in them are references that the page resolves against one table.
"""

from __future__ import annotations

import html
import json
import re
import uuid
from collections import Counter
from collections.abc import Mapping
from dataclasses import asdict, dataclass
from importlib import resources
from pathlib import Path
from types import SimpleNamespace
from typing import Any, NamedTuple, final

import meshcat
import meshcat.geometry as shapes
import numpy as np
import pinocchio as pin
from jaxtyping import Float
from meshcat.transformations import rotation_matrix, translation_matrix

from go2_wbc.arguments import typed
from go2_wbc.errors import ConfigError
from go2_wbc.files import checked_output, write_atomically
from go2_wbc.legs import LEGS
from go2_wbc.recording import Recording, Span
from viz.content import ReplayContent, Verdict, checked_content
from viz.render.camera import smoothed
from viz.render.ground import COLORS, grid_of
from viz.render.mesh import Surface
from viz.render.robot_meshes import RobotVisuals, bare_robot_of, feet_along, visuals_of
from viz.replay.packing import Pack, Packed, compressed_text
from viz.style import FORCE, INK, LEG_COLORS

_NORMAL_LEVELS = 127  # of a signed 8-bit number
_SHAFT_RADIUS, _HEAD_RADIUS, _HEAD_LENGTH = 0.007, 0.018, 0.035  # [m] force arrow
_COM_RADIUS = 0.016  # [m]
_SPOT_RADIUS = 0.014  # [m]
_SIDES = 16  # of a cylinder; meshcat's 50 cost a view that is drawn in software 5 ms a frame
_UUID = re.compile(r"[0-9a-f]{8}(?:-[0-9a-f]{4}){3}-[0-9a-f]{12}")
_UPRIGHT = rotation_matrix(np.pi / 2, [1, 0, 0])  # meshcat's cylinders lie along y


@final
class SharedMesh(shapes.Geometry):
    """A geometry that refers to a row of the page's mesh table."""

    def __init__(self, index: int) -> None:
        self.uuid = str(uuid.UUID(int=index))
        self._index = index

    def lower(self, _object_data: dict[str, object]) -> dict[str, object]:
        """The reference, in the place of the vertices."""
        return {"uuid": self.uuid, "type": "SharedMesh", "index": self._index}


def robot_scene(visuals: RobotVisuals, pack: Pack) -> dict[str, object]:
    """The commands that build the scene, and how the page moves it; ``pack`` gets the vertices.

    Returns:
        Header entries: ``meshes`` (count), ``commands``, ``base`` (path of the moving trunk) and
        ``joints`` (path, axis and limits [rad] of each joint, in
        the order of q).
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
        row = model.joints[joint].idx_q
        limits = model.lowerPositionLimit[row], model.upperPositionLimit[row]
        low, high = (float(limit) for limit in limits)
        joints.append({"path": paths[joint], "axis": axis, "low": low, "high": high})
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
    node: meshcat.Visualizer, shape: shapes.Cylinder, material: shapes.Material, middle: float = 0.0
) -> None:
    """Show a cylinder upright, its middle this far [m] above the node."""
    shape.radialSegments = _SIDES
    node.set_object(shape, material)
    node["<object>"].set_transform(translation_matrix([0, 0, middle]) @ _UPRIGHT)


def _flat(color: str, *, glow: float = 0.4) -> shapes.MeshLambertMaterial:
    value = int(color.removeprefix("#"), 16)
    return shapes.MeshLambertMaterial(color=value, emissive=value, emissiveIntensity=glow)


WORLD, BASE = "world", "base"


class Link(NamedTuple):
    """A link that moves, by its name in the URDF."""

    name: str
    parent: str  #: the link that it hangs on, ``world`` for the base
    p: Float[np.ndarray, "n 3"]  #: (n, 3) its place [m] in the parent's frame
    quaternion: Float[np.ndarray, "n 4"]  #: (n, 4) its orientation x y z w in the parent's frame


def links_of(model: pin.Model, q: Float[np.ndarray, "n 19"]) -> tuple[Link, ...]:
    """The base and the twelve links of the legs, parents first."""
    data, poses = model.createData(), np.empty((model.njoints, len(q), 7))
    for row, configuration in enumerate(q):
        pin.forwardKinematics(model, data, configuration)
        poses[:, row] = [pin.SE3ToXYZQUAT(T) for T in data.liMi]
    names = [WORLD, BASE, *(name.removesuffix("_joint") for name in list(model.names)[2:])]
    return tuple(
        Link(names[joint], names[model.parents[joint]], poses[joint, :, :3], poses[joint, :, 3:])
        for joint in range(1, model.njoints)
    )


def label_starts(recording: Recording) -> list[int]:
    """The rows from which on the robot did something else."""
    before = ("", *recording.labels)
    return [row for row, label in enumerate(recording.labels) if label != before[row]]


_FORCE_PERCENTILE = 99.5  # a touchdown spike beyond it may be cut off in the contact strip
_LEAST_FORCE_SCALE = 50.0  # [N] a full row of the contact strip is at least this much
_FRAME_RATE = 50.0  # [Hz] finer is not seen at 60 Hz screens, swings stay smooth
_MOST_FRAMES = 6000  # keeps the page of a long recording small; the rate drops instead
_CAMERA_SMOOTHING = 0.7  # [s]
UNKNOWN = -32768  #: Height [mm] of a cell of ground that was not seen
_PLAIN = {"stance": np.uint8, "margin": np.float32, "torque": np.float32}
"""How frames are stored that are not 16-bit numbers between their extremes."""


def scene_text(recording: Recording) -> str:
    """The robot of the recording and the markers, packed: the same for every page of it."""
    pack, visuals = Pack(), visuals_of(recording)
    scene = robot_scene(visuals, pack)
    legs = {"legs": [leg.name for leg in LEGS], "leg_colors": LEG_COLORS}
    header = {**scene, **legs, "foot_radius": visuals.foot_radius}
    return compressed_text(pack.packed(header).data)


@dataclass(frozen=True, slots=True)
class Prepared:
    """What happens, as a page needs it: a fraction of it."""

    pack: Pack
    header: Mapping[str, object]
    is_feasible: bool
    editor: Mapping[str, object] | None  #: see ``ReplayContent``

    def packed(self, title: str, version: str = "") -> Packed:
        """All of it; ``version`` tells one block of a live page from the next."""
        own = {"title": title, "version": version, "editor": self.editor}
        return self.pack.packed({**self.header, **own})


def prepared(content: ReplayContent | Prepared) -> Prepared:
    """What a page needs of ``content``."""
    if isinstance(content, Prepared):
        return content
    pack, verdict = Pack(), content.verdict
    rate, frames = replay_frames(content.recording)
    highest = float(np.percentile(frames["forces"], _FORCE_PERCENTILE))
    header: dict[str, object] = {
        "is_plan": content.is_plan,
        **_add_frames(pack, "", rate, frames),
        "labels": [[s.start, s.end, s.label] for s in content.recording.spans()],
        "force_scale": max(highest, _LEAST_FORCE_SCALE),
        "beats": list(content.beats),
        "bar": content.bar,
        "end_pose": content.end_pose,
        "has_sound": bool(content.sound),
        "sliders": [asdict(slider) for slider in content.sliders],
        "verdict": None,
        "proposal": None,
        "ghost": None,
        "ground": None,
        "written": None,
        "binding": None,
    }
    if content.recording.is_explained:
        header["binding"] = _binding(content.recording.binding(), 1.0 / rate)
    if len(content.recording.ground):
        grid = grid_of(content.recording.ground)
        heights = np.where(np.isnan(grid.z), UNKNOWN, np.round(1000.0 * grid.z))
        pack.add("ground", heights.astype(np.int16))
        place = {"x": grid.x, "y": grid.y, "cell": grid.cell, "shape": grid.z.shape}
        header["ground"] = {**place, "low": float(np.nanmin(grid.z)), "colors": COLORS}
    if content.sound:
        pack.add("sound", np.frombuffer(content.sound, np.uint8))
    for name, one in (("verdict", verdict), ("proposal", content.proposal)):
        if one is not None:
            header[name] = _add_verdict(pack, one, "" if one is verdict else f"{name}.")
    for name, other in (("ghost", content.ghost), ("written", content.written)):
        if other is not None:
            header[name] = _add_frames(pack, f"{name}.", *replay_frames(other))
    return Prepared(pack, header, verdict is None or verdict.ok, content.editor)


def replay_frames(recording: Recording) -> tuple[float, dict[str, np.ndarray]]:
    """A recording of any, also uneven, rate at even steps: frames per second, and rows by name.

    ``q`` has neighbouring quaternions in the same half-space, ``feet`` are the centres FL FR RL RR
    and ``com`` the centre of mass [m], ``target`` is the smoothed place of the base on the ground
    [m], ``stance`` the planned contacts. Of ``forces`` [N] and ``torque`` (the greatest of |torque|
    / limit of any joint) it is the largest in the step, of the support's ``margin`` [m] the least,
    so that a short peak is not lost; nan where that is undefined.
    """
    rate = min(_FRAME_RATE, (_MOST_FRAMES - 1) / recording.duration)
    count = max(2, int(np.floor(recording.duration * rate)) + 1)
    rate = (count - 1) / recording.duration
    wanted = recording.time[0] + np.arange(count) / rate
    last = len(recording.time) - 1
    rows = np.minimum(np.searchsorted(recording.time, wanted - 0.25 / rate), last)
    rows[-1] = last
    robot, q = bare_robot_of(recording), _continuous(recording.q[rows])
    feet = feet_along(robot, q)
    heights = feet[:, :, 2].mean(axis=1) - robot.foot_radius
    heights = heights if len(recording.ground) else np.zeros(count)
    below = np.interp(recording.time, wanted, heights)
    places = np.column_stack([recording.q[:, :2], below])
    target = smoothed(recording.time, places, _CAMERA_SMOOTHING)
    ratios = np.ascontiguousarray(np.abs(recording.tau).T)
    ratios /= np.array(robot.description.efforts)[:, None]
    return rate, {
        "q": q,
        "feet": feet.reshape(-1, 12),
        "com": recording.p_world_com[rows],
        "target": target[rows],
        "forces": np.maximum.reduceat(recording.foot_forces, rows),
        "stance": recording.stance[rows],
        "margin": np.fmin.reduceat(recording.support_margin, rows),
        "torque": np.maximum.reduceat(ratios.max(axis=0), rows),
    }


def _continuous(q: Float[np.ndarray, "n 19"]) -> Float[np.ndarray, "n 19"]:
    """Flip quaternions so that neighbours never differ by the sign alone."""
    flips = np.sum(q[1:, 3:7] * q[:-1, 3:7], axis=1) < 0
    signs = np.concatenate([[1.0], np.cumprod(np.where(flips, -1.0, 1.0))])
    result = q.copy()
    result[:, 3:7] *= signs[:, None]
    return result


def _add_frames(
    pack: Pack, prefix: str, rate: float, frames: Mapping[str, np.ndarray]
) -> dict[str, object]:
    for name, values in frames.items():
        if name in _PLAIN:
            pack.add(f"{prefix}{name}", values.astype(_PLAIN[name]))
        else:
            pack.add_quantised(f"{prefix}{name}", values)
    return {"rate": rate, "frames": len(frames["q"])}


def _binding(spans: tuple[Span, ...], gap: float) -> list[tuple[float, float, str]]:
    """Start, end [s] and name of what bound; breaks of at most ``gap`` are left out."""
    joined, last = list[list[Any]](), dict[str, list[Any]]()
    for span in spans:
        before = last.get(span.label)
        if before is not None and span.start - before[1] <= gap:
            before[1] = round(span.end, 3)
            continue
        last[span.label] = [round(span.start, 3), round(span.end, 3), span.label]
        joined.append(last[span.label])
    return [(start, end, label) for start, end, label in joined]


def _add_verdict(pack: Pack, verdict: Verdict, prefix: str) -> dict[str, object]:
    curves = []
    for k, curve in enumerate(verdict.ranked()):
        pack.add(f"{prefix}curve{k}.time", curve.time.astype(np.float32))
        pack.add(f"{prefix}curve{k}.margin", curve.margin.astype(np.float32))
        pack.add(f"{prefix}curve{k}.worst", curve.worst.astype(np.uint8))
        words = {"name": curve.name, "unit": curve.unit, "subjects": curve.subjects}
        curves.append({**words, "tight": float(curve.tight)})
    return {
        "ok": verdict.ok,
        "text": verdict.text,
        "annotations": [asdict(annotation) for annotation in verdict.annotations],
        "curves": curves,
        "chance": verdict.chance,
        "world": verdict.world,
        "coarse": verdict.coarse,
        "certified": None if verdict.certified is None else asdict(verdict.certified),
    }


HTML_SUFFIXES = (".html", ".htm")
PAGE_LIMIT = 4_000_000  #: Largest page [bytes]
_SCRIPTS = "data stage scene ghost steps flags charts binding trust verdict sound app"
_EDITOR = (
    "words coarse view tracks inspector proposals nearest hands onion library music world tools "
    "doing certify tour page"
)
"""Of the assets, in the order in which they need one another; a live page has another one, and one
that edits those of the studio."""


@typed()
def export_html(shown: Recording | ReplayContent, path: Path, *, title: str) -> Path:
    """Write an interactive 3D replay as one self-contained page; gives its absolute path.

    Args:
        shown: what happened, or a plan, with what there is to say about it.
        path: file to write, ``.html``.
        title: heading and window title; any text.

    Raises:
        ConfigError: for a path that cannot be written, a recording that cannot be drawn, or one
            so large that the page would exceed ``PAGE_LIMIT``.
        DescriptionError: if the robot's files are missing.
    """
    target = checked_output(path, HTML_SUFFIXES)
    return write_atomically(target, replay_html(shown, title=title).encode())


def replay_html(shown: Recording | ReplayContent, *, title: str) -> str:
    """The page of ``export_html`` as text; raises as it does, but for the path."""
    content = checked_content(shown)
    data = compressed_text(prepared(content).packed(title).data)
    page = page_text(title, scene_text(content.recording), data)
    if (size := len(page.encode())) > PAGE_LIMIT:
        raise ConfigError(
            f"the page would have {size} bytes, limit {PAGE_LIMIT}; record a shorter run"
        )
    return page


def page_text(
    title: str, scene: str, data: str, *, is_live: bool = False, is_editor: bool = False
) -> str:
    """The page of a packed scene and what happens in it.

    A live one listens to its server; an editor has bars besides, and needs ``content.editor``.
    """
    names = [f"replay_{name}" for name in _SCRIPTS.split()]
    names += ["replay_live"] * is_live
    names += [f"studio_{name}" for name in _EDITOR.split()] * is_editor
    bundle = Path(meshcat.viewer_assets_path()) / "dist" / "main.min.js"
    parts = {
        "TITLE": html.escape(title),
        "STYLE": _asset("replay.css") + (_asset("studio.css") if is_editor else ""),
        "SCRIPT": "\n".join(_asset(f"{name}.js") for name in names),
        "MESHCAT": compressed_text(bundle.read_bytes()),
        "SCENE": scene,
        "DATA": data,
    }
    pieces = _asset("replay.html").split("@")
    return "".join(parts[piece] if k % 2 else piece for k, piece in enumerate(pieces))


def _asset(name: str) -> str:
    return resources.files("viz.replay").joinpath("assets", name).read_text(encoding="utf-8")
