"""``python -m benchmarks bridges``: ROS 2 and Unitree's protocol, measured between processes."""

from __future__ import annotations

import argparse
import sys

from benchmarks.bridges import ros2, ros2_faults, unitree, unitree_faults
from benchmarks.scenario import Scenario, chosen_scenarios
from benchmarks.session import add_options, positive, run_and_report, tasks_of
from controller.bridges.unitree.extra import require_dds
from controller.cli.common import Subparsers, add_parser
from go2_wbc.errors import MissingDependency

SCENARIOS: tuple[Scenario, ...] = (
    ros2.SCENARIO,
    ros2_faults.SCENARIO,
    *unitree.SCENARIOS,
    unitree_faults.SCENARIO,
)
REQUIREMENTS = {"ros2": ros2.require, "unitree": require_dds}
"""By group: raises ``MissingDependency`` if what it needs is not installed."""
EXAMPLES = """
python -m benchmarks bridges              two minutes each; needs the extras
python -m benchmarks bridges ros2 --runs 5
python -m benchmarks bridges --list       the metrics and their thresholds
python -m benchmarks bridges --json --out bridges.json
"""


def register(subparsers: Subparsers) -> None:
    """Add the options of ``bridges``."""
    parser = add_parser(
        subparsers,
        "bridges",
        "A server in a process of its own, on the loopback: answers, losses, latencies,\n"
        "and the robot driven through them. Needs the extras; wants an idle machine.",
        examples=EXAMPLES,
    )
    parser.add_argument(
        "names", metavar="NAME", nargs="*", help="ros2, unitree, or a name of --list; default: all"
    )
    parser.add_argument("--runs", metavar="N", type=positive, default=1, help="default %(default)s")
    add_options(parser, has_list=True)


def run(args: argparse.Namespace) -> int:
    """Run what was asked for and can be run; without names, what cannot is only told."""
    scenarios = chosen_scenarios(SCENARIOS, args.names)
    for group in () if args.list else dict.fromkeys(s.group for s in scenarios):
        try:
            REQUIREMENTS[group]()
        except MissingDependency as error:
            print(f"{group} is not measured: {error}", file=sys.stderr)
            scenarios = tuple(s for s in scenarios if s.group != group)
            if args.names or not scenarios:
                raise
    return run_and_report(args, scenarios, tasks_of(scenarios, args.runs))
