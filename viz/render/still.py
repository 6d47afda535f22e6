"""A still picture of a recording: its moments side by side."""

from __future__ import annotations

import io
import math
from collections.abc import Sequence
from pathlib import Path

import numpy as np
from PIL import Image, ImageDraw

from go2_wbc.arguments import typed
from go2_wbc.errors import ConfigError
from go2_wbc.files import checked_output, write_atomically
from go2_wbc.recording import Recording, Span
from viz.content import check_recording
from viz.render.camera import nearest_rows
from viz.render.frame_renderer import FrameRenderer, ShotStyle
from viz.render.robot_meshes import PosedRobot, visuals_of

FILMSTRIP_SUFFIXES = (".png",)
_MOST_PANELS = 6
_COLUMNS = 3
_PANEL = (560, 380)  # [px]
_GAP = 12  # [px]
_CORNER = 18  # [px] radius
_STYLE = ShotStyle(size=_PANEL, distance=1.6, detail=0.003, samples=3)
_LIFTED = 0.02  # [m] a foot this high makes a better picture than the middle of the span
_SETTLED = 0.7  # share of a span after which a slow behaviour has taken its shape
_CANDIDATES = 60  # poses of a span that are looked at


@typed()
def export_filmstrip(
    recording: Recording, path: Path, *, times: Sequence[float | int] | None = None
) -> Path:
    """Write moments of a recording side by side as one transparent PNG; gives the absolute path.

    Args:
        recording: what happened.
        path: file to write, ``.png``.
        times: seconds after the start, one per panel; by default one telling moment of each
            behaviour.

    Raises:
        ConfigError: for a path that cannot be written, a recording that cannot be drawn, or times
            outside it.
    """
    target = checked_output(path, FILMSTRIP_SUFFIXES)
    check_recording(recording)
    chosen = telling_times(recording) if times is None else [float(time) for time in times]
    if not chosen:
        raise ConfigError("a filmstrip needs at least one time")
    outside = [time for time in chosen if not 0 <= time <= recording.duration]
    if outside:
        raise ConfigError(
            f"time {outside[0]:g} s is outside the recording; valid: 0 to {recording.duration:g} s"
        )
    frame_renderer = FrameRenderer(recording, _STYLE)
    panels = [
        Image.fromarray(frame_renderer.shoot_captioned(time, with_progress=False))
        for time in chosen
    ]
    stream = io.BytesIO()
    _assemble(panels).save(stream, "PNG", optimize=True)
    return write_atomically(target, stream.getvalue())


def telling_times(recording: Recording) -> list[float]:
    """One moment for each behaviour, in order: where a foot is highest, or the pose settled."""
    spans = _interesting_spans(recording.spans())
    robot = PosedRobot(visuals_of(recording))
    return [_telling_time(recording, robot, span) for span in spans]


def _interesting_spans(spans: Sequence[Span]) -> list[Span]:
    """The longest span of each label, at most ``_MOST_PANELS``, in order of time."""
    longest: dict[str, Span] = {}
    for span in sorted(spans, key=lambda span: span.start - span.end):
        longest.setdefault(span.label, span)
    return sorted(list(longest.values())[:_MOST_PANELS], key=lambda span: span.start)


def _telling_time(recording: Recording, robot: PosedRobot, span: Span) -> float:
    times = np.linspace(span.start, span.end, _CANDIDATES + 2)[1:-1]
    rows = nearest_rows(recording, times)
    radius = visuals_of(recording).foot_radius
    heights = [robot.feet(recording.q[row])[:, 2].max() - radius for row in rows]
    best = int(np.argmax(heights))
    if heights[best] > _LIFTED:
        return float(times[best])
    return span.start + _SETTLED * (span.end - span.start)


def _assemble(panels: Sequence[Image.Image]) -> Image.Image:
    """Panels in rows of at most three, with round corners; a shorter last row is centred."""
    rows = math.ceil(len(panels) / _COLUMNS)
    columns = math.ceil(len(panels) / rows)
    width, height = _PANEL
    size = (columns * width + (columns - 1) * _GAP, rows * height + (rows - 1) * _GAP)
    sheet = Image.new("RGBA", size, (255, 255, 255, 0))
    mask = Image.new("L", (2 * width, 2 * height), 0)
    ImageDraw.Draw(mask).rounded_rectangle(
        (0, 0, 2 * width - 1, 2 * height - 1), 2 * _CORNER, fill=255
    )
    mask = mask.resize(_PANEL, Image.Resampling.BOX)
    for k, panel in enumerate(panels):
        row, column = divmod(k, columns)
        missing = max(0, (row + 1) * columns - len(panels))
        x = column * (width + _GAP) + missing * (width + _GAP) // 2
        y = row * (height + _GAP)
        sheet.paste(panel, (x, y), mask)
    return sheet
