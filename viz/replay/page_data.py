"""What a page or a file for other viewers holds of a recording.

A page has the scene once, and what happens in it at even steps. It needs
nothing else: no server, no network.
"""

from __future__ import annotations

import html
from collections.abc import Mapping
from dataclasses import asdict, replace
from importlib import resources
from pathlib import Path
from typing import NamedTuple

import meshcat
import numpy as np
import pinocchio as pin
from jaxtyping import Float

from go2_wbc.arguments import typed
from go2_wbc.errors import ConfigError
from go2_wbc.files import checked_output, write_atomically
from go2_wbc.legs import LEGS
from go2_wbc.recording import Recording
from viz.content import MarginCurve, ReplayContent, Verdict, checked_content
from viz.render.camera import smoothed
from viz.render.ground import COLORS, grid_of
from viz.render.robot_meshes import PosedRobot, visuals_of
from viz.replay.meshcat_scene import Pack, compressed_text, robot_scene
from viz.style import LEG_COLORS

WORLD, BASE = "world", "base"


class Link(NamedTuple):
    """A link that moves, by its name in the URDF.

    Attributes:
        name, parent: of it and of the link that it hangs on, ``world`` for the base.
        p, quaternion: (n, 3), (n, 4) its place [m] and orientation x y z w in the parent's frame.
    """

    name: str
    parent: str
    p: Float[np.ndarray, "n 3"]
    quaternion: Float[np.ndarray, "n 4"]


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
_MOST_MARGINS = 3000  # samples of a margin curve; the least of each step is kept
_CAMERA_SMOOTHING = 0.7  # [s]
UNKNOWN = -32768  #: Height [mm] of a cell of ground that was not seen
_PLAIN = {"stance": np.uint8, "margin": np.float32, "torque": np.float32}
"""How frames are stored that are not 16-bit numbers between their extremes."""


def scene_text(recording: Recording) -> str:
    """The robot of the recording and the markers, packed: the same for every page of it."""
    pack, visuals = Pack(), visuals_of(recording)
    scene = robot_scene(visuals, pack)
    legs = {"legs": [leg.name for leg in LEGS], "leg_colors": LEG_COLORS}
    return pack.packed({**scene, **legs, "foot_radius": visuals.foot_radius})


def content_text(content: ReplayContent, title: str, version: str = "") -> str:
    """What happens, packed; ``version`` tells one text of a live page from the next."""
    pack = Pack()
    rate, frames = replay_frames(content.recording)
    highest = float(np.percentile(frames["forces"], _FORCE_PERCENTILE))
    header: dict[str, object] = {
        "title": title,
        "version": version,
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
        "ghost": None,
        "ground": None,
        "written": None,
    }
    if len(content.recording.ground):
        grid = grid_of(content.recording.ground)
        heights = np.where(np.isnan(grid.z), UNKNOWN, np.round(1000.0 * grid.z))
        pack.add("ground", heights.astype(np.int16))
        place = {"x": grid.x, "y": grid.y, "cell": grid.cell, "shape": grid.z.shape}
        header["ground"] = {**place, "low": float(np.nanmin(grid.z)), "colors": COLORS}
    if content.sound:
        pack.add("sound", np.frombuffer(content.sound, np.uint8))
    if content.verdict is not None:
        header["verdict"] = _add_verdict(pack, content.verdict)
    for name, other in (("ghost", content.ghost), ("written", content.written)):
        if other is not None:
            header[name] = _add_frames(pack, f"{name}.", *replay_frames(other))
    return pack.packed(header)


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
    visuals, q = visuals_of(recording), _continuous(recording.q[rows])
    robot = PosedRobot(visuals)
    feet = np.array([robot.feet(row) for row in q])
    heights = feet[:, :, 2].mean(axis=1) - visuals.foot_radius
    heights = heights if len(recording.ground) else np.zeros(count)
    below = np.interp(recording.time, wanted, heights)
    places = np.column_stack([recording.q[:, :2], below])
    target = smoothed(recording.time, places, _CAMERA_SMOOTHING)
    ratio = np.max(np.abs(recording.tau) / visuals.description.efforts, axis=1)
    return rate, {
        "q": q,
        "feet": feet.reshape(-1, 12),
        "com": recording.p_world_com[rows],
        "target": target[rows],
        "forces": np.maximum.reduceat(recording.foot_forces, rows),
        "stance": recording.stance[rows],
        "margin": np.fmin.reduceat(recording.support_margin, rows),
        "torque": np.maximum.reduceat(ratio, rows),
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


def _add_verdict(pack: Pack, verdict: Verdict) -> dict[str, object]:
    curves = []
    for k, curve in enumerate(map(reduced, verdict.ranked())):
        pack.add(f"curve{k}.time", curve.time.astype(np.float32))
        pack.add(f"curve{k}.margin", curve.margin.astype(np.float32))
        pack.add(f"curve{k}.worst", curve.worst.astype(np.uint8))
        words = {"name": curve.name, "unit": curve.unit, "subjects": curve.subjects}
        curves.append({**words, "tight": float(curve.tight)})
    return {
        "ok": verdict.ok,
        "text": verdict.text,
        "annotations": [asdict(annotation) for annotation in verdict.annotations],
        "curves": curves,
        "chance": verdict.chance,
        "world": verdict.world,
        "certified": None if verdict.certified is None else asdict(verdict.certified),
    }


def reduced(curve: MarginCurve) -> MarginCurve:
    """The curve with at most ``_MOST_MARGINS`` samples: the least of each step."""
    step = -(-len(curve.time) // _MOST_MARGINS)
    if step <= 1:
        return curve
    known = np.where(np.isnan(curve.margin), np.inf, curve.margin)
    edges = range(0, len(known), step)
    rows = np.array([start + int(known[start : start + step].argmin()) for start in edges])
    return replace(curve, time=curve.time[rows], margin=curve.margin[rows], worst=curve.worst[rows])


HTML_SUFFIXES = (".html", ".htm")
PAGE_LIMIT = 4_000_000  #: Largest page [bytes]
_SCRIPTS = "data stage scene ghost steps flags charts trust verdict sound app"
"""Of the assets, in the order in which they need one another; a live page has another one."""


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
    page = page_text(title, scene_text(content.recording), content_text(content, title))
    if (size := len(page.encode())) > PAGE_LIMIT:
        raise ConfigError(
            f"the page would have {size} bytes, limit {PAGE_LIMIT}; record a shorter run"
        )
    return page


def page_text(title: str, scene: str, data: str, *, is_live: bool = False) -> str:
    """The page of a packed scene and what happens in it; a live one listens to its server."""
    scripts = f"{_SCRIPTS} live" if is_live else _SCRIPTS
    bundle = Path(meshcat.viewer_assets_path()) / "dist" / "main.min.js"
    parts = {
        "TITLE": html.escape(title),
        "STYLE": _asset("replay.css"),
        "SCRIPT": "\n".join(_asset(f"replay_{name}.js") for name in scripts.split()),
        "MESHCAT": compressed_text(bundle.read_bytes()),
        "SCENE": scene,
        "DATA": data,
    }
    pieces = _asset("replay.html").split("@")
    return "".join(parts[piece] if k % 2 else piece for k, piece in enumerate(pieces))


def _asset(name: str) -> str:
    return resources.files("viz.replay").joinpath("assets", name).read_text(encoding="utf-8")
