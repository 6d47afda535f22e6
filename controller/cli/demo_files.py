"""The files that a demo leaves: recording, report, replay page, animation and filmstrip."""

from __future__ import annotations

import dataclasses
import io
import json
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from jaxtyping import Int

from controller.demo.report import DemoReport
from go2_wbc.errors import ConfigError
from go2_wbc.files import checked_output, write_atomically
from go2_wbc.recording import Recording
from viz import export_animation, export_filmstrip, export_html

TITLE = "Go2: stand, sit, walk, turn, high five"


@dataclass(frozen=True, slots=True)
class DemoFiles:
    """Where everything goes; every path has been checked to be writable.

    Attributes:
        recording: ``demo.npz``, the fields of ``Recording`` by name.
        report: ``report.json``.
        page: ``demo.html``, the offline 3D replay.
        filmstrip: ``demo.png``.
        animation: ``demo.webp``.
    """

    recording: Path
    report: Path
    page: Path
    filmstrip: Path
    animation: Path

    @staticmethod
    def inside(folder: Path) -> DemoFiles:
        """The files in ``folder``, which is created.

        Raises:
            ConfigError: if one of them could not be written.
        """
        if folder.exists() and not folder.is_dir():
            raise ConfigError(f"cannot write into {folder}: it is a file, give a folder")
        names = ("demo.npz", "report.json", "demo.html", "demo.png", "demo.webp")
        paths = [checked_output(folder / name, (Path(name).suffix,)) for name in names]
        return DemoFiles(*paths)


def save_recording(recording: Recording, target: Path) -> Path:
    """Write the arrays of ``recording``; ``numpy.load`` reads them back by field name."""
    names = [field.name for field in dataclasses.fields(recording)]
    arrays: dict[str, Any] = {name: np.asarray(getattr(recording, name)) for name in names}
    stream = io.BytesIO()
    np.savez_compressed(stream, **arrays)
    return write_atomically(target, stream.getvalue())


def save_report(values: dict[str, object], target: Path) -> Path:
    """Write ``values`` as JSON."""
    return write_atomically(target, (json.dumps(values, indent=2) + "\n").encode())


def export_media(
    recording: Recording,
    report: DemoReport,
    files: DemoFiles,
    on_progress: Callable[[float, Path], None],
) -> list[Path]:
    """Write page, filmstrip and animation; ``on_progress(share, file)`` tells how far it has come.

    Returns:
        The paths in the order in which they were written.

    Raises:
        ConfigError: if a file would be too large.
    """
    on_progress(0.0, files.page)
    export_html(recording, files.page, title=TITLE)
    on_progress(0.1, files.filmstrip)
    export_filmstrip(recording, files.filmstrip, times=filmstrip_times(report, recording))
    on_progress(0.2, files.animation)
    export_animation(
        recording,
        files.animation,
        progress=lambda share: on_progress(0.2 + 0.8 * share, files.animation),
    )
    return [files.page, files.filmstrip, files.animation]


def filmstrip_times(report: DemoReport, recording: Recording) -> list[float] | None:
    """Seconds after the start at which the robot sits, swings two legs, and holds its paw up.

    None if the run has no such moments; the filmstrip then chooses for itself.
    """
    spans = {step.name: (step.start, step.start + step.duration) for step in report.steps}
    if not {"sit", "forward", "high_five"} <= spans.keys():
        return None
    sitting = _rows(recording, spans["sit"])
    swinging = _longest_mode(recording, _rows(recording, spans["forward"]), feet=2)
    raising = _longest_mode(recording, _rows(recording, spans["high_five"]), feet=3)
    if not (len(sitting) and len(swinging) and len(raising)):
        return None
    rows = (sitting[-1], swinging[len(swinging) // 2], raising[len(raising) // 2])
    return [float(recording.time[row] - recording.time[0]) for row in rows]


def _rows(recording: Recording, span: tuple[float, float]) -> Int[np.ndarray, " k"]:
    return np.flatnonzero((recording.time > span[0]) & (recording.time < span[1]))


def _longest_mode(
    recording: Recording, rows: Int[np.ndarray, " k"], feet: int
) -> Int[np.ndarray, " j"]:
    """The longest run of ``rows`` in which the same ``feet`` feet are in stance."""
    modes = recording.stance[rows] @ np.array([1, 2, 4, 8])
    borders = np.flatnonzero(np.diff(modes)) + 1
    runs = [run for run in np.split(rows, borders) if len(run)]
    runs = [run for run in runs if recording.stance[run[0]].sum() == feet]
    return max(runs, key=len, default=rows[:0])
