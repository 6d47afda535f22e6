"""``python -m benchmarks behaviour``: what the robot does in MuJoCo, over many seeds."""

from __future__ import annotations

import argparse

from benchmarks import goals, high_fives, library, model, postures, sequence, slaps, trotting
from benchmarks.scenario import Scenario, chosen_scenarios
from benchmarks.session import add_options, positive, run_and_report, tasks_of
from controller.cli.common import Subparsers, add_parser

SCENARIOS: tuple[Scenario, ...] = (
    model.AGREEMENT,
    model.SOLUTIONS,
    postures.STAND,
    postures.PUSHES,
    trotting.TROT,
    trotting.PUSHES,
    goals.SCENARIO,
    high_fives.SCENARIO,
    slaps.SCENARIO,
    library.SCENARIO,
    sequence.SCENARIO,
)
"""In the order of the report."""
EXAMPLES = """
python -m benchmarks behaviour            everything; 11 minutes, two cores
python -m benchmarks behaviour --quick    three seeds
python -m benchmarks behaviour --resume   go on after an interruption
python -m benchmarks behaviour --list     the metrics and their thresholds
python -m benchmarks behaviour --rows stand trot --jobs 4
python -m benchmarks behaviour --json --out behaviour.json
"""
SEEDS, QUICK_SEEDS = 20, 3


def register(subparsers: Subparsers) -> None:
    """Add the options of ``behaviour``."""
    parser = add_parser(
        subparsers,
        "behaviour",
        "Stand, trot, pushes, goals, high five, slaps, the motions and the whole demo\n"
        "in MuJoCo, with friction, mass, heading and joint angles drawn by each seed.\n"
        "Exit code 0 if every threshold is met, 1 if one is not.",
        examples=EXAMPLES,
    )
    parser.add_argument(
        "--seeds", metavar="N", type=positive, help=f"default {SEEDS}; the demo takes 5 times N"
    )
    parser.add_argument("--quick", action="store_true", help=f"{QUICK_SEEDS} seeds")
    parser.add_argument(
        "--rows", metavar="NAME", nargs="+", default=[], help="only these scenarios; see --list"
    )
    add_options(parser, has_jobs=True, has_list=True)


def run(args: argparse.Namespace) -> int:
    """Run what was asked for, report, and say by the exit code whether all thresholds are met."""
    scenarios = chosen_scenarios(SCENARIOS, args.rows)
    seeds = args.seeds or (QUICK_SEEDS if args.quick else SEEDS)
    return run_and_report(args, scenarios, tasks_of(scenarios, seeds))
