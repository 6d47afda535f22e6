"""Killed processes, garbage, floods on Unitree's protocol: whatever comes, the robot recovers."""

from __future__ import annotations

import sys
from dataclasses import replace
from typing import Final

import numpy as np

from benchmarks.bridges.faults import Fault, fault, metrics_of, require, run_all
from benchmarks.bridges.processes import PROGRAM, Process, wait_until
from benchmarks.bridges.unitree_processes import LIMIT, MOVE, Scene, driver, flood, scene, simulator
from benchmarks.scenario import Measurement, Scenario
from controller.bridges.unitree.codec import encode_message
from controller.bridges.unitree.low_level import low_cmd_message
from controller.bridges.unitree.sport_api import Api, Code, SportMode
from controller.cli.common import ExitCode
from controller.sweeps.trials import Trial
from go2_wbc.robot.state import JointCommand

BAD_MOVES: Final = ('{"x": NaN, "y": 0, "z": 0}', "rubbish", "[1]", '{"x": "fast"}')
PATIENT: Final = ("--stale-limit", "1.0")
"""A busy machine pauses processes for longer than the 30 ms of the real limit."""
ENDLESS_TROT: Final = (*PATIENT, "--steps", "stand", "trot", "--seconds", "60")
MOVER: Final = """
import sys, time
from benchmarks.bridges.unitree_processes import MOVE
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
DAMPED: Final = encode_message(low_cmd_message(JointCommand.damping(3.0)))
"""A good ``rt/lowcmd``."""


def require_end(peer: Process, code: ExitCode, *texts: str) -> None:
    """Make sure that a process ends with an exit code and says why."""
    said = peer.finish(LIMIT)
    require(peer.code == code, f"it ended with {peer.code}: {said}")
    require(all(text in said for text in texts), f"it does not say {texts}: {said}")


def garbage() -> list[bytes]:
    """``rt/lowcmd`` that must move nothing: not finite, out of limits, damaged."""
    command = JointCommand.servo(np.zeros(12), np.zeros(12), 400.0, 1.0)
    damaged = low_cmd_message(JointCommand.torque(np.full(12, 20.0)))
    damaged["crc"] ^= 1
    return [
        encode_message(low_cmd_message(replace(command, tau=np.full(12, np.nan)))),
        encode_message(low_cmd_message(replace(command, q_des=np.full(12, 9.0)))),
        encode_message(damaged),
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
    at.wait_for_rest()
    at.require_standing()


@fault(FAULTS, "unitree.client_killed", "kill -9 of the Move client")
def move_client_killed(at: Scene) -> None:
    """The program that asks for ``Move`` is killed with kill -9."""
    at.stand_up()
    with Process([sys.executable, "-c", MOVER, str(at.domain)]) as peer:
        at.require_walking(peer)
        require(at.mode == SportMode.LOCOMOTION, "the mode is not locomotion")
        peer.kill()
    stops = wait_until(lambda: at.speed < 0.1, 5.0)
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
        at.largest_tilt = max(at.largest_tilt, second.largest_tilt)


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
        return at.largest_tilt


def measure(_trial: Trial) -> Measurement:
    """All faults, one after the other."""
    return run_all(FAULTS, tilt_during)


METRICS: Final = metrics_of(FAULTS, "Unitree: faults, largest tilt of the robot")
SCENARIO: Final = Scenario("unitree-faults", METRICS, measure, group="unitree")
