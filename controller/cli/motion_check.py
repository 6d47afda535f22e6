"""``go2-wbc check``: can the robot do these motions? Nothing is simulated."""

from __future__ import annotations

import argparse
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

from controller.cli.common import ExitCode, Subparsers, add_parser, print_json
from controller.cli.motion_args import add_motion, add_world, meant, print_verdict, world_of
from controller.cli.progress import ProgressLine

if TYPE_CHECKING:
    from motions import FeasibilityReport, Suggestion

EXAMPLES = """
go2-wbc check                     every motion of the library, a line each
go2-wbc check wave                one motion, every limit
go2-wbc check wave --set times=5
go2-wbc check wave --friction 0.4 --payload 3
go2-wbc check my_motion.py        every motion of your own file
go2-wbc check my_motion.py --fix  what would make it feasible
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
    parser.add_argument(
        "--fix",
        action="store_true",
        help="look for the least change that makes a refused motion feasible",
    )
    add_world(parser)
    parser.add_argument("--json", action="store_true", help="print JSON")


def run(args: argparse.Namespace) -> int:
    """Check, print, and say by the exit code whether all is feasible."""
    from motions import FeasibilityChecker, suggest

    lines = meant(args.motion, args.values)
    reports: list[FeasibilityReport] = []
    changes: dict[str, Sequence[Suggestion]] = {}
    with ProgressLine(is_quiet=args.json) as progress:
        checker = FeasibilityChecker(world=world_of(args), progress=progress.solving)
        for number, line in enumerate(lines):
            progress.update(number / len(lines), line.name)
            reports.append(checker.check(line))
            if args.fix and not reports[-1].ok:
                progress.update((number + 0.5) / len(lines), f"{line.name}: changes")
                changes[line.name] = suggest(line, checker=checker)
    if args.json:
        print_json([_as_dict(report, changes) for report in reports])
    else:
        _print(reports, changes)
    return ExitCode.OK if all(report.ok for report in reports) else ExitCode.FAILED


def _print(
    reports: Sequence[FeasibilityReport], changes: Mapping[str, Sequence[Suggestion]]
) -> None:
    """Every limit of one motion, or a verdict each of several; then what would mend them."""
    if len(reports) == 1:
        print(reports[0].table())
        for finding in reports[0].failures:
            print(f"x {finding}")
    else:
        for report in reports:
            print_verdict(report)
    for name, found in changes.items():
        _print_changes(name, found)


def _print_changes(name: str, found: Sequence[Suggestion]) -> None:
    """What to append to the motion ``name`` to make it feasible, the least change first."""
    if not found:
        print(f"\n{name}: no change of tempo, size, height or shift time makes it feasible.")
        return
    print(f"\n{name} is feasible with one of these appended, the least change first:")
    for one in found:
        print(f"    {one}")


def _as_dict(
    report: FeasibilityReport, changes: Mapping[str, Sequence[Suggestion]]
) -> dict[str, Any]:
    found = changes.get(report.motion)
    more = {} if found is None else {"suggestions": [one.as_dict() for one in found]}
    return {**report.as_dict(), **more}
