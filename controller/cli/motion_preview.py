"""``go2-wbc preview``: watch a motion while it is written, or write its page, film and plot."""

from __future__ import annotations

import argparse
from pathlib import Path

from controller.cli.common import Subparsers, add_parser
from controller.cli.motion_args import add_motion

EXAMPLES = """
go2-wbc preview bow                       in the browser, until Ctrl-C
go2-wbc preview my_motion.py              again after every save
go2-wbc preview wave --set side=left --port 8080 --no-open
go2-wbc preview high_five --html high_five.html
go2-wbc preview dance --video dance.webp --plot margins.svg
go2-wbc preview bow --certificate out/sweeps/bow.sqlite
"""
DEFAULT_PORT = 7000


def register(subparsers: Subparsers) -> None:
    """Add the options of ``preview``."""
    parser = add_parser(
        subparsers,
        "preview",
        "Check a motion and show it in 3D: support polygon, CoM, foot paths, contact\n"
        "forces, what is left to every limit, and in red what is broken, where and when.\n"
        "Nothing is simulated. The page is served to this machine only and follows every\n"
        "save of the motion's file; Ctrl-C ends it. With --html, --video or --plot files\n"
        "are written instead. Exit code 0 if the robot can do the motion (as last saved),\n"
        "1 if it cannot.",
        examples=EXAMPLES,
    )
    add_motion(parser)
    parser.add_argument(
        "--certificate",
        metavar="FILE",
        type=Path,
        help="of `go2-wbc certify`: show it, and check in its world",
    )
    files = parser.add_argument_group("files, instead of the live page")
    files.add_argument(
        "--html", metavar="FILE", type=Path, help="one offline page; ends in .html or .htm"
    )
    files.add_argument("--video", metavar="FILE", type=Path, help="ends in .webp or .gif")
    files.add_argument(
        "--plot", metavar="FILE", type=Path, help="the margins; ends in .svg, .png or .pdf"
    )
    live = parser.add_argument_group("live page")
    live.add_argument(
        "--port",
        metavar="N",
        type=_port,
        default=DEFAULT_PORT,
        help="default: %(default)s; 0 takes any that is free",
    )
    live.add_argument("--no-open", action="store_true", help="open no browser")
    parser.add_argument(
        "--json", action="store_true", help="print JSON; of the live page, a line for every save"
    )


def run(args: argparse.Namespace) -> int:
    """Write the files, or serve the page."""
    from controller.cli.motion_preview_run import serve, write_files

    if args.html or args.video or args.plot:
        return write_files(args)
    return serve(args)


def _port(text: str) -> int:
    if not text.isdecimal() or int(text) > 65535:
        raise argparse.ArgumentTypeError(f"must be a port from 0 to 65535, got {text!r}")
    return int(text)
