"""``go2-wbc ros2``: the simulated robot as a ROS 2 node."""

from __future__ import annotations

import argparse
import logging
import signal
import sys
import threading
from pathlib import Path

from controller.cli.common import ExitCode, Subparsers, add_parser
from go2_wbc.world import SENSORS

EXAMPLES = """
go2-wbc ros2 --realtime                      at the pace of the wall clock
go2-wbc ros2                                 as fast as it can, with /clock
go2-wbc ros2 --realtime --namespace robot2   a second robot
go2-wbc ros2 --realtime --sensors imu        odometry as a robot has it
"""


def register(subparsers: Subparsers) -> None:
    """Add the options of ``ros2``."""
    parser = add_parser(
        subparsers,
        "ros2",
        "Serve a Go2 in MuJoCo under the whole-body controller as a ROS 2 node, until\n"
        "Ctrl-C. Needs the extra [ros2]; docs/ros2.md lists topics and services.",
        examples=EXAMPLES,
    )
    parser.add_argument(
        "--namespace", metavar="NAME", default="robot1", help="of topics, default %(default)s"
    )
    parser.add_argument("--realtime", action="store_true", help="at the pace of the wall clock")
    parser.add_argument("--viewer", action="store_true", help="open MuJoCo's window")
    parser.add_argument(
        "--sensors", choices=SENSORS, default="ideal", help="what its state comes from"
    )
    parser.add_argument("--config", metavar="FILE", type=Path, help="TOML with other numbers")


def run(args: argparse.Namespace) -> int:
    """Serve until a signal comes."""
    from controller.bridges.ros2.server import ServerSettings, serve

    logging.getLogger("controller").setLevel(logging.INFO)
    stop = threading.Event()
    for number in (signal.SIGINT, signal.SIGTERM):
        signal.signal(number, lambda *_: stop.set())
    settings = ServerSettings(args.namespace, args.realtime, args.viewer, args.config, args.sensors)
    serve(settings, stop, lambda text: print(text, file=sys.stderr, flush=True))
    return ExitCode.OK
