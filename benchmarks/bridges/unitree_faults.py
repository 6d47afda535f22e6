"""Killed processes, garbage, floods on Unitree's protocol: whatever comes, the robot recovers."""

from __future__ import annotations

import json
import sys
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import replace
from typing import Final, final

import numpy as np

from benchmarks.bridges.faults import Fault, require, rows_of, run_all
from benchmarks.bridges.processes import PROGRAM, Process, wait_until
from benchmarks.bridges.unitree_processes import (
    Observer,
    client_of,
    driver,
    own_domain,
    simulator,
)
from benchmarks.rows import Family, Measurement
from benchmarks.trials import Trial
from controller.bridges.unitree.codec import codec_of
from controller.bridges.unitree.layout import LOW_CMD
from controller.bridges.unitree.low_client import low_cmd_message
from controller.bridges.unitree.sport_api import (
    SPORT_SERVICE,
    SWITCHER_SERVICE,
    Api,
    Code,
    SportMode,
    SwitcherApi,
)
from controller.cli.common import ExitCode
from go2_wbc.robot.state import JointCommand

LIMIT: Final = 60.0
"""Time [s] that only ends what hangs."""
UPRIGHT: Final = 0.35
"""Tilt [rad] below which a robot that stands or lies is upright."""
STANDS, LIES = 0.25, 0.13
"""Height [m] of the base above which the robot stands, below which it lies."""
FLOOD: Final = 5000.0
"""Samples per second."""
MOVE: Final = json.dumps({"x": 0.5, "y": 0.0, "z": 0.0})
BAD_MOVES: Final = ('{"x": NaN, "y": 0, "z": 0}', "rubbish", "[1]", '{"x": "fast"}')
PATIENT: Final = ("--stale-limit", "1.0")
"""A busy machine pauses processes for longer than the 30 ms of the real limit."""
ENDLESS_TROT: Final = (*PATIENT, "--steps", "stand", "trot", "--seconds", "60")
MOVER: Final = """
import sys, time
from benchmarks.bridges.unitree_faults import MOVE
from controller.bridges.unitree.bus import Bus
from controller.bridges.unitree.rpc import Client
from controller.bridges.unitree.sport_api import SPORT_SERVICE, Api
client = Client(Bus(int(sys.argv[1]), "lo"), SPORT_SERVICE)
assert client.wait_for_server(60.0)
while True:
    client.send(Api.MOVE, MOVE)
    time.sleep(0.05)
"""
"""A program that asks for ``Move`` until it is killed."""
_encode = codec_of(LOW_CMD).encode
DAMPED: Final = _encode(low_cmd_message(JointCommand.damping(3.0)))
"""A good ``rt/lowcmd``."""


@final
class Scene:
    """A simulator, an observer of it, and a client of its sport service.

    Attributes:
        process: the simulator.
        domain: its DDS domain.
        observer: what the robot says of itself.
        client: calls its sport service.
    """

    def __init__(self, process: Process, domain: int) -> None:
        """Join the domain of a simulator that serves."""
        from controller.bridges.unitree import idl

        self.process, self.domain = process, domain
        self.observer = Observer(domain)
        self.client = client_of(self.observer.bus, SPORT_SERVICE)
        self._commands = self.observer.bus.writer("rt/lowcmd", idl.low_cmd())

    def call(self, api: int, parameter: str = "{}") -> int:
        """The code that a call of the sport service is answered with."""
        return self.client.call(api, parameter, timeout=10.0).code

    def stand_up(self) -> None:
        """Make the robot stand."""
        code = self.call(Api.RECOVERY_STAND)
        require(code == Code.OK, f"RecoveryStand was answered {code}")
        self.observer.wait_for_rest()
        self.require_standing()

    def take_back(self) -> None:
        """Give the robot back to the sport service after low-level control."""
        switcher = client_of(self.observer.bus, SWITCHER_SERVICE)
        code = switcher.call(SwitcherApi.SELECT_MODE, '{"name": "normal"}').code
        require(code == Code.OK, f"SelectMode was answered {code}")
        self.require_said("low-level control has ended")

    def require_standing(self) -> None:
        """Make sure that the robot stands."""
        height, tilt = self.observer.height, self.observer.tilt
        stands = height > STANDS and tilt < UPRIGHT
        require(stands, f"the robot does not stand: {height:.2f} m, {np.degrees(tilt):.0f} deg")

    def require_lying(self) -> None:
        """Make sure that the robot comes to lie on its belly."""
        require(wait_until(lambda: self.observer.height < LIES, LIMIT), "the robot is not limp")
        tilt = self.observer.tilt
        require(tilt < UPRIGHT, f"the robot lies tilted by {np.degrees(tilt):.0f} deg")

    def require_said(self, *texts: str) -> None:
        """Make sure that the simulator reports these."""
        for text in texts:
            is_said = wait_until(lambda text=text: text in self.process.text, LIMIT)
            require(is_said, f"the simulator did not say {text!r}")

    def require_walking(self, peer: Process) -> None:
        """Make sure that ``peer`` gets the robot to walk."""
        walks = wait_until(lambda: self.observer.speed > 0.4 or peer.code is not None, LIMIT)
        require(walks and peer.code is None, f"the robot does not walk: {peer.text}")

    def flood(self, samples: list[bytes], seconds: float) -> None:
        """Write ``rt/lowcmd`` samples in turn, 5000 a second."""
        flood(lambda count: self._commands.write(samples[count % len(samples)]), seconds)


def flood(write: Callable[[int], None], seconds: float) -> None:
    """Call ``write`` with 0, 1, ..., 5000 times a second."""
    start, count = time.monotonic(), 0
    while (now := time.monotonic() - start) < seconds:
        while count < now * FLOOD:
            write(count)
            count += 1
        time.sleep(0.0005)


@contextmanager
def scene(*options: str) -> Iterator[Scene]:
    """A simulator with these options, and what is needed to watch it."""
    with own_domain() as domain, simulator(domain, *options) as process:
        yield Scene(process, domain)


def garbage() -> list[bytes]:
    """``rt/lowcmd`` that must move nothing: not finite, out of limits, damaged, cut off."""
    command = JointCommand.servo(np.zeros(12), np.zeros(12), 400.0, 1.0)
    damaged = low_cmd_message(JointCommand.torque(np.full(12, 20.0)))
    damaged["crc"] ^= 1
    return [
        _encode(low_cmd_message(replace(command, tau=np.full(12, np.nan)))),
        _encode(low_cmd_message(replace(command, q_des=np.full(12, 9.0)))),
        _encode(damaged),
    ]


def garbage_while_standing() -> float:
    """Garbage, then good commands that nobody has asked for, reach a standing robot."""
    with scene() as at:
        at.stand_up()
        at.flood(garbage(), 3.0)
        at.require_standing()
        at.flood([DAMPED], 2.0)
        at.require_standing()
        reasons = ("tau is not finite", "q out of limits", "wrong checksum", "lie down or Damp")
        at.require_said(*reasons)
        code = at.call(Api.STAND_DOWN)
        require(code == Code.OK, f"StandDown was answered {code}")
        return at.observer.largest_tilt


def garbage_beside_a_controller() -> float:
    """A controller trots the robot; somebody else sends garbage to the same motors."""
    with scene("--lockstep") as at:
        steps = ("--steps", "stand", "trot", "lie_down", "--seconds", "4")
        with driver(at.domain, *PATIENT, *steps) as peer:
            at.require_walking(peer)
            at.flood(garbage(), 2.0)
            text = peer.finish(LIMIT)
            require(peer.code == ExitCode.OK, f"the controller did not go on: {text}")
        at.require_said("wrong checksum")
        at.require_lying()
        return at.observer.largest_tilt


def flood_of_moves() -> float:
    """``Move`` comes 5000 times a second, most of it with broken parameters."""
    with scene() as at:
        at.stand_up()
        flood(
            lambda count: at.client.send(Api.MOVE, BAD_MOVES[count % 4] if count % 5 else MOVE), 3.0
        )
        at.require_standing()
        code = at.call(Api.STOP_MOVE)
        require(code == Code.OK, f"StopMove was answered {code}")
        at.observer.wait_for_rest()
        at.require_standing()
        return at.observer.largest_tilt


def move_client_killed() -> float:
    """The program that asks for ``Move`` is killed with kill -9."""
    with scene() as at:
        at.stand_up()
        with Process([sys.executable, "-c", MOVER, str(at.domain)]) as peer:
            at.require_walking(peer)
            require(at.observer.mode == SportMode.LOCOMOTION, "the mode is not locomotion")
            peer.kill()
        stops = wait_until(lambda: at.observer.speed < 0.1, 5.0)
        require(stops, "the robot walks on without its client")
        at.require_standing()
        return at.observer.largest_tilt


def controller_killed() -> float:
    """The controller behind ``UnitreePlant`` is killed with kill -9 in the middle of a trot."""
    with scene("--lockstep") as at:
        with driver(at.domain, *ENDLESS_TROT) as peer:
            at.require_walking(peer)
            peer.kill()
        at.require_lying()
        at.require_said("no good lowcmd")
        code = at.call(Api.STAND_UP)  # the controller had released the sport service
        require(code == Code.NOT_READY, f"StandUp was answered {code} before the robot was back")
        at.take_back()
        at.stand_up()
        return at.observer.largest_tilt


def controller_told_to_end() -> float:
    """The controller gets SIGTERM in the middle of a trot."""
    with scene("--lockstep") as at:
        with driver(at.domain, *ENDLESS_TROT) as peer:
            at.require_walking(peer)
            peer.stop()
        at.require_lying()
        return at.observer.largest_tilt


def simulator_killed() -> float:
    """The robot is gone in the middle of a trot; the controller ends, a new one is served."""
    with scene("--lockstep") as at, driver(at.domain, *ENDLESS_TROT) as peer:
        at.require_walking(peer)
        at.process.kill()
        text = peer.finish(LIMIT)
        require(peer.code == ExitCode.FAILED, f"the controller ended with {peer.code}: {text}")
        require("no rt/lowstate for" in text, f"the controller does not say why: {text}")
        tilt = at.observer.largest_tilt
        with simulator(at.domain) as process:
            second = Scene(process, at.domain)
            second.stand_up()
            return max(tilt, second.observer.largest_tilt)


def standing_robot_claimed() -> float:
    """A controller wants a robot that stands under its sport service."""
    with scene() as at:
        at.stand_up()
        with driver(at.domain) as peer:
            text = peer.finish(LIMIT)
            require(peer.code == ExitCode.RUNTIME, f"it ended with {peer.code}: {text}")
        require("must lie on its belly" in text, f"it does not say why: {text}")
        at.require_standing()
        return at.observer.largest_tilt


def second_simulator() -> float:
    """A second simulator is started on the domain of one that serves."""
    with scene() as at:
        at.stand_up()
        with Process([*PROGRAM, "unitree-sim", "--domain", str(at.domain)]) as second:
            text = second.finish(LIMIT)
            require(second.code == ExitCode.RUNTIME, f"it ended with {second.code}: {text}")
        require("already" in text and "--domain" in text, f"it does not say why: {text}")
        at.require_standing()
        return at.observer.largest_tilt


FAULTS: Final = (
    Fault("unitree.garbage", "garbage on lowcmd, standing", garbage_while_standing),
    Fault("unitree.garbage_beside", "garbage beside a controller", garbage_beside_a_controller),
    Fault("unitree.flood", "Move and rubbish at 5 kHz", flood_of_moves),
    Fault("unitree.client_killed", "kill -9 of the Move client", move_client_killed),
    Fault("unitree.controller_killed", "kill -9 of the controller", controller_killed),
    Fault("unitree.controller_ended", "SIGTERM at the controller", controller_told_to_end),
    Fault("unitree.robot_killed", "kill -9 of the simulator", simulator_killed),
    Fault("unitree.robot_claimed", "a standing robot is claimed", standing_robot_claimed),
    Fault("unitree.second", "a second simulator", second_simulator),
)


def measure(_trial: Trial) -> Measurement:
    """All faults, one after the other."""
    return run_all(FAULTS)


FAMILY: Final = Family(
    "unitree-faults", rows_of(FAULTS, "Unitree: faults, largest tilt of the robot"), measure
)
