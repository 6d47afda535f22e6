"""What the commands of the benchmarks share: options, progress, results on disk, output."""

from __future__ import annotations

import argparse
import json
import sys
from collections.abc import Callable, Sequence
from itertools import groupby
from pathlib import Path
from typing import Any

from benchmarks.report import render, summarise, threshold_text
from benchmarks.results_log import ResultsLog
from benchmarks.runner import Results, Task, run_tasks
from benchmarks.scenario import Scenario
from controller.cli.common import ExitCode, print_json
from controller.cli.progress import ProgressLine
from controller.cli.sweep import tell
from controller.sweeps.rows import Row
from controller.sweeps.run import SweepResult, sweep
from go2_wbc.errors import ConfigError
from go2_wbc.files import checked_output, write_atomically

LOG_FOLDER = Path("out/benchmarks")
"""Where finished trials are kept, one file for each benchmark."""


def add_options(
    parser: argparse.ArgumentParser, *, has_jobs: bool = False, has_list: bool = False
) -> None:
    """Add what several benchmarks take."""
    if has_list:
        parser.add_argument("--list", action="store_true", help="list the metrics, run nothing")
    if has_jobs:
        parser.add_argument(
            "--jobs", metavar="N", type=positive, default=2, help="processes, default %(default)s"
        )
    parser.add_argument(
        "--resume", action="store_true", help="skip what an interrupted run has finished"
    )
    parser.add_argument("--json", action="store_true", help="print JSON instead of the table")
    parser.add_argument("--out", metavar="FILE", type=_output, help="also write the JSON here")


def positive(text: str) -> int:
    """The type of an option that counts from 1."""
    value = int(text)
    if value < 1:
        raise argparse.ArgumentTypeError(f"must be at least 1, got {value}")
    return value


def _output(name: str) -> Path:
    """The type of ``--out``: writable before the run already, so that no result can be lost."""
    return checked_output(name, [".json"])


def add_sweep_options(parser: argparse.ArgumentParser, *, jobs: int) -> None:
    """Add what benchmarks take that are a sweep; ``jobs`` is the default."""
    parser.add_argument(
        "--rows", metavar="FILE", type=Path, help=f"keep rows here, default in {LOG_FOLDER}"
    )
    parser.add_argument(
        "--jobs", metavar="N", type=positive, default=jobs, help="processes, default %(default)s"
    )
    parser.add_argument("--json", action="store_true", help="print JSON instead of the table")
    parser.add_argument("--out", metavar="FILE", type=_output, help="also write the JSON here")


def run_sweep(
    args: argparse.Namespace,
    trial: Callable[[int], object],
    n: int,
    *,
    is_enough: Callable[[Sequence[Row]], bool] | None = None,
) -> SweepResult:
    """Run those of ``n`` seeds whose rows are not kept yet, and tell of the progress.

    Args:
        args: with the options of ``add_sweep_options``.
        trial: a function ``(seed) -> row`` of a module.
        n: how many seeds.
        is_enough: see ``controller.sweep``.

    Raises:
        ConfigError: if the folder of the rows cannot be made, or they depend on something else.
    """
    rows: Path = args.rows or LOG_FOLDER / f"{args.command}.sqlite"
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


def tasks_of(scenarios: Sequence[Scenario], seeds: int) -> list[Task]:
    """Every scenario on its seeds 0, 1, ...; their number is multiplied by its factor."""
    return [(s, seed) for s in scenarios for seed in range(seeds * s.seed_factor)]


def run_and_report(
    args: argparse.Namespace, scenarios: Sequence[Scenario], tasks: Sequence[Task]
) -> int:
    """List the metrics or run the tasks; print and write the report; return the exit code."""
    if args.list:
        _print_list(scenarios)
        return ExitCode.OK
    report = summarise(scenarios, measure_all(args, tasks))
    publish(args, report.as_dict(), render(report))
    return ExitCode.OK if report.ok else ExitCode.FAILED


def measure_all(args: argparse.Namespace, tasks: Sequence[Task]) -> Results:
    """Run the tasks, tell of every result on standard error, and keep it on disk at once."""
    results: Results = {scenario.name: {} for scenario, _ in tasks}
    log = ResultsLog(LOG_FOLDER / f"{args.command}.jsonl", resume=args.resume)
    if log.remark:
        print(log.remark, file=sys.stderr)
    left = []
    for scenario, seed in tasks:
        if measurement := log.finished.get((scenario.name, seed)):
            results[scenario.name][seed] = measurement
        else:
            left.append((scenario, seed))
    with ProgressLine() as line:
        line.update(0.0, "starting")
        for scenario, seed, measurement in run_tasks(left, getattr(args, "jobs", 1)):
            log.append(scenario.name, seed, measurement)
            results[scenario.name][seed] = measurement
            done = sum(map(len, results.values()))
            place = f"{done}/{len(tasks)} {scenario.name}, seed {seed}"
            failures = [f"{metric}: {why}" for metric, why in measurement.failures.items()]
            line.done(f"{place}: {measurement.reason or '; '.join(failures) or 'ok'}")
            line.update(done / len(tasks), place)
    return results


def publish(args: argparse.Namespace, values: dict[str, Any], table: str) -> None:
    """Print the table or the JSON, and write the JSON where it was asked for."""
    if args.out is not None:
        write_atomically(args.out, (json.dumps(values, indent=2) + "\n").encode())
    if args.json:
        print_json(values)
    else:
        print(table)


def _print_list(scenarios: Sequence[Scenario]) -> None:
    for scenario in scenarios:
        print(scenario.name)
        for item, metrics in groupby(scenario.metrics, key=lambda metric: metric.item):
            print(f"  {item}")
            for metric in metrics:
                print(f"    {metric.quantity:<30}{threshold_text(metric)}")
