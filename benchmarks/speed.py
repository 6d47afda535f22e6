"""``python -m benchmarks speed``: what things cost in processor time.

Ratios come from interleaved measurements (A B A B ...) of the same states in one process, so that
what else the machine does falls on all alike. Bars in microseconds are meant for one machine, by
the time that PlaCo takes on it, and are scaled to the one that measures. Wants an idle machine all
the same.
"""

from __future__ import annotations

import argparse

from benchmarks import (
    speed_check,
    speed_parts,
    speed_realtime,
    speed_solves,
    speed_startup,
    speed_ticks,
)
from benchmarks.scenario import Scenario, chosen_scenarios
from benchmarks.session import add_options, positive, run_and_report, tasks_of
from controller.cli.common import Subparsers, add_parser

EXAMPLES = """
python -m benchmarks speed                   all, three times: ten minutes
python -m benchmarks speed solves ticks --runs 5
python -m benchmarks speed --json --out speed.json
python -m benchmarks evidence docs/explanation/speed.md speed.json
"""

SCENARIOS = (
    Scenario("solves", speed_solves.METRICS, speed_solves.measure_solves),
    Scenario("ticks", speed_ticks.TICK_METRICS, speed_ticks.measure_ticks),
    Scenario("estimated", speed_ticks.ESTIMATED_METRICS, speed_ticks.measure_estimated),
    Scenario("parts", speed_parts.METRICS, speed_parts.measure_parts),
    Scenario("commands", speed_ticks.COMMAND_METRICS, speed_ticks.measure_commands),
    Scenario("checks", speed_check.CHECK_METRICS, speed_check.measure_checks),
    Scenario("startup", speed_startup.METRICS, speed_startup.measure_startup),
    Scenario("realtime", speed_realtime.METRICS, speed_realtime.measure_realtime),
)


def register(subparsers: Subparsers) -> None:
    """Add the options of ``speed``."""
    parser = add_parser(
        subparsers,
        "speed",
        "Processor time of the whole-body QP beside PlaCo's on the same states in turn,\n"
        "of whole ticks with 2 ms of physics, of checking a motion, of starts; and ticks\n"
        "late at the pace of the wall clock. Wants an idle machine.",
        examples=EXAMPLES,
    )
    names = ", ".join(scenario.name for scenario in SCENARIOS)
    parser.add_argument("names", metavar="NAME", nargs="*", help=f"{names}; default: all")
    parser.add_argument("--runs", metavar="N", type=positive, default=3, help="default %(default)s")
    add_options(parser, has_list=True)


def run(args: argparse.Namespace) -> int:
    """Measure what was asked for, and report."""
    scenarios = chosen_scenarios(SCENARIOS, args.names)
    return run_and_report(args, scenarios, tasks_of(scenarios, args.runs))
