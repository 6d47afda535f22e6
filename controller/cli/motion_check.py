"""``go2-wbc check``: can the robot do these motions? Nothing is simulated."""

from __future__ import annotations

import argparse

from controller.cli.common import ExitCode, Subparsers, add_parser, print_json
from controller.cli.motion_args import add_motion, add_world, meant, print_verdict, world_of
from controller.cli.progress import ProgressLine

EXAMPLES = """
go2-wbc check                     every motion of the library, a line each
go2-wbc check wave                one motion, every limit
go2-wbc check wave --set times=5
go2-wbc check wave --friction 0.4 --payload 3
go2-wbc check my_motion.py        every motion of your own file
go2-wbc check bow --json          the same for a program to read
"""


def register(subparsers: Subparsers) -> None:
    """Add the options of ``check``."""
    parser = add_parser(
        subparsers,
        "check",
        "Check motions: reach, joint limits, torque, support, friction, load of the\n"
        "feet, collisions, landings. Exit code 0 if the robot can do all of them,\n"
        "1 if it cannot do one.",
        examples=EXAMPLES,
    )
    add_motion(parser, many=True)
    add_world(parser)
    parser.add_argument("--json", action="store_true", help="print JSON")


def run(args: argparse.Namespace) -> int:
    """Check, print, and say by the exit code whether all is feasible."""
    from motions import FeasibilityChecker

    lines = meant(args.motion, args.values)
    checker = FeasibilityChecker(world=world_of(args))
    reports = []
    with ProgressLine() as progress:
        for number, line in enumerate(lines):
            progress.update(number / len(lines), line.name)
            reports.append(checker.check(line))
    if args.json:
        print_json([report.as_dict() for report in reports])
    elif len(reports) == 1:
        print(reports[0].table())
        for finding in reports[0].failures:
            print(f"x {finding}")
    else:
        for report in reports:
            print_verdict(report)
    return ExitCode.OK if all(report.ok for report in reports) else ExitCode.FAILED
