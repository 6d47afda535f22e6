"""What the commands of the benchmarks share: their options, running studies, what is told."""

from __future__ import annotations

import argparse
import json
import sys
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import partial
from itertools import groupby
from pathlib import Path
from typing import Any

from benchmarks import store
from benchmarks.report import render, summarise, threshold_text
from benchmarks.store import Store
from benchmarks.study import (
    IDEAL,
    IMU,
    Measurement,
    Results,
    Study,
    Task,
    chosen_studies,
    run_tasks,
    tasks_of,
)
from controller.cli.common import ExitCode, Subparsers, add_parser, print_json
from controller.cli.progress import ProgressLine
from controller.cli.sweep import tell
from controller.sweeps.rows import Row
from controller.sweeps.run import SweepResult, sweep
from controller.sweeps.trials import Trial
from go2_wbc.errors import ConfigError
from go2_wbc.files import checked_output, write_atomically

SEEDS, QUICK_SEEDS = 20, 3


@dataclass(frozen=True, slots=True)
class Benchmark:
    """A command that runs studies; ``register`` and ``run`` are those of its module.

    Attributes:
        name: what the command line takes.
        description: of its help; the exit code is told besides.
        studies: in the order of the report.
        takes: how long it takes, for the help.
        examples: arguments, for the help, besides those that all have.
        more_seeds: what the help says of the number of seeds, besides the default.
        sensors: whether they can be chosen.
        runs: how often a study that draws nothing is run, one after the other; 0 for seeds.
        jobs: processes of such runs; 0 for none but this one.
    """

    name: str
    description: str
    studies: Sequence[Study]
    takes: str = ""
    examples: tuple[str, ...] = ()
    more_seeds: str = ""
    sensors: bool = False
    runs: int = 0
    jobs: int = 1

    def register(self, subparsers: Subparsers) -> None:
        """Add the command and its options."""
        judged = "Exit code 0 if every threshold is met, 1 if one is not."
        lines = [
            f"          {self.takes or 'everything'}",
            *([] if self.runs else [f"--quick   {QUICK_SEEDS} seeds"]),
            "--list    metrics and thresholds",
            *self.examples,
        ]
        parser = add_parser(
            subparsers,
            self.name,
            f"{self.description}\n{judged}",
            examples="\n".join(f"python -m benchmarks {self.name} {line}" for line in lines),
        )
        if self.runs:
            add_runs(parser, self.studies, self.runs)
            parser.set_defaults(jobs=self.jobs)
        else:
            add_seeds(parser, self.more_seeds, has_sensors=self.sensors)

    def run(self, args: argparse.Namespace) -> int:
        """Run what was asked for, report; the exit code says whether all thresholds are met."""
        if self.runs:
            studies = chosen_studies(self.studies, args.names)
            return run_and_report(args, studies, tasks_of(studies, args.runs))
        sensors = getattr(args, "sensors", IDEAL)
        studies = [study for study in self.studies if study.has_sensors or sensors == IDEAL]
        studies = [on_sensors(study, sensors) for study in chosen_studies(studies, args.rows)]
        return run_and_report(args, studies, tasks_of(studies, seeds_of(args)))


# --- options --------------------------------------------------------------------------------------


def add_seeds(
    parser: argparse.ArgumentParser, more: str = "", *, has_sensors: bool = False
) -> None:
    """Add how many seeds, which rows, and what every benchmark has; ``more``: of the seeds."""
    if has_sensors:
        add_sensors(parser)
    parser.add_argument("--seeds", metavar="N", type=positive, help=f"default {SEEDS}{more}")
    parser.add_argument("--quick", action="store_true", help=f"{QUICK_SEEDS} seeds")
    parser.add_argument(
        "--rows", metavar="NAME", nargs="+", default=[], help="only these scenarios; see --list"
    )
    add_options(parser, has_jobs=True, has_list=True)


def add_sensors(parser: argparse.ArgumentParser) -> None:
    """Add what the controller is given of the robot's state."""
    parser.add_argument(
        "--sensors",
        choices=(IDEAL, IMU),
        default=IDEAL,
        help="true state, or the robot's own sensors; default %(default)s",
    )


def add_runs(parser: argparse.ArgumentParser, studies: Sequence[Study], default: int) -> None:
    """Add which studies are run, and how often."""
    names = ", ".join(dict.fromkeys(name for s in studies for name in (s.group, s.name) if name))
    parser.add_argument("names", metavar="NAME", nargs="*", help=f"{names}; default: all")
    parser.add_argument(
        "--runs", metavar="N", type=positive, default=default, help="default %(default)s"
    )
    add_options(parser, has_list=True)


def add_options(
    parser: argparse.ArgumentParser, *, has_jobs: bool = False, has_list: bool = False
) -> None:
    """Add what several benchmarks take."""
    if has_list:
        parser.add_argument("--list", action="store_true", help="list the metrics, run nothing")
    if has_jobs:
        add_jobs(parser, 2)
    parser.add_argument(
        "--resume", action="store_true", help="skip what an interrupted run has finished"
    )
    add_output(parser)


def add_sweep(parser: argparse.ArgumentParser, *, jobs: int) -> None:
    """Add what benchmarks take that are one sweep; ``jobs`` is the default."""
    parser.add_argument(
        "--rows", metavar="FILE", type=Path, help=f"keep rows here, default in {store.FOLDER}"
    )
    add_jobs(parser, jobs)
    add_output(parser)


def add_jobs(parser: argparse.ArgumentParser, default: int) -> None:
    """Add how many processes run at a time."""
    parser.add_argument(
        "--jobs", metavar="N", type=positive, default=default, help="processes, default %(default)s"
    )


def add_output(parser: argparse.ArgumentParser) -> None:
    """Add where the result goes; a file is checked before the run already."""
    parser.add_argument("--json", action="store_true", help="print JSON instead of the table")
    parser.add_argument(
        "--out",
        metavar="FILE",
        type=lambda name: checked_output(name, [".json"]),
        help="also write the JSON here",
    )


def positive(text: str) -> int:
    """The type of an option that counts from 1."""
    value = int(text)
    if value < 1:
        raise argparse.ArgumentTypeError(f"must be at least 1, got {value}")
    return value


def seeds_of(args: argparse.Namespace) -> int:
    """How many seeds were asked for, by the options of ``add_seeds``."""
    return args.seeds or (QUICK_SEEDS if args.quick else SEEDS)


# --- runs -----------------------------------------------------------------------------------------


def on_sensors(study: Study, sensors: str) -> Study:
    """The study with a plant of these ``sensors``; kept on disk under a name of its own."""
    if sensors == IDEAL:
        return study
    measure = partial(_measure_on, measure=study.measure, sensors=sensors)
    return replace(study, name=f"{study.name}, {sensors}", measure=measure)


def _measure_on(trial: Trial, measure: Callable[[Trial], Measurement], sensors: str) -> Measurement:
    return measure(replace(trial, sensors=sensors))


def run_and_report(
    args: argparse.Namespace, studies: Sequence[Study], tasks: Sequence[Task]
) -> int:
    """List the metrics or run the tasks; print and write the report; return the exit code."""
    if args.list:
        _print_list(studies)
        return ExitCode.OK
    report = summarise(studies, measure_all(args, tasks))
    publish(args, report.as_dict(), render(report))
    return ExitCode.OK if report.ok else ExitCode.FAILED


def measure_all(args: argparse.Namespace, tasks: Sequence[Task]) -> Results:
    """Run the tasks, tell of every result on standard error, and keep it on disk at once."""
    studies = {study.name: study for study, _ in tasks}
    results: Results = {name: {} for name in studies}
    folder = store.FOLDER / args.command
    with Store(folder, studies.values(), resume=args.resume) as kept, ProgressLine() as line:
        if kept.finished:
            print(f"{len(kept.finished)} finished trials are taken from {folder}", file=sys.stderr)
        left = [(s, seed) for s, seed in tasks if (s.name, seed) not in kept.finished]
        for study, seed in tasks:
            if measurement := kept.finished.get((study.name, seed)):
                results[study.name][seed] = measurement
        line.update(0.0, "starting")
        for study, seed, measurement in run_tasks(left, args.jobs):
            kept.add(study, seed, measurement)
            results[study.name][seed] = measurement
            done = sum(map(len, results.values()))
            place = f"{done}/{len(tasks)} {study.name}, seed {seed}"
            failures = [f"{metric}: {why}" for metric, why in measurement.failures.items()]
            line.done(f"{place}: {measurement.reason or '; '.join(failures) or 'ok'}")
            line.update(done / len(tasks), place)
    return results


def run_sweep(
    args: argparse.Namespace,
    trial: Callable[[int], object],
    n: int,
    *,
    is_enough: Callable[[Sequence[Row]], bool] | None = None,
) -> SweepResult:
    """Run those of ``n`` seeds whose rows are not kept yet, and tell of the progress.

    Args:
        args: with the options of ``add_sweep``.
        trial: a function ``(seed) -> row`` of a module.
        n: how many seeds.
        is_enough: see ``controller.sweep``.

    Raises:
        ConfigError: if the folder of the rows cannot be made, or they depend on something else.
    """
    rows: Path = args.rows or store.FOLDER / f"{args.command}.sqlite"
    try:
        rows.parent.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise ConfigError(f"cannot make the folder of {rows}: {error.strerror}") from error
    with ProgressLine() as line:
        return sweep(
            trial,
            n,
            workers=args.jobs,
            out=rows,
            keep_going=True,
            is_enough=is_enough,
            on_progress=lambda progress: tell(line, progress),
        )


# --- output ---------------------------------------------------------------------------------------


def publish(args: argparse.Namespace, values: dict[str, Any], table: str) -> None:
    """Print the table or the JSON, and write the JSON where it was asked for."""
    if args.out is not None:
        write_atomically(args.out, (json.dumps(values, indent=2) + "\n").encode())
    if args.json:
        print_json(values)
    else:
        print(table)


def _print_list(studies: Sequence[Study]) -> None:
    for study in studies:
        print(study.name)
        for item, metrics in groupby(study.metrics, key=lambda metric: metric.item):
            print(f"  {item}")
            for metric in metrics:
                print(f"    {metric.quantity:<30}{threshold_text(metric)}")
