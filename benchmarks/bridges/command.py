"""``python -m benchmarks bridges``: ROS 2 and Unitree's protocol, measured between processes."""

import argparse
import sys

from benchmarks.bridges import ros2, unitree
from benchmarks.command import Benchmark, run_and_report
from benchmarks.study import chosen_studies, tasks_of
from controller.bridges.unitree import require_dds
from go2_wbc.errors import MissingDependency

STUDIES = (ros2.STUDY, *unitree.STUDIES)
REQUIREMENTS = {"ros2": ros2.require, "unitree": require_dds}
"""By group: raises ``MissingDependency`` if what it needs is not installed."""
BENCHMARK = Benchmark(
    "bridges",
    "A server in a process of its own, on the loopback: answers, losses, latencies,\n"
    "and the robot driven through them. Needs the extras; wants an idle machine.",
    STUDIES,
    takes="two minutes each; needs the extras",
    examples=(
        "ros2 --runs 5",
        "--json --out bridges.json",
    ),
    runs=1,
)
register = BENCHMARK.register


def run(args: argparse.Namespace) -> int:
    """Run what was asked for and can be run; without names, what cannot is only told."""
    studies = chosen_studies(STUDIES, args.names)
    for group in () if args.list else dict.fromkeys(s.group for s in studies):
        try:
            REQUIREMENTS[group]()
        except MissingDependency as error:
            print(f"{group} is not measured: {error}", file=sys.stderr)
            studies = tuple(s for s in studies if s.group != group)
            if args.names or not studies:
                raise
    return run_and_report(args, studies, tasks_of(studies, args.runs))
