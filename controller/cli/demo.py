"""``go2-wbc demo``: its options. What it does is in ``demo_run``, which imports the robot."""

from __future__ import annotations

import argparse
import sys
from itertools import count
from pathlib import Path

from controller.cli.common import ExitCode, Subparsers, add_parser, print_json

EXAMPLES = """
go2-wbc demo                         headless; table, replay page, animation
go2-wbc demo --no-media --json       figures only, for a program to read
go2-wbc demo --viewer --realtime     watch it live in MuJoCo's window
go2-wbc demo --friction 0.4 --mass-scale 1.2 --seed 3
go2-wbc demo --backend placo --solver proxqp
go2-wbc demo --ros2                  on the robot of `go2-wbc ros2 --realtime`
"""
DEFAULT_FOLDER = Path("out/demo")
BACKENDS = ("condensed", "full", "placo")
SOLVERS = ("active_set", "daqp", "proxqp", "quadprog")


def register(subparsers: Subparsers) -> None:
    """Add the options of ``demo``."""
    parser = add_parser(
        subparsers,
        "demo",
        "Stand, sit, walk, turn, high five and sit in MuJoCo; then print what was\n"
        "measured and write an offline 3D replay and pictures. Exit code 0 if every\n"
        "step was done, 1 if one was not, 3 if something broke.",
        examples=EXAMPLES,
    )
    output = parser.add_argument_group("output")
    output.add_argument(
        "--out", metavar="DIR", type=Path, default=DEFAULT_FOLDER, help="default: %(default)s"
    )
    output.add_argument("--no-media", action="store_true", help="no page and no pictures")
    output.add_argument("--json", action="store_true", help="print JSON instead of the table")
    output.add_argument("--viewer", action="store_true", help="also open MuJoCo's window")
    output.add_argument("--realtime", action="store_true", help="at the pace of the wall clock")
    ros2 = parser.add_argument_group("over ROS 2")
    ros2.add_argument(
        "--ros2", action="store_true", help="on a robot that `go2-wbc ros2` serves elsewhere"
    )
    ros2.add_argument(
        "--namespace", metavar="NAME", default="robot1", help="its name, default %(default)s"
    )
    robot = parser.add_argument_group("robot and world")
    robot.add_argument(
        "--seed",
        metavar="N",
        type=_whole,
        help="start from joint angles that this seed draws (default: exact ones)",
    )
    robot.add_argument("--friction", metavar="MU", type=_positive, help="of the feet, default 0.8")
    robot.add_argument(
        "--mass-scale", metavar="X", type=_positive, default=1.0, help="factor on all masses"
    )
    robot.add_argument("--mjcf", metavar="FILE", type=Path, help="your own Go2 model or scene")
    control = parser.add_argument_group("controller")
    control.add_argument("--config", metavar="FILE", type=Path, help="TOML with other numbers")
    control.add_argument("--backend", choices=BACKENDS, help="whole-body back end")
    control.add_argument("--solver", choices=SOLVERS, help="QP solver")


def run(args: argparse.Namespace) -> int:
    """Run the demo, print the report, write the files."""
    if args.ros2:
        return _run_over_ros(args)
    from controller.cli.demo_run import run_demo_command

    return run_demo_command(args)


def _run_over_ros(args: argparse.Namespace) -> int:
    """Run the demo on a robot that another process serves, print the steps."""
    from controller.bridges.ros2.demo import run_ros_demo
    from controller.cli.demo_table import render_steps
    from controller.cli.progress import ProgressLine
    from controller.demo.report import DemoReport
    from controller.demo.steps import DEMO_STEPS

    number = count(1)
    with ProgressLine() as line:
        results = run_ros_demo(
            args.namespace,
            lambda step: line.done(
                f"{next(number)}/{len(DEMO_STEPS)} {step.label}: {step.verdict}"
            ),
        )
    ok = all(step.ok for step in results)
    if args.json:
        print_json({"ok": ok, "steps": DemoReport.steps_as_dicts(results)})
    else:
        print(render_steps(results, sys.stdout.encoding))
        print(f"{sum(step.ok for step in results)} of {len(results)} steps borne out by odometry.")
    return ExitCode.OK if ok else ExitCode.FAILED


def _whole(text: str) -> int:
    if not text.isdecimal():
        raise argparse.ArgumentTypeError(f"must be a whole number of 0 or more, got {text!r}")
    return int(text)


def _positive(text: str) -> float:
    try:
        value = float(text)
    except ValueError:
        value = 0.0
    if not 0.0 < value < float("inf"):
        raise argparse.ArgumentTypeError(f"must be a positive number, got {text!r}")
    return value
