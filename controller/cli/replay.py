"""``go2-wbc replay``: a row of a motion's sweep, run again and shown."""

from __future__ import annotations

import argparse
from pathlib import Path

from controller.cli.common import ExitCode, Subparsers, add_parser, print_json, shown_path
from controller.cli.progress import ProgressLine

EXAMPLES = """
go2-wbc sweep high_five --n 200
go2-wbc replay out/sweeps/high_five.sqlite 17 --html seed_17.html
"""


def register(subparsers: Subparsers) -> None:
    """Add the options of ``replay``."""
    parser = add_parser(
        subparsers,
        "replay",
        "Run a row of a motion's sweep again, in the world of its seed, and write a\n"
        "3D page of the run, the plan as a ghost. Exit code 0 if it gave the row that\n"
        "is kept, 1 if it gave another one (another version, or kind of processor).",
        examples=EXAMPLES,
    )
    parser.add_argument("file", metavar="FILE", type=Path, help="of `go2-wbc sweep`")
    parser.add_argument("row", metavar="ROW", type=int, help="the seed of the row")
    parser.add_argument("--html", metavar="FILE", type=Path, help="write a 3D replay page")
    parser.add_argument("--json", action="store_true", help="print JSON")


def run(args: argparse.Namespace) -> int:
    """Run it again, print what was measured, write the page."""
    from controller.sweeps.replay import replay
    from go2_wbc.files import checked_output
    from viz import HTML_SUFFIXES, export_html

    target = None if args.html is None else checked_output(args.html, HTML_SUFFIXES)
    with ProgressLine() as line:
        line.update(0.0, "running it again")
        shown = replay(args.file, args.row)
        if target is not None:
            line.update(0.9, "writing the page")
            export_html(shown.content, target, title=shown.title)
    if args.json:
        print_json({"row": dict(shown.row), "differences": list(shown.differences)})
    else:
        print(shown.title)
        print("-" * 80)
        for name, value in shown.row.items():
            mark = "   another than in the file" if name in shown.differences else ""
            print(f"  {name:<20.20}{value!s:.30}{mark}")
        print("-" * 80)
        if target is not None:
            print(f"3D replay, offline: {shown_path(target)}")
    return ExitCode.FAILED if shown.differences else ExitCode.OK
