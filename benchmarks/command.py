"""What the commands of the benchmarks share: their options, running studies, what is told."""

import argparse
import json
import sys
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from itertools import groupby
from pathlib import Path
from typing import Any

from benchmarks import store
from benchmarks.report import render, summarise, threshold_text
from benchmarks.study import IDEAL, IMU, Results, Study, Task, chosen_studies, run_tasks, tasks_of
from controller.cli.common import ExitCode, ProgressLine, Subparsers, add_parser, print_json
from controller.cli.sweep import tell
from controller.sweeps.run import SweepResult, sweep
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
    """

    name: str
    description: str
    studies: Sequence[Study]
    takes: str = ""
    examples: tuple[str, ...] = ()
    more_seeds: str = ""
    sensors: bool = False
    runs: int = 0

    def register(self, subparsers: Subparsers) -> None:
        """Add the command and its options."""
        judged = "Exit code 0 if every threshold is met, 1 if one is not."
        lines = [
            f"          {self.takes or 'everything'}",
            *([] if self.runs else [f"--quick   {QUICK_SEEDS} seeds"]),
            "--list    metrics and thresholds",
            *self.examples,
        ]
        examples = "\n".join(f"python -m benchmarks {self.name} {line}" for line in lines)
        description = f"{self.description}\n{judged}"
        parser = add_parser(subparsers, self.name, description, examples=examples)
        if self.runs:
            names = dict.fromkeys(n for s in self.studies for n in (s.group, s.name) if n)
            text = f"{', '.join(names)}; default: all"
            parser.add_argument("names", metavar="NAME", nargs="*", help=text)
            add_options(parser, "runs", "list", *RESULTS)
            parser.set_defaults(runs=self.runs, jobs=1)
        else:
            sensors = ("sensors",) if self.sensors else ()
            add_options(parser, *sensors, *SEEDED, more_seeds=self.more_seeds)

    def run(self, args: argparse.Namespace) -> int:
        """Run what was asked for, report; the exit code says whether all thresholds are met."""
        if self.runs:
            studies = chosen_studies(self.studies, args.names)
            return run_and_report(args, studies, tasks_of(studies, args.runs))
        sensors = getattr(args, "sensors", IDEAL)
        studies = [study for study in self.studies if study.sensors or sensors == IDEAL]
        studies = [study.on(sensors) for study in chosen_studies(studies, args.rows)]
        return run_and_report(args, studies, tasks_of(studies, seeds_of(args)))


# --- options --------------------------------------------------------------------------------------


def positive(text: str) -> int:
    """The type of an option that counts from 1."""
    value = int(text)
    if value < 1:
        raise argparse.ArgumentTypeError(f"must be at least 1, got {value}")
    return value


_COUNT: dict[str, Any] = {"metavar": "N", "type": positive}
_FLAG: dict[str, Any] = {"action": "store_true"}
OPTIONS: dict[str, dict[str, Any]] = {
    "sensors": {
        "choices": (IDEAL, IMU),
        "default": IDEAL,
        "help": "true state, or the robot's own sensors; default %(default)s",
    },
    "seeds": {**_COUNT, "help": f"default {SEEDS}"},
    "quick": {**_FLAG, "help": f"{QUICK_SEEDS} seeds"},
    "rows": {
        **{"metavar": "NAME", "nargs": "+", "default": []},
        "help": "only these scenarios; see --list",
    },
    "runs": {**_COUNT, "help": "default %(default)s"},
    "list": {**_FLAG, "help": "list the metrics, run nothing"},
    "jobs": {**_COUNT, "default": 2, "help": "processes, default %(default)s"},
    "resume": {**_FLAG, "help": "skip what an interrupted run has finished"},
    "json": {**_FLAG, "help": "print JSON instead of the table"},
    "out": {
        "metavar": "FILE",
        "type": lambda name: checked_output(name, [".json"]),  # before the run already
        "help": "also write the JSON here",
    },
}
"""What several benchmarks take, by name."""
RESULTS = ("resume", "json", "out")
SEEDED = ("seeds", "quick", "rows", "list", "jobs", *RESULTS)


def add_options(parser: argparse.ArgumentParser, *names: str, more_seeds: str = "") -> None:
    """Add some of ``OPTIONS``; ``more_seeds`` is said of the number of seeds."""
    for name in names:
        option = OPTIONS[name]
        text = option["help"] + (more_seeds if name == "seeds" else "")
        parser.add_argument(f"--{name}", **{**option, "help": text})


def add_sweep(parser: argparse.ArgumentParser, *, jobs: int) -> None:
    """Add what benchmarks take that are one sweep; ``jobs`` is the default."""
    text = f"keep rows here, default in {store.FOLDER}"
    parser.add_argument("--rows", metavar="FILE", type=Path, help=text)
    add_options(parser, "jobs", "json", "out")
    parser.set_defaults(jobs=jobs)


def seeds_of(args: argparse.Namespace) -> int:
    """How many seeds were asked for, by the options ``SEEDED``."""
    return args.seeds or (QUICK_SEEDS if args.quick else SEEDS)


# --- runs -----------------------------------------------------------------------------------------


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
    with store.opened(folder, studies.values(), resume=args.resume) as kept, ProgressLine() as line:
        if kept.finished:
            print(f"{len(kept.finished)} finished trials are taken from {folder}", file=sys.stderr)
        left = [(s, seed) for s, seed in tasks if (s.name, seed) not in kept.finished]
        for study, seed in tasks:
            if result := kept.finished.get((study.name, seed)):
                results[study.name][seed] = result
        line.update(0.0, "starting")
        for study, seed, result in run_tasks(left, args.jobs):
            kept.add(study, seed, result)
            results[study.name][seed] = result
            done = sum(map(len, results.values()))
            place = f"{done}/{len(tasks)} {study.name}, seed {seed}"
            failures = [f"{metric}: {why}" for metric, why in result.failures.items()]
            line.done(f"{place}: {result.reason or '; '.join(failures) or 'ok'}")
            line.update(done / len(tasks), place)
    return results


def run_sweep(
    args: argparse.Namespace,
    trial: Callable[[int], object],
    n: int,
    *,
    first_seed: int = 0,
) -> SweepResult:
    """Run those of ``n`` seeds whose rows are not kept yet, and tell of the progress.

    ``args`` has the options of ``add_sweep``; the rest is as in ``controller.sweep``.

    Raises:
        ConfigError: if the folder of the rows cannot be made, or they depend on something else.
    """
    rows: Path = args.rows or store.FOLDER / f"{args.command}.sqlite"
    try:
        rows.parent.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise ConfigError(f"cannot make the folder of {rows}: {error.strerror}") from error
    with ProgressLine() as line:
        options = {"workers": args.jobs, "out": rows, "keep_going": True, "first_seed": first_seed}
        return sweep(trial, n, **options, on_progress=lambda progress: tell(line, progress))


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
