"""``go2-wbc unitree-drive``: our controller on a robot that speaks Unitree's low-level protocol."""

from __future__ import annotations

import argparse
from contextlib import closing
from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING

from controller.cli.common import ExitCode, Subparsers, add_parser, print_json_line

if TYPE_CHECKING:
    from controller.bridges.unitree.drive import Step

EXAMPLES = """
go2-wbc unitree-drive --interface lo --domain 1 --i-have-the-remote-in-hand
go2-wbc unitree-drive --interface eth0 --json --i-have-the-remote-in-hand
"""


def register(subparsers: Subparsers) -> None:
    """Add the options of ``unitree-drive``."""
    parser = add_parser(
        subparsers,
        "unitree-drive",
        "Drive a Go2, or go2-wbc unitree-sim, through lowcmd and lowstate with this\n"
        "project's controller. The robot must lie. Read docs/real_robot.md first: no real\n"
        "robot has been driven by this program yet.",
        examples=EXAMPLES,
    )
    parser.add_argument("--interface", metavar="NAME", required=True, help="lo for a simulator")
    parser.add_argument("--domain", metavar="N", type=int, default=0, help="0 robot, 1 simulator")
    parser.add_argument(
        "--i-have-the-remote-in-hand", action="store_true", help="required: you can stop it"
    )
    parser.add_argument(
        "--steps",
        metavar="STEP",
        nargs="+",
        default=["stand", "trot", "high_five", "lie_down"],
        help="of stand, sit, trot, high_five, lie_down; default %(default)s",
    )
    parser.add_argument("--speed", metavar="M/S", type=float, default=0.5, help="of the trot")
    parser.add_argument("--seconds", metavar="S", type=float, default=4.0, help="of the trot")
    parser.add_argument(
        "--stale-limit",
        metavar="S",
        type=float,
        default=0.03,
        help="damp after this time without lowstate, default %(default)s",
    )
    parser.add_argument("--config", metavar="FILE", type=Path, help="TOML with other numbers")
    parser.add_argument("--json", action="store_true", help="print a JSON line per step")


def run(args: argparse.Namespace) -> int:
    """Drive step by step; the robot ends limp."""
    from controller.arguments import config
    from controller.bridges.unitree.drive import Trot, check_steps, drive
    from controller.bridges.unitree.guards import GuardConfig
    from controller.bridges.unitree.plant import UnitreePlant

    check_steps(args.steps)
    trot, numbers = Trot(args.speed, args.seconds), config(args.config)
    plant = UnitreePlant(
        args.interface,
        args.domain,
        i_have_the_remote_in_hand=args.i_have_the_remote_in_hand,
        guards=GuardConfig(
            stale_limit=args.stale_limit, hang_limit=max(args.stale_limit, GuardConfig().hang_limit)
        ),
        estimator=numbers.estimator,
    )
    done = True
    with closing(plant):
        for step in drive(plant, args.steps, trot, numbers):
            _tell(step, as_json=args.json)
            done = done and step.ok
    return ExitCode.OK if done else ExitCode.FAILED


def _tell(step: Step, *, as_json: bool) -> None:
    if as_json:
        print_json_line(asdict(step))
        return
    error = "" if step.speed_error is None else f", speed off by {step.speed_error:.3f} m/s"
    print(f"{step.name:<12}{'done' if step.ok else 'NOT done: ' + step.reason}{error}", flush=True)
