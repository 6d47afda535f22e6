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

from benchmarks.bridges.faults import Fault, fault, metrics_of, require, run_all
from benchmarks.bridges.processes import PROGRAM, Process, wait_until
from benchmarks.bridges.unitree_processes import Observer, client_of, driver, own_domain, simulator
from benchmarks.scenario import Measurement, Scenario
from benchmarks.trials import Trial
from controller.bridges.unitree.codec import codec_of
from controller.bridges.unitree.layout import LOW_CMD
from controller.bridges.unitree.low_level import low_cmd_message
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
FAULTS: Final[list[Fault]] = []
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
        self.process, self.domain = process, domain
        self.observer = Observer(domain)
        self.client = client_of(self.observer.bus, SPORT_SERVICE)
        self._commands = self.observer.bus.writer("rt/lowcmd")

    def call(self, api: int, parameter: str = "{}") -> int:
        """The code that a call of the sport service is answered with."""
        return self.client.call(api, parameter, timeout=10.0).code

    def require_code(self, api: Api, code: Code = Code.OK) -> None:
        """Make sure that a call of the sport service is answered with ``code``."""
        answered = self.call(api)
        require(answered == code, f"{api.name} was answered {answered}")

    def stand_up(self) -> None:
        """Make the robot stand."""
        self.require_code(Api.RECOVERY_STAND)
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


def require_end(peer: Process, code: ExitCode, *texts: str) -> None:
    """Make sure that a process ends with an exit code and says why."""
    said = peer.finish(LIMIT)
    require(peer.code == code, f"it ended with {peer.code}: {said}")
    require(all(text in said for text in texts), f"it does not say {texts}: {said}")


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


@fault(FAULTS, "unitree.garbage", "garbage on lowcmd, standing")
def garbage_while_standing(at: Scene) -> None:
    """Garbage, then good commands that nobody has asked for, reach a standing robot."""
    at.stand_up()
    at.flood(garbage(), 3.0)
    at.require_standing()
    at.flood([DAMPED], 2.0)
    at.require_standing()
    at.require_said("tau is not finite", "q out of limits", "wrong checksum", "lie down or Damp")
    at.require_code(Api.STAND_DOWN)


@fault(FAULTS, "unitree.garbage_beside", "garbage beside a controller", "--lockstep")
def garbage_beside_a_controller(at: Scene) -> None:
    """A controller trots the robot; somebody else sends garbage to the same motors."""
    steps = ("--steps", "stand", "trot", "lie_down", "--seconds", "4")
    with driver(at.domain, *PATIENT, *steps) as peer:
        at.require_walking(peer)
        at.flood(garbage(), 2.0)
        require_end(peer, ExitCode.OK)
    at.require_said("wrong checksum")
    at.require_lying()


@fault(FAULTS, "unitree.flood", "Move and rubbish at 5 kHz")
def flood_of_moves(at: Scene) -> None:
    """``Move`` comes 5000 times a second, most of it with broken parameters."""
    at.stand_up()
    flood(lambda count: at.client.send(Api.MOVE, BAD_MOVES[count % 4] if count % 5 else MOVE), 3.0)
    at.require_standing()
    at.require_code(Api.STOP_MOVE)
    at.observer.wait_for_rest()
    at.require_standing()


@fault(FAULTS, "unitree.client_killed", "kill -9 of the Move client")
def move_client_killed(at: Scene) -> None:
    """The program that asks for ``Move`` is killed with kill -9."""
    at.stand_up()
    with Process([sys.executable, "-c", MOVER, str(at.domain)]) as peer:
        at.require_walking(peer)
        require(at.observer.mode == SportMode.LOCOMOTION, "the mode is not locomotion")
        peer.kill()
    stops = wait_until(lambda: at.observer.speed < 0.1, 5.0)
    require(stops, "the robot walks on without its client")
    at.require_standing()


@fault(FAULTS, "unitree.controller_killed", "kill -9 of the controller", "--lockstep")
def controller_killed(at: Scene) -> None:
    """The controller behind ``UnitreePlant`` is killed with kill -9 in the middle of a trot."""
    with driver(at.domain, *ENDLESS_TROT) as peer:
        at.require_walking(peer)
        peer.kill()
    at.require_lying()
    at.require_said("no good lowcmd")
    at.require_code(Api.STAND_UP, Code.NOT_READY)  # the controller had released the sport service
    at.take_back()
    at.stand_up()


@fault(FAULTS, "unitree.controller_ended", "SIGTERM at the controller", "--lockstep")
def controller_told_to_end(at: Scene) -> None:
    """The controller gets SIGTERM in the middle of a trot."""
    with driver(at.domain, *ENDLESS_TROT) as peer:
        at.require_walking(peer)
        peer.stop()
    at.require_lying()


@fault(FAULTS, "unitree.robot_killed", "kill -9 of the simulator", "--lockstep")
def simulator_killed(at: Scene) -> None:
    """The robot is gone in the middle of a trot; the controller ends, a new one is served."""
    with driver(at.domain, *ENDLESS_TROT) as peer:
        at.require_walking(peer)
        at.process.kill()
        require_end(peer, ExitCode.FAILED, "no rt/lowstate for")
    with simulator(at.domain) as process:
        second = Scene(process, at.domain)
        second.stand_up()
        tilts = (at.observer.largest_tilt, second.observer.largest_tilt)
        at.observer.largest_tilt = max(tilts)


@fault(FAULTS, "unitree.robot_claimed", "a standing robot is claimed")
def standing_robot_claimed(at: Scene) -> None:
    """A controller wants a robot that stands under its sport service."""
    at.stand_up()
    with driver(at.domain) as peer:
        require_end(peer, ExitCode.RUNTIME, "must lie on its belly")
    at.require_standing()


@fault(FAULTS, "unitree.second", "a second simulator")
def second_simulator(at: Scene) -> None:
    """A second simulator is started on the domain of one that serves."""
    at.stand_up()
    with Process([*PROGRAM, "unitree-sim", "--domain", str(at.domain)]) as second:
        require_end(second, ExitCode.RUNTIME, "already", "--domain")
    at.require_standing()


def tilt_during(fault: Fault) -> float:
    """Largest tilt [deg] of a robot of its own while the fault is played."""
    with scene(*fault.options) as at:
        fault.play(at)
        return at.observer.largest_tilt


def measure(_trial: Trial) -> Measurement:
    """All faults, one after the other."""
    return run_all(FAULTS, tilt_during)


METRICS: Final = metrics_of(FAULTS, "Unitree: faults, largest tilt of the robot")
SCENARIO: Final = Scenario("unitree-faults", METRICS, measure, group="unitree")
