"""Writes a recording as one web page that needs nothing else: no server, no network."""

from __future__ import annotations

import html
from importlib import resources
from pathlib import Path

import meshcat
import numpy as np

from go2_wbc.errors import ConfigError
from go2_wbc.legs import LEGS
from go2_wbc.recording import Recording
from go2_wbc.robot.model import FOOT_RADIUS
from viz.checks import check_recording
from viz.files import checked_output, write_atomically
from viz.meshcat_scene import robot_scene
from viz.packing import Pack, compressed_text
from viz.palette import LEG_COLORS
from viz.posed_robot import PosedRobot
from viz.replay_data import ReplayFrames, label_spans, replay_frames
from viz.robot_meshes import load_robot_visuals

HTML_SUFFIXES = (".html", ".htm")
PAGE_LIMIT = 4_000_000
"""Largest page [bytes]."""
_SCRIPTS = ("replay_data.js", "replay_scene.js", "replay_charts.js", "replay_app.js")
_FORCE_PERCENTILE = 99.5  # a touchdown spike beyond it may be cut off in the contact strip
_LEAST_FORCE_SCALE = 50.0  # [N] a full row of the contact strip is at least this much


def export_html(recording: Recording, path: Path, *, title: str) -> Path:
    """Write an interactive 3D replay of a recording as one self-contained page.

    Args:
        recording: what happened.
        path: file to write, ``.html``.
        title: heading and window title; any text.

    Returns:
        The absolute path.

    Raises:
        ConfigError: for a path that cannot be written, a recording that cannot be drawn, or one
            so large that the page would exceed ``PAGE_LIMIT``.
        DescriptionError: if the robot's files are missing.
    """
    target = checked_output(path, HTML_SUFFIXES)
    check_recording(recording)
    page = _page(recording, title).encode()
    if len(page) > PAGE_LIMIT:
        raise ConfigError(
            f"the page would have {len(page)} bytes, limit {PAGE_LIMIT}; record a shorter run"
        )
    return write_atomically(target, page)


def _page(recording: Recording, title: str) -> str:
    parts = {
        "TITLE": html.escape(title),
        "STYLE": _asset("replay.css"),
        "SCRIPT": "\n".join(_asset(name) for name in _SCRIPTS),
        "MESHCAT": compressed_text(_meshcat_bundle()),
        "DATA": _data(recording),
    }
    pieces = _asset("replay.html").split("@")
    return "".join(parts[piece] if k % 2 else piece for k, piece in enumerate(pieces))


def _data(recording: Recording) -> str:
    visuals = load_robot_visuals()
    frames = replay_frames(recording, PosedRobot(visuals))
    pack = Pack()
    scene = robot_scene(visuals, pack)
    _add_frames(pack, frames)
    scale = max(float(np.percentile(frames.foot_forces, _FORCE_PERCENTILE)), _LEAST_FORCE_SCALE)
    header = {
        "rate": frames.rate,
        "frames": len(frames.q),
        "labels": [[span.start, span.end, span.label] for span in label_spans(recording)],
        "legs": [leg.name for leg in LEGS],
        "leg_colors": list(LEG_COLORS),
        "foot_radius": FOOT_RADIUS,
        "force_scale": scale,
        **scene,
    }
    return pack.packed(header)


def _add_frames(pack: Pack, frames: ReplayFrames) -> None:
    pack.add_quantised("q", frames.q)
    pack.add_quantised("feet", frames.p_world_feet)
    pack.add_quantised("com", frames.p_world_com)
    pack.add_quantised("target", frames.p_world_camera_target)
    pack.add_quantised("forces", frames.foot_forces)
    pack.add("stance", frames.stance.astype(np.uint8))
    pack.add("margin", frames.support_margin.astype(np.float32))
    pack.add("torque", frames.torque_ratio.astype(np.float32))


def _asset(name: str) -> str:
    return resources.files("viz").joinpath("assets", name).read_text(encoding="utf-8")


def _meshcat_bundle() -> bytes:
    return (Path(meshcat.viewer_assets_path()) / "dist" / "main.min.js").read_bytes()
