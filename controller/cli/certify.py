"""``go2-wbc certify``: how often a motion is done in randomised simulated runs."""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import TYPE_CHECKING

from controller.cli.common import ExitCode, Subparsers, add_parser, print_json, shown_path
from controller.cli.motion_args import add_motion, add_world, the_motion, world_of
from controller.cli.progress import ProgressLine
from controller.cli.sweep import add_runs, tell
from go2_wbc.errors import CommandError

if TYPE_CHECKING:
    from controller.sweeps.certify import Certificate
    from go2_wbc.world import World
    from motions import CompiledPlan, Timeline

RUNS = 200
EXAMPLES = """
go2-wbc certify high_five
go2-wbc certify my_motion.py:bow --at-least 0.95
go2-wbc certify bow --friction 0.4 --payload 3
go2-wbc certify jump_up --n 1000 --width 0.05
go2-wbc certify wave --set times=5 --json
go2-wbc certify high_five --html high_five.html
"""


def register(subparsers: Subparsers) -> None:
    """Add the options of ``certify``."""
    parser = add_parser(
        subparsers,
        "certify",
        "Play a motion in many random worlds in MuJoCo (friction, mass, heading and\n"
        "start differ) and say how often it is done, with the 95 % interval of the\n"
        "rate (Clopper-Pearson) and the worst runs. Exit code 1 if the rate is below\n"
        "--at-least.",
        examples=EXAMPLES,
    )
    add_motion(parser)
    parser.add_argument(
        "--n", metavar="N", type=int, default=RUNS, help="runs, default %(default)s"
    )
    add_world(parser)
    parser.add_argument(
        "--width",
        metavar="SHARE",
        type=float,
        help="end early once the interval is no wider than this, such as 0.05",
    )
    parser.add_argument(
        "--at-least",
        metavar="RATE",
        type=float,
        help="the lower end of the interval must reach this, such as 0.95",
    )
    add_runs(parser)
    parser.add_argument(
        "--html", metavar="FILE", type=Path, help="write the 3D page of the plan with all this"
    )
    parser.add_argument("--json", action="store_true", help="print JSON")


def run(args: argparse.Namespace) -> int:
    """Run it, print the certificate, and say by the exit code whether it is good enough."""
    from controller.sweeps.certify import certify
    from go2_wbc.files import checked_output
    from go2_wbc.world import DOUBTFUL
    from viz import HTML_SUFFIXES

    if args.at_least is not None and not 0.0 < args.at_least < 1.0:
        raise CommandError(f"--at-least must be between 0 and 1, got {args.at_least:g}")
    page = None if args.html is None else checked_output(args.html, HTML_SUFFIXES)
    motion, world = the_motion(args.motion, args.values), world_of(args, DOUBTFUL)
    with ProgressLine() as line:
        line.update(0.0, "starting")
        found = certify(
            motion,
            args.n,
            world=world,
            width=args.width,
            first_seed=args.first_seed,
            workers=args.workers,
            engine=args.engine,
            address=args.address,
            out=args.out,
            fresh=args.fresh,
            on_progress=lambda progress: tell(line, progress),
        )
        if page is not None:
            line.update(1.0, "writing the page")
            _write_page(motion, found, page, world)
    if args.json:
        print_json(found.as_dict())
    else:
        print(found.table())
        print(f"rows: {shown_path(found.path)}")
        if page is not None:
            print(f"3D page, offline: {shown_path(page)}")
    is_enough = args.at_least is None or found.meets(args.at_least)
    if not is_enough and not args.json:
        print(f"below {args.at_least:g}: the interval begins at {found.interval[0]:.3f}")
    return ExitCode.OK if is_enough else ExitCode.FAILED


def _write_page(
    motion: Timeline | CompiledPlan, certificate: Certificate, page: Path, world: World
) -> None:
    """The plan with the verdict on it in ``world``, its chance and the certificate."""
    from controller.report_view import planned
    from controller.sweeps.certificate_view import with_certificate
    from motions import FeasibilityChecker
    from viz import export_html

    checked = FeasibilityChecker(world=world).evaluate(motion)
    content = with_certificate(planned(checked), certificate, checked.plan)
    export_html(content, page, title=certificate.motion)
