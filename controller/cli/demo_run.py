"""What ``go2-wbc demo`` does once its options are read, and the files that it leaves."""

from __future__ import annotations

import argparse
import io
import json
import sys
from collections.abc import Mapping
from dataclasses import fields, replace
from itertools import groupby
from pathlib import Path
from typing import Any

import numpy as np
from jaxtyping import Int

import viz  # what is named viz.X below is imported when something is drawn
from controller.cli.common import ExitCode, print_json, shown_path
from controller.cli.demo_table import render
from controller.cli.progress import ProgressLine
from controller.demo.report import DemoReport
from controller.demo.run import DemoProgress, run_demo
from controller.go2_controller import GO2Controller
from go2_wbc.config import Config, load_config
from go2_wbc.errors import ConfigError
from go2_wbc.files import checked_output, write_atomically
from go2_wbc.plant import MujocoPlant
from go2_wbc.plant.mujoco.viewer import display_problem
from go2_wbc.recording import Recording

START_NOISE = 0.05
"""Standard deviation [rad] of the joint angles from which the robot starts with ``--seed``."""
TITLE = "Go2: stand, sit, walk, turn, high five"
FILES: Mapping[str, str] = {
    "demo.npz": "recording (NumPy)",
    "report.json": "report",
    "demo.html": "3D replay, offline",
    "demo.png": "filmstrip",
    "demo.webp": "animation",
}
"""The files that are left, the last three only with media, and what each holds."""


def run_demo_command(args: argparse.Namespace) -> int:
    """Run the demo, print the report, write the files."""
    paths = checked_paths(args.out)  # before the run: its results must not be lost
    report, recording = _perform(args)
    values = {**report.as_dict(), "settings": _settings(args)}
    if args.json:
        print_json(values)
    else:
        print(render(report, sys.stdout.encoding), end="\n\n", flush=True)
    try:
        _write_data(recording, values, paths)
        if not args.no_media:
            _write_media(recording, report, paths)
    except ConfigError as error:  # the disk or the size: no fault of the caller's usage
        print(f"go2-wbc: {error}", file=sys.stderr)
        return ExitCode.RUNTIME
    if not args.json:
        for path in paths[:2] if args.no_media else paths:
            size = f"{path.stat().st_size / 1000:>6.0f} kB"
            print(f"  {FILES[path.name]:<20}{size}  {shown_path(path)}")
    return ExitCode.OK if report.ok else ExitCode.FAILED


def checked_paths(folder: Path) -> list[Path]:
    """The paths of ``FILES`` in ``folder``, which is created.

    Raises:
        ConfigError: if one of them could not be written.
    """
    if folder.exists() and not folder.is_dir():
        raise ConfigError(f"cannot write into {folder}: it is a file, give a folder")
    return [checked_output(folder / name, (Path(name).suffix,)) for name in FILES]


def _perform(args: argparse.Namespace) -> tuple[DemoReport, Recording]:
    with ProgressLine() as line:

        def show(progress: DemoProgress) -> None:
            place = f"{progress.index + 1}/{progress.count} {progress.label}"
            if progress.result is None:
                line.update(progress.index / progress.count, place)
            else:
                line.done(f"{place}: {progress.result.verdict}")

        line.update(0.0, "loading the robot")
        with _controller(args) as go2:
            report = run_demo(go2, show)
            return report, go2.recording()


def _controller(args: argparse.Namespace) -> GO2Controller:
    config = Config() if args.config is None else load_config(args.config)
    if args.backend is not None:
        config = replace(config, backend=args.backend)
    if args.solver is not None:
        config = replace(config, wbc=replace(config.wbc, solver=args.solver))
    viewer = args.viewer and _has_display()
    plant = MujocoPlant(
        args.mjcf,
        friction=args.friction,
        mass_scale=args.mass_scale,
        seed=args.seed or 0,
        initial_joint_noise=0.0 if args.seed is None else START_NOISE,
        visuals=viewer,
    )
    return GO2Controller(plant=plant, realtime=args.realtime, viewer=viewer, config=config)


def _has_display() -> bool:
    problem = display_problem()
    if problem is not None:
        reason = problem.split(" (")[0]
        print(f"go2-wbc: no viewer: {reason}; going on without it", file=sys.stderr)
    return problem is None


def _settings(args: argparse.Namespace) -> dict[str, object]:
    names = ("seed", "friction", "mass_scale", "mjcf", "config", "backend", "solver", "realtime")
    values = {name: getattr(args, name) for name in names}
    return {name: str(v) if isinstance(v, Path) else v for name, v in values.items()}


def _write_data(recording: Recording, values: Mapping[str, object], paths: list[Path]) -> None:
    """The arrays, which ``numpy.load`` reads back by field name, and the report."""
    stream = io.BytesIO()
    names = [field.name for field in fields(recording)]
    arrays: dict[str, Any] = {name: np.asarray(getattr(recording, name)) for name in names}
    np.savez_compressed(stream, **arrays)
    write_atomically(paths[0], stream.getvalue())
    write_atomically(paths[1], (json.dumps(values, indent=2) + "\n").encode())


def _write_media(recording: Recording, report: DemoReport, paths: list[Path]) -> None:
    """Page, filmstrip and animation; the animation takes by far the longest."""
    _, _, page, filmstrip, animation = paths
    with ProgressLine() as line:
        line.update(0.0, f"drawing {page.name}")
        viz.export_html(recording, page, title=TITLE)
        line.update(0.1, f"drawing {filmstrip.name}")
        viz.export_filmstrip(recording, filmstrip, times=filmstrip_times(report, recording))
        viz.export_animation(
            recording,
            animation,
            progress=lambda share: line.update(0.2 + 0.8 * share, f"drawing {animation.name}"),
        )


def filmstrip_times(report: DemoReport, recording: Recording) -> list[float] | None:
    """Seconds after the start at which the robot sits, swings two legs, and holds its paw up.

    None if the run has no such moments; the filmstrip then chooses for itself.
    """
    steps = {step.name: step for step in report.steps}
    if not {"sit", "forward", "high_five"} <= steps.keys():
        return None

    def rows_of(name: str) -> Int[np.ndarray, " k"]:
        since = recording.time - steps[name].start
        return np.flatnonzero((since > 0.0) & (since < steps[name].duration))

    sitting = rows_of("sit")
    swinging = _longest_mode(recording, rows_of("forward"), feet=2)
    raising = _longest_mode(recording, rows_of("high_five"), feet=3)
    if not (len(sitting) and len(swinging) and len(raising)):
        return None
    rows = (sitting[-1], swinging[len(swinging) // 2], raising[len(raising) // 2])
    return [float(recording.time[row] - recording.time[0]) for row in rows]


def _longest_mode(recording: Recording, rows: Int[np.ndarray, " k"], feet: int) -> list[int]:
    """The longest run of ``rows`` in which the same ``feet`` feet are in stance."""
    modes = groupby(rows.tolist(), key=lambda row: recording.stance[row].tolist())
    return max((list(run) for mode, run in modes if sum(mode) == feet), key=len, default=[])
