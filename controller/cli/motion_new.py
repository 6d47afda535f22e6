"""``go2-wbc new``: a file with a small motion to start from."""

from __future__ import annotations

import argparse
import keyword
from pathlib import Path

from controller.cli.common import ExitCode, Subparsers, add_parser, print_json
from go2_wbc.errors import CommandError, ConfigError

EXAMPLES = """
go2-wbc new greet            writes greet.py
go2-wbc new greet --out motions_of_mine
"""

STARTER = '''"""{title}: a motion for the Go2.

    go2-wbc check {name}.py      can the robot do it?
    go2-wbc preview {name}.py    watch it; the page follows every save of this file
    go2-wbc run {name}.py        play it in MuJoCo
"""

from typing import Annotated

from motions import Range, Timeline, deg, motion


@motion
def {name}(taps: Annotated[int, Range(1, 5)] = 2) -> Timeline:
    """{title}: bow, then tap the ground with a front paw."""
    # The trunk: metres and radians from where it stands; deg() turns degrees into radians.
    line = Timeline().body(pitch=deg(15), z=-0.04, over=0.8).hold(0.3).home(over=0.8)
    # A foot that is raised leaves the ground; the trunk moves over the other three by itself.
    for _ in range(taps):
        line = line.foot("FR", z=0.06, over=0.4).down("FR", over=0.3)
    # home() puts every foot down and brings the trunk back: always end with it.
    return line.home(over=0.8)
'''


def register(subparsers: Subparsers) -> None:
    """Add the options of ``new``."""
    parser = add_parser(
        subparsers, "new", "Write a small, commented motion to start from.", examples=EXAMPLES
    )
    parser.add_argument("name", metavar="NAME", help="of the motion and its file")
    parser.add_argument("--out", metavar="DIR", type=Path, default=Path(), help="default: here")
    parser.add_argument("--json", action="store_true", help="print JSON")


def run(args: argparse.Namespace) -> int:
    """Write the file; never over another one."""
    from go2_wbc.files import checked_output, write_atomically

    if not args.name.isidentifier() or keyword.iskeyword(args.name):
        raise CommandError(f"NAME must be a Python name such as my_motion, got {args.name!r}")
    target = checked_output(args.out / f"{args.name}.py", [".py"])
    if target.exists():
        raise ConfigError(f"{args.out / target.name} exists already: choose another name")
    title = args.name.replace("_", " ").capitalize()
    write_atomically(target, STARTER.format(name=args.name, title=title).encode())
    if args.json:
        print_json({"motion": args.name, "file": str(target)})
    else:
        print(f"wrote {args.out / target.name}; now: go2-wbc check {args.out / target.name}")
    return ExitCode.OK
