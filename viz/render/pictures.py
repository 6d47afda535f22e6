"""Pictures of a recording, rendered in software: its moments side by side, a short animation."""

from __future__ import annotations

import io
import math
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from PIL import Image, ImageDraw

from go2_wbc.arguments import typed
from go2_wbc.errors import ConfigError, needing
from go2_wbc.files import checked_output, write_atomically
from go2_wbc.recording import Recording, Span
from viz.content import ReplayContent, check_recording, checked_content
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


ANIMATION_SUFFIXES = (".webp", ".gif", ".mp4")
SIZE_LIMIT = 3_000_000  #: Largest animated WebP [bytes]; the quality is chosen to stay below
GIF_SIZE_LIMIT = 24_000_000
"""Largest GIF [bytes], of the same pictures; the number of colours is chosen to stay below."""
_QUALITIES = (90, 82, 74, 66, 58, 50, 45, 40, 30, 20)
_EFFORT = 4  # of WebP, 0 to 6: more takes longer and gives a smaller file
_COLORS = (256, 128, 64, 32)
_PROBES = 8  # frames that are encoded at each quality to foresee the size of the file
_HEADROOM = 0.9  # share of the limit that the forecast may reach
_RENDER_SHARE = 0.75  # share of the progress bar for the pictures; the rest is the encoding


@typed(late=True)
def export_animation(
    shown: Recording | ReplayContent,
    path: Path,
    *,
    speed: float | int = 2.0,
    fps: float | int = 12,
    size: tuple[int, int] = (640, 400),
    progress: Callable[[float], None] | None = None,
) -> Path:
    """Write a looping animation of the whole recording; gives the absolute path.

    A WebP has at most ``SIZE_LIMIT`` bytes, a GIF ``GIF_SIZE_LIMIT``; an MP4 (H.264) has no limit,
    does not loop by itself, and needs the extra ``video``. Needs no GPU, no display and no ffmpeg
    beside that. About 60 ms of CPU per picture of 640 by 400.

    Args:
        shown: what happened, or a plan; while it breaks a limit, the caption says which, in red.
        path: file to write, ``.webp``, ``.gif`` or ``.mp4``.
        speed: playback speed, 2 is twice as fast as it happened.
        fps: pictures per second of playback.
        size: width and height [px].
        progress: called with the finished share, 0..1.

    Raises:
        ConfigError: for a path that cannot be written, a recording that cannot be drawn, a speed,
            rate or size out of range, or a file that stays too large at the lowest quality.
        MissingDependency: for an MP4 without the extra, before any picture; says how to get it.
    """
    target = checked_output(path, ANIMATION_SUFFIXES)
    kind = target.suffix.lower()
    as_mp4 = _mp4() if kind == ".mp4" else None
    content = checked_content(shown)
    recording = content.recording
    if not (speed > 0 and fps > 0 and min(size) >= 16):
        raise ConfigError(
            f"speed {speed} and fps {fps} must be positive, size {size} at least 16 by 16 px"
        )
    report = progress or (lambda _share: None)
    annotations = () if content.verdict is None else content.verdict.annotations
    frame_renderer = FrameRenderer(recording, ShotStyle(size=size), annotations)
    times = frame_times(recording, speed=speed, fps=fps)
    frames = []
    for k, time in enumerate(times):
        frames.append(Image.fromarray(frame_renderer.shoot_captioned(time, speed=speed)))
        report(_RENDER_SHARE * (k + 1) / len(times))
    if as_mp4 is not None:
        encoded = as_mp4(frames, fps)
    elif kind == ".gif":
        encoded = _encoded_gif(frames, round(1000 / fps), GIF_SIZE_LIMIT)
    else:
        encoded = encoded_webp(frames, round(1000 / fps), SIZE_LIMIT)
    report(1.0)
    return write_atomically(target, encoded)


def frame_times(recording: Recording, *, speed: float | int, fps: float | int) -> list[float]:
    """Seconds after the start of the recording at which pictures are taken; both ends included."""
    count = max(2, round(recording.duration / speed * fps) + 1)
    return [float(time) for time in np.linspace(0.0, recording.duration, count)]


def encoded_webp(frames: Sequence[Image.Image], milliseconds: int, limit: int) -> bytes:
    """Two or more pictures as one looping WebP, in the best quality of at most ``limit`` bytes.

    Raises:
        ConfigError: if the file is too large in every quality.
    """
    probes = frames[:: max(1, len(frames) // _PROBES)]
    # Every frame whole (kmax): frames that repair others leave ghosts where all moves.
    settings = {"method": _EFFORT, "kmax": 1}
    for quality in _QUALITIES:
        settings["quality"] = quality
        mean = np.mean([len(_saved(frame, "WEBP", settings)) for frame in probes])
        if mean * len(frames) <= _HEADROOM * limit:
            break
    return _within(limit, frames, _film(frames, "WEBP", milliseconds, settings))


def _encoded_gif(frames: Sequence[Image.Image], milliseconds: int, limit: int) -> bytes:
    """The same as one looping GIF, in the most colours that are small enough."""
    content = b""
    for colors in _COLORS:
        few = [frame.quantize(colors, dither=Image.Dither.NONE) for frame in frames]
        content = _film(few, "GIF", milliseconds, {})
        if len(content) <= limit:
            break
    return _within(limit, frames, content)


def _mp4() -> Callable[[Sequence[Image.Image], float | int], bytes]:
    with needing("video", "an MP4 needs PyAV"):
        from viz.render.mp4_file import mp4_of
    return mp4_of


def _film(
    frames: Sequence[Image.Image], kind: str, milliseconds: int, settings: Mapping[str, int]
) -> bytes:
    film = {"save_all": True, "append_images": frames[1:], "duration": milliseconds, "loop": 0}
    return _saved(frames[0], kind, {**film, **settings})


def _saved(frame: Image.Image, kind: str, settings: Mapping[str, Any]) -> bytes:
    stream = io.BytesIO()
    frame.save(stream, kind, **settings)
    return stream.getvalue()


def _within(limit: int, frames: Sequence[Image.Image], content: bytes) -> bytes:
    if len(content) > limit:
        raise ConfigError(
            f"the animation would have {len(content)} bytes, limit {limit}; {len(frames)} frames "
            f"of {frames[0].size}: raise speed, or lower fps or size"
        )
    return content
