"""What ``go2-wbc demo`` does once its options are read."""

from __future__ import annotations

import argparse
import sys
from dataclasses import replace
from pathlib import Path

from controller.cli.common import ExitCode, print_json
from controller.cli.demo_files import DemoFiles, export_media, save_recording, save_report
from controller.cli.demo_table import render
from controller.cli.progress import ProgressLine
from controller.demo.report import DemoReport
from controller.demo.run import DemoProgress, run_demo
from controller.go2_controller import GO2Controller
from go2_wbc.config import Config, load_config
from go2_wbc.errors import ConfigError
from go2_wbc.plant import MujocoPlant
from go2_wbc.plant.mujoco.viewer import display_problem
from go2_wbc.recording import Recording

START_NOISE = 0.05
"""Standard deviation [rad] of the joint angles from which the robot starts with ``--seed``."""

_MEANING = {
    ".npz": "recording (NumPy)",
    ".json": "report",
    ".html": "3D replay, offline",
    ".png": "filmstrip",
    ".webp": "animation",
}


def run_demo_command(args: argparse.Namespace) -> int:
    """Run the demo, print the report, write the files."""
    files = DemoFiles.inside(args.out)  # before the run: its results must not be lost
    report, recording = _perform(args)
    values = {**report.as_dict(), "settings": _settings(args)}
    if args.json:
        print_json(values)
    else:
        print(render(report, sys.stdout.encoding), end="\n\n", flush=True)
    try:
        written = [save_recording(recording, files.recording), save_report(values, files.report)]
        if not args.no_media:
            written += _picture(recording, report, files)
    except ConfigError as error:  # the disk or the size: no fault of the caller's usage
        print(f"go2-wbc: {error}", file=sys.stderr)
        return ExitCode.RUNTIME
    if not args.json:
        _list_files(written)
    return ExitCode.OK if report.ok else ExitCode.FAILED


def _perform(args: argparse.Namespace) -> tuple[DemoReport, Recording]:
    with ProgressLine() as line:

        def show(progress: DemoProgress) -> None:
            place = f"{progress.index + 1}/{progress.count} {progress.label}"
            if progress.result is None:
                line.update(progress.index / progress.count, place)
            else:
                verdict = "ok" if progress.result.ok else f"NOT DONE: {progress.result.reason}"
                line.done(f"{place}: {verdict}")

        line.update(0.0, "loading the robot")
        with _controller(args) as go2:
            report = run_demo(go2, show)
            return report, go2.recording()


def _controller(args: argparse.Namespace) -> GO2Controller:
    config = _config(args)
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


def _config(args: argparse.Namespace) -> Config:
    config = Config() if args.config is None else load_config(args.config)
    if args.backend is not None:
        config = replace(config, backend=args.backend)
    if args.solver is not None:
        config = replace(config, wbc=replace(config.wbc, solver=args.solver))
    return config


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


def _picture(recording: Recording, report: DemoReport, files: DemoFiles) -> list[Path]:
    with ProgressLine() as line:
        return export_media(
            recording,
            report,
            files,
            lambda share, file: line.update(share, f"drawing {file.name}"),
        )


def _list_files(paths: list[Path]) -> None:
    here = Path.cwd()
    for path in paths:
        shown = path.relative_to(here) if path.is_relative_to(here) else path
        print(f"  {_MEANING[path.suffix]:<20}{path.stat().st_size / 1000:>6.0f} kB  {shown}")
