"""``go2-wbc bench``: its options. ``benchmarks``, which loads the robot, does the work."""

from __future__ import annotations

import argparse
import json
import sys
from itertools import groupby
from pathlib import Path
from typing import TYPE_CHECKING, Any

from controller.cli.common import ExitCode, Subparsers, add_parser, print_json
from controller.cli.progress import ProgressLine
from go2_wbc.errors import MissingDependency

if TYPE_CHECKING:
    from benchmarks.rows import Family
    from benchmarks.runner import BenchProgress, Results

BEHAVIOUR_EXAMPLES = """
go2-wbc bench behaviour            everything; an hour on two cores
go2-wbc bench behaviour --quick    three seeds
go2-wbc bench behaviour --list     the rows and their bars
go2-wbc bench behaviour --rows stand trot --jobs 4
go2-wbc bench behaviour --json --out behaviour.json
"""
FEASIBILITY_EXAMPLES = """
go2-wbc bench feasibility              eight minutes on two cores
go2-wbc bench feasibility --motions 40 --near 0
go2-wbc bench feasibility --json --out feasibility.json
"""
BRIDGES_EXAMPLES = """
go2-wbc bench bridges              two minutes each; needs the extras
go2-wbc bench bridges ros2 --runs 5
go2-wbc bench bridges --list       the rows and their bars
go2-wbc bench bridges --json --out bridges.json
"""
SEEDS, QUICK_SEEDS = 20, 3
MOTIONS, NEAR = 160, 64


def register(subparsers: Subparsers) -> None:
    """Add the options of ``bench``."""
    parser = add_parser(
        subparsers,
        "bench",
        "Measure over many seeds, against fixed bars.\n"
        "Exit code 0 if every bar is met, 1 if one is not.",
        examples=BEHAVIOUR_EXAMPLES + FEASIBILITY_EXAMPLES + BRIDGES_EXAMPLES,
    )
    benches: Subparsers = parser.add_subparsers(title="benches", dest="bench", required=True)
    behaviour = add_parser(
        benches,
        "behaviour",
        "Stand, trot, pushes, goals, high five, slaps, the motions and the whole demo\n"
        "in MuJoCo, with friction, mass, heading and joint angles drawn by each seed.",
        examples=BEHAVIOUR_EXAMPLES,
    )
    behaviour.add_argument(
        "--seeds", metavar="N", type=_positive, help=f"default {SEEDS}; the demo takes 5 times N"
    )
    behaviour.add_argument("--quick", action="store_true", help=f"{QUICK_SEEDS} seeds")
    behaviour.add_argument(
        "--rows", metavar="NAME", nargs="+", default=[], help="only these; see --list"
    )
    behaviour.add_argument("--list", action="store_true", help="list the rows and run nothing")
    feasibility = add_parser(
        benches,
        "feasibility",
        "Does the feasibility check foresee what physics does? Motions made by the\n"
        "dozen, good ones and broken ones, are checked and played in MuJoCo.",
        examples=FEASIBILITY_EXAMPLES,
    )
    feasibility.add_argument(
        "--motions", metavar="N", type=_positive, default=MOTIONS, help="default %(default)s"
    )
    feasibility.add_argument(
        "--near",
        metavar="N",
        type=int,
        default=NEAR,
        help="motions close to a limit, which have no bar; default %(default)s",
    )
    bridges = add_parser(
        benches,
        "bridges",
        "A server in a process of its own, on the loopback: answers, losses, latencies,\n"
        "and the robot driven through them. Needs the extras; wants an idle machine.",
        examples=BRIDGES_EXAMPLES,
    )
    bridges.add_argument(
        "names", metavar="NAME", nargs="*", help="ros2, unitree, or a name of --list; default: all"
    )
    bridges.add_argument(
        "--runs", metavar="N", type=_positive, default=1, help="default %(default)s"
    )
    bridges.add_argument("--list", action="store_true", help="list the rows and run nothing")
    for bench in (behaviour, feasibility):
        bench.add_argument(
            "--jobs", metavar="N", type=_positive, default=2, help="processes, default %(default)s"
        )
    for bench in (behaviour, feasibility, bridges):
        bench.add_argument("--json", action="store_true", help="print JSON instead of the table")
        bench.add_argument("--out", metavar="FILE", type=Path, help="also write the JSON here")


def run(args: argparse.Namespace) -> int:
    """Run what was asked for, report, and say by the exit code whether all bars are met."""
    runs = {
        "behaviour": _run_behaviour,
        "bridges": _run_bridges,
        "feasibility": _run_feasibility,
    }
    return runs[args.bench](args)


def _run_behaviour(args: argparse.Namespace) -> int:
    from benchmarks.families import find_families
    from benchmarks.report import render, summarise

    families = find_families(args.rows)
    if args.list:
        _print_list(families)
        return ExitCode.OK
    seeds = args.seeds or (QUICK_SEEDS if args.quick else SEEDS)
    target = _checked_target(args)
    report = summarise(families, _measure(families, seeds, args.jobs))
    _publish(report.as_dict(), render(report), args, target)
    return ExitCode.OK if report.ok else ExitCode.FAILED


def _run_feasibility(args: argparse.Namespace) -> int:
    from benchmarks.feasibility import FAMILY, NEAR_FAMILY, render, verdicts_of

    target = _checked_target(args)
    results = _measure((FAMILY,), args.motions, args.jobs)
    results |= _measure((NEAR_FAMILY,), args.near, args.jobs)
    verdicts, near = verdicts_of(results), verdicts_of(results, NEAR_FAMILY)
    values = {**verdicts.as_dict(), "near_limits": near.as_dict()}
    _publish(values, render(verdicts, near), args, target)
    return ExitCode.OK if verdicts.ok else ExitCode.FAILED


def _run_bridges(args: argparse.Namespace) -> int:
    from benchmarks.bridges import find_doors
    from benchmarks.report import render, summarise

    doors = find_doors(args.names)
    if args.list:
        _print_list(tuple(family for door in doors for family in door.families))
        return ExitCode.OK
    families: list[Family] = []
    missing: list[MissingDependency] = []
    for door in doors:
        try:
            door.require()
            families += door.families
        except MissingDependency as error:
            missing.append(error)
            print(f"{door.name} is not measured: {error}", file=sys.stderr)
    if missing and (args.names or not families):
        raise missing[0]
    target = _checked_target(args)
    report = summarise(families, _measure(tuple(families), args.runs, 1))
    _publish(report.as_dict(), render(report), args, target)
    return ExitCode.OK if report.ok else ExitCode.FAILED


def _measure(families: tuple[Family, ...], seeds: int, jobs: int) -> Results:
    from benchmarks.runner import run_families

    with ProgressLine(sys.stderr) as line:

        def show(progress: BenchProgress) -> None:
            place = f"{progress.done}/{progress.count} {progress.family}, seed {progress.seed}"
            failed = progress.measurement.reason or "; ".join(
                f"{row}: {why}" for row, why in progress.measurement.failures.items()
            )
            line.done(f"{place}: {failed or 'ok'}")
            line.update(progress.done / progress.count, place)

        line.update(0.0, "starting")
        return run_families(families, seeds, jobs, show)


def _checked_target(args: argparse.Namespace) -> Path | None:
    """Where the JSON goes, known to be writable before the run: its results must not be lost."""
    from go2_wbc.files import checked_output

    return None if args.out is None else checked_output(args.out, [".json"])


def _publish(
    values: dict[str, Any], table: str, args: argparse.Namespace, target: Path | None
) -> None:
    from go2_wbc.files import write_atomically

    if target is not None:
        write_atomically(target, (json.dumps(values, indent=2) + "\n").encode())
    if args.json:
        print_json(values)
    else:
        print(table)


def _print_list(families: tuple[Family, ...]) -> None:
    from benchmarks.report import bar_text

    for family in families:
        print(family.name)
        for item, rows in groupby(family.rows, key=lambda row: row.item):
            print(f"  {item}")
            for row in rows:
                print(f"    {row.quantity:<30}{bar_text(row)}")


def _positive(text: str) -> int:
    value = int(text)
    if value < 1:
        raise argparse.ArgumentTypeError(f"must be at least 1, got {value}")
    return value
