"""Benchmarks of scenarios over seeds: the options that they share, and how they are run."""

from __future__ import annotations

import argparse
from collections.abc import Sequence

from benchmarks.scenario import Scenario, chosen_scenarios
from benchmarks.session import add_options, positive, run_and_report, tasks_of

SEEDS, QUICK_SEEDS = 20, 3


def add_seeded_options(parser: argparse.ArgumentParser, more: str = "") -> None:
    """Add how many seeds, which rows, and what every benchmark has; ``more``: of the seeds."""
    parser.add_argument("--seeds", metavar="N", type=positive, help=f"default {SEEDS}{more}")
    parser.add_argument("--quick", action="store_true", help=f"{QUICK_SEEDS} seeds")
    parser.add_argument(
        "--rows", metavar="NAME", nargs="+", default=[], help="only these scenarios; see --list"
    )
    add_options(parser, has_jobs=True, has_list=True)


def run_seeded(args: argparse.Namespace, scenarios: Sequence[Scenario]) -> int:
    """Run what was asked for, report, and say by the exit code whether all thresholds are met."""
    chosen = chosen_scenarios(scenarios, args.rows)
    seeds = args.seeds or (QUICK_SEEDS if args.quick else SEEDS)
    return run_and_report(args, chosen, tasks_of(chosen, seeds))
