"""``go2-wbc identify-friction``: what friction the joints have, for the configuration file."""

from __future__ import annotations

import argparse
from contextlib import closing
from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING

from controller.cli.common import ExitCode, Subparsers, add_parser, print_json
from controller.cli.progress import ProgressLine
from go2_wbc.errors import CommandError

if TYPE_CHECKING:
    from go2_wbc.plant.base import Plant
    from go2_wbc.plant.friction_identification import FrictionEstimate

EXAMPLES = """
go2-wbc identify-friction     of the simulated robot
go2-wbc identify-friction --mjcf my_go2.xml --out friction.toml
go2-wbc identify-friction --interface eth0 --i-have-the-remote-in-hand
"""


def register(subparsers: Subparsers) -> None:
    """Add the options of ``identify-friction``."""
    parser = add_parser(
        subparsers,
        "identify-friction",
        "Move every joint of a robot that lies on its belly, legs over its back, for a\n"
        "minute, and print the friction of its joints for the configuration file.\n"
        "With --interface that of a Go2, or go2-wbc unitree-sim: read docs/real_robot.md\n"
        "first, and leave half a metre around it.",
        examples=EXAMPLES,
    )
    parser.add_argument("--mjcf", metavar="FILE", type=Path, help="an MJCF of your own")
    parser.add_argument("--interface", metavar="NAME", help="lo for a simulator")
    parser.add_argument("--domain", metavar="N", type=int, default=0, help="0 robot, 1 simulator")
    parser.add_argument(
        "--i-have-the-remote-in-hand", action="store_true", help="required with --interface"
    )
    parser.add_argument("--out", metavar="FILE", type=Path, help="write the TOML there, too")
    parser.add_argument("--json", action="store_true", help="print JSON")


def run(args: argparse.Namespace) -> int:
    """Identify, print, write."""
    from go2_wbc.files import checked_output
    from go2_wbc.plant.friction_identification import identify_friction

    if args.mjcf is not None and args.interface is not None:
        raise CommandError("give --mjcf or --interface, not both")
    target = None if args.out is None else checked_output(args.out, (".toml",))
    with ProgressLine() as line, closing(_plant(args)) as plant:
        estimate = identify_friction(
            plant, on_progress=lambda share: line.update(share, "identify friction")
        )
    if target is not None:
        target.write_text(estimate.toml(), encoding="utf-8")
    if args.json:
        print_json({name: values.tolist() for name, values in asdict(estimate).items()})
    else:
        _print(estimate)
    return ExitCode.OK


def _plant(args: argparse.Namespace) -> Plant:
    if args.interface is None:
        from go2_wbc.plant import MujocoPlant

        return MujocoPlant(args.mjcf)
    from controller.bridges.unitree.plant import UnitreePlant

    consent = args.i_have_the_remote_in_hand
    return UnitreePlant(args.interface, args.domain, i_have_the_remote_in_hand=consent)


def _print(estimate: FrictionEstimate) -> None:
    from go2_wbc.legs import JOINT_NAMES

    print("# joint      dry [N m]          viscous [N m s/rad], measured")
    rows = zip(
        JOINT_NAMES,
        estimate.dry,
        estimate.dry_error,
        estimate.viscous,
        estimate.viscous_error,
        strict=True,
    )
    for name, dry, dry_error, viscous, viscous_error in rows:
        joint = name.removesuffix("_joint")
        print(f"# {joint:<10}{dry:7.3f} +- {dry_error:.3f}   {viscous:7.3f} +- {viscous_error:.3f}")
    print("# of the viscous friction 75 % is fed forward, less what is uncertain")
    print(estimate.toml(), end="")
