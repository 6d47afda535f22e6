"""``go2-wbc list``: the motions of the library, or of a file, and their parameters."""

from __future__ import annotations

import argparse
import textwrap
from typing import TYPE_CHECKING

from controller.cli.common import ExitCode, Subparsers, add_parser, print_json

if TYPE_CHECKING:
    from motions import Motion

EXAMPLES = """
go2-wbc list                 the library
go2-wbc list my_motion.py    the motions of your own file
go2-wbc list --json          the same for a program to read
"""
WIDTH = 80


def register(subparsers: Subparsers) -> None:
    """Add the options of ``list``."""
    parser = add_parser(
        subparsers, "list", "List motions, what they do and what can be set.", examples=EXAMPLES
    )
    parser.add_argument("file", metavar="FILE.py", nargs="?", help="instead of the library")
    parser.add_argument("--json", action="store_true", help="print JSON")


def run(args: argparse.Namespace) -> int:
    """Print the list."""
    from motions import find_motion, load_file, motion_names

    if args.file is None:
        found = [find_motion(name) for name in motion_names()]
    else:
        found = list(load_file(args.file).values())
    if args.json:
        print_json([_as_dict(motion) for motion in found])
        return ExitCode.OK
    column = max(len(motion.name) for motion in found) + 2
    indent = " " * column
    for motion in found:
        head = motion.name.ljust(column)
        print(textwrap.fill(head + motion.summary, WIDTH, subsequent_indent=indent))
        for parameter in motion.parameters:
            print(f"{indent}--set {parameter}")
    return ExitCode.OK


def _as_dict(motion: Motion) -> dict[str, object]:
    values = {item.name: [item.default, str(item.valid)] for item in motion.parameters}
    return {"name": motion.name, "summary": motion.summary, "parameters": values}
