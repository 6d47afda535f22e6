"""``go2-wbc bench``: its options. ``controller.bench``, which loads the robot, does the work."""

from __future__ import annotations

import argparse
import json
import sys
from itertools import groupby
from pathlib import Path
from typing import TYPE_CHECKING

from controller.cli.common import ExitCode, Subparsers, add_parser, print_json
from controller.cli.progress import ProgressLine
from go2_wbc.errors import ConfigError

if TYPE_CHECKING:
    from controller.bench.report import BenchReport
    from controller.bench.rows import Family
    from controller.bench.runner import BenchProgress

EXAMPLES = """
go2-wbc bench behaviour            everything; an hour on two cores
go2-wbc bench behaviour --quick    three seeds
go2-wbc bench behaviour --list     the rows and their bars
go2-wbc bench behaviour --rows stand trot --jobs 4
go2-wbc bench behaviour --json --out behaviour.json
"""
SEEDS, QUICK_SEEDS = 20, 3


def register(subparsers: Subparsers) -> None:
    """Add the options of ``bench``."""
    parser = add_parser(
        subparsers,
        "bench",
        "Measure what the robot does, over many seeds, against fixed bars.\n"
        "Exit code 0 if every row passes, 1 if one does not.",
        examples=EXAMPLES,
    )
    benches: Subparsers = parser.add_subparsers(title="benches", dest="bench", required=True)
    behaviour = add_parser(
        benches,
        "behaviour",
        "Stand, trot, pushes, errands, high five, slaps and the whole demo in MuJoCo,\n"
        "with friction, mass, heading and joint angles drawn by each seed.",
        examples=EXAMPLES,
    )
    behaviour.add_argument(
        "--seeds", metavar="N", type=_positive, help=f"default {SEEDS}; the demo takes 5 times N"
    )
    behaviour.add_argument("--quick", action="store_true", help=f"{QUICK_SEEDS} seeds")
    behaviour.add_argument(
        "--rows", metavar="NAME", nargs="+", default=[], help="only these; see --list"
    )
    behaviour.add_argument(
        "--jobs", metavar="N", type=_positive, default=2, help="processes, default %(default)s"
    )
    behaviour.add_argument("--json", action="store_true", help="print JSON instead of the table")
    behaviour.add_argument("--out", metavar="FILE", type=Path, help="also write the JSON here")
    behaviour.add_argument("--list", action="store_true", help="list the rows and run nothing")


def run(args: argparse.Namespace) -> int:
    """List the rows, or run them, report, and say by the exit code whether all pass."""
    from controller.bench.families import find_families

    families = find_families(args.rows)
    if args.list:
        _print_list(families)
        return ExitCode.OK
    if args.out is not None:
        _check_folder(args.out)  # before the run: its results must not be lost
    report = _measure(families, args)
    if args.out is not None:
        _write_aside(report, args.out)
    _print(report, as_json=args.json)
    return ExitCode.OK if report.ok else ExitCode.FAILED


def _measure(families: tuple[Family, ...], args: argparse.Namespace) -> BenchReport:
    from controller.bench.report import summarise
    from controller.bench.runner import run_families

    seeds = args.seeds or (QUICK_SEEDS if args.quick else SEEDS)
    with ProgressLine(sys.stderr) as line:

        def show(progress: BenchProgress) -> None:
            place = f"{progress.done}/{progress.count} {progress.family}, seed {progress.seed}"
            failed = progress.measurement.reason or "; ".join(
                f"{row}: {why}" for row, why in progress.measurement.failures.items()
            )
            line.done(f"{place}: {failed or 'ok'}")
            line.update(progress.done / progress.count, place)

        line.update(0.0, "starting")
        return summarise(families, run_families(families, seeds, args.jobs, show))


def _print(report: BenchReport, *, as_json: bool) -> None:
    from controller.bench.report import render

    if as_json:
        print_json(report.as_dict())
    else:
        print(render(report))


def _print_list(families: tuple[Family, ...]) -> None:
    from controller.bench.report import bar_text

    for family in families:
        print(family.name)
        for item, rows in groupby(family.rows, key=lambda row: row.item):
            print(f"  {item}")
            for row in rows:
                print(f"    {row.quantity:<30}{bar_text(row)}")


def _check_folder(path: Path) -> None:
    if not path.parent.is_dir():
        raise ConfigError(f"the folder of --out does not exist: {path.parent}")
    if path.is_dir():
        raise ConfigError(f"--out is a folder: {path}")


def _write_aside(report: BenchReport, path: Path) -> None:
    """Writes a file beside ``path`` and renames it, so that ``path`` is never half written."""
    aside = path.with_name(f".{path.name}.part")
    aside.write_text(json.dumps(report.as_dict(), indent=2) + "\n", encoding="utf-8")
    aside.replace(path)


def _positive(text: str) -> int:
    value = int(text)
    if value < 1:
        raise argparse.ArgumentTypeError(f"must be at least 1, got {value}")
    return value
