"""``go2-wbc unitree-sim``: a simulated Go2 for Unitree's own SDK."""

from __future__ import annotations

import argparse
import logging
import signal
import threading
from contextlib import closing
from dataclasses import fields
from pathlib import Path

from controller.cli.common import ExitCode, Subparsers, add_parser
from go2_wbc.errors import PlantError
from go2_wbc.world import SENSORS

EXAMPLES = """
go2-wbc unitree-sim                      domain 1 on the loopback interface
go2-wbc unitree-sim --domain 5 --sensors noisy
go2-wbc unitree-sim --mjcf my_scene.xml --interface eth0
"""


def register(subparsers: Subparsers) -> None:
    """Add the options of ``unitree-sim``."""
    parser = add_parser(
        subparsers,
        "unitree-sim",
        "Simulate a Go2 that speaks Unitree's protocol (DDS): the sport service for the\n"
        "stock SportClient, lowstate and lowcmd at 500 Hz. Ctrl-C ends it, limp.",
        examples=EXAMPLES,
    )
    parser.add_argument("--domain", metavar="N", type=int, default=1, help="default %(default)s")
    parser.add_argument(
        "--interface", metavar="NAME", default="lo", help="network, default %(default)s"
    )
    parser.add_argument("--mjcf", metavar="FILE", type=Path, help="your own Go2 model or scene")
    parser.add_argument("--friction", metavar="MU", type=float, help="of the feet, default 0.8")
    parser.add_argument("--payload", metavar="KG", type=float, default=0.0, help="extra mass")
    parser.add_argument("--sensors", choices=SENSORS, default="ideal")
    parser.add_argument("--seed", metavar="N", type=int, default=0, help="of the noise")
    parser.add_argument(
        "--lockstep",
        action="store_true",
        help="under low-level control time waits for the next lowcmd (1 s at most)",
    )
    parser.add_argument("--config", metavar="FILE", type=Path, help="TOML with other numbers")


def run(args: argparse.Namespace) -> int:
    """Serve until a signal comes."""
    from controller.bridges.unitree import require_dds

    require_dds()
    from controller.bridges.unitree.simulator import SimulatorSettings, UnitreeSimulator

    logging.getLogger("controller.bridges").setLevel(logging.INFO)
    stop = threading.Event()
    for number in (signal.SIGINT, signal.SIGTERM):
        signal.signal(number, lambda *_: stop.set())
    settings = SimulatorSettings(
        **{f.name: getattr(args, f.name) for f in fields(SimulatorSettings)}
    )
    with closing(UnitreeSimulator(settings)) as simulator:
        print(f"serving on DDS domain {args.domain}, interface {args.interface}", flush=True)
        while not stop.wait(0.5):
            if not simulator.is_alive:
                raise PlantError("the simulation has ended; what was said before tells why")
        gate = simulator.gate
    refused = ", ".join(f"{reason} {count}" for reason, count in gate.refused.items())
    print(f"low-level commands: {gate.accepted} good, refused: {refused or 'none'}", flush=True)
    return ExitCode.OK
