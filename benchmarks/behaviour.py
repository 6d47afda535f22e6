"""``python -m benchmarks behaviour``: what the robot does in MuJoCo, over many seeds."""

from __future__ import annotations

import argparse

from benchmarks import goals, high_fives, library, model, postures, sequence, slaps, trotting
from benchmarks.scenario import Scenario
from benchmarks.seeded import IDEAL, add_seeded_options, run_seeded
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
OF_EQUATIONS = 2
"""The first ones, which ask no plant's sensors."""
EXAMPLES = """
python -m benchmarks behaviour            everything; 11 minutes, two cores
python -m benchmarks behaviour --quick    three seeds
python -m benchmarks behaviour --resume   go on after an interruption
python -m benchmarks behaviour --list     the metrics and their thresholds
python -m benchmarks behaviour --rows stand trot --jobs 4
python -m benchmarks behaviour --json --out behaviour.json
python -m benchmarks behaviour --sensors imu --seeds 4
"""


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
    add_seeded_options(parser, "; the demo takes 5 times N", has_sensors=True)


def run(args: argparse.Namespace) -> int:
    """Run what was asked for; see ``run_seeded``."""
    on_robots = SCENARIOS if args.sensors == IDEAL else SCENARIOS[OF_EQUATIONS:]
    return run_seeded(args, on_robots)
