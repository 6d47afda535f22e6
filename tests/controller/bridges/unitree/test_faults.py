"""Killed processes, garbage, floods on Unitree's protocol: whatever comes, the robot recovers."""

import sys
from collections.abc import Iterator
from typing import Final

import pytest

from controller.bridges.unitree.sport_api import Api, Code, SportMode
from controller.cli.common import ExitCode
from tests.controller.bridges.processes import PROGRAM, Process, wait_until
from tests.controller.bridges.unitree.scenes import DAMPED, WatchedScene, flood, garbage, watched
from tests.controller.bridges.unitree.support import needs_dds
from tests.controller.bridges.unitree_processes import LIMIT, MOVE, driver, simulator

BAD_MOVES: Final = ('{"x": NaN, "y": 0, "z": 0}', "rubbish", "[1]", '{"x": "fast"}')
PATIENT: Final = ("--stale-limit", "1.0")
"""A busy machine pauses processes for longer than the 30 ms of the real limit."""
ENDLESS_TROT: Final = (*PATIENT, "--steps", "stand", "trot", "--seconds", "60")
MOVER: Final = """
import sys, time
from tests.controller.bridges.unitree_processes import MOVE
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
TILT_LIMIT: Final = 30.0
"""Tilt [deg] that a fault may cause at most: a robot that goes limp sinks, it does not tip over."""
pytestmark = [needs_dds, pytest.mark.slow]
lockstep = pytest.mark.parametrize("at", [("--lockstep",)], indirect=True, ids=["lockstep"])


@pytest.fixture
def at(request: pytest.FixtureRequest) -> Iterator[WatchedScene]:
    """A robot of the test's own, that must not have tipped over."""
    with watched(*getattr(request, "param", ())) as at:
        yield at
        assert at.largest_tilt < TILT_LIMIT


def require_end(peer: Process, code: ExitCode, *texts: str) -> None:
    """Make sure that a process ends with an exit code and says why."""
    said = peer.finish(LIMIT)
    assert peer.code == code, f"it ended with {peer.code}: {said}"
    assert all(text in said for text in texts), f"it does not say {texts}: {said}"


def test_garbage_moves_no_standing_robot(at: WatchedScene) -> None:
    """Garbage, then good commands that nobody has asked for, reach a standing robot."""
    at.stand_up()
    at.flood(garbage(), 3.0)
    at.require_standing()
    at.flood([DAMPED], 2.0)
    at.require_standing()
    at.require_said("tau is not finite", "q out of limits", "wrong checksum", "lie down or Damp")
    at.require_code(Api.STAND_DOWN)


@lockstep
def test_garbage_beside_a_controller_does_not_stop_its_trot(at: WatchedScene) -> None:
    """A controller trots the robot; somebody else sends garbage to the same motors."""
    steps = ("--steps", "stand", "trot", "lie_down", "--seconds", "4")
    with driver(at.domain, *PATIENT, *steps) as peer:
        at.require_walking(peer)
        at.flood(garbage(), 2.0)
        require_end(peer, ExitCode.OK)
    at.require_said("wrong checksum")
    at.require_lying()


def test_a_robot_stands_in_a_flood_of_moves(at: WatchedScene) -> None:
    """``Move`` comes 5000 times a second, most of it with broken parameters."""
    at.stand_up()
    flood(lambda count: at.client.send(Api.MOVE, BAD_MOVES[count % 4] if count % 5 else MOVE), 3.0)
    at.require_standing()
    at.require_code(Api.STOP_MOVE)
    at.wait_for_rest()
    at.require_standing()


def test_a_robot_stops_whose_move_client_is_killed(at: WatchedScene) -> None:
    """The program that asks for ``Move`` is killed with kill -9."""
    at.stand_up()
    with Process([sys.executable, "-c", MOVER, str(at.domain)]) as peer:
        at.require_walking(peer)
        assert at.mode == SportMode.LOCOMOTION, "the mode is not locomotion"
        peer.kill()
    stops = wait_until(lambda: at.speed < 0.1, 5.0)
    assert stops, "the robot walks on without its client"
    at.require_standing()


@lockstep
def test_a_robot_lies_down_and_gets_up_again_whose_controller_is_killed(at: WatchedScene) -> None:
    """The controller behind ``UnitreePlant`` is killed with kill -9 in the middle of a trot."""
    with driver(at.domain, *ENDLESS_TROT) as peer:
        at.require_walking(peer)
        peer.kill()
    at.require_lying()
    at.require_said("no good lowcmd")
    at.require_code(Api.STAND_UP, Code.NOT_READY)  # the controller had released the sport service
    at.take_back()
    at.stand_up()


@lockstep
def test_a_controller_that_is_told_to_end_lays_the_robot_down(at: WatchedScene) -> None:
    """The controller gets SIGTERM in the middle of a trot."""
    with driver(at.domain, *ENDLESS_TROT) as peer:
        at.require_walking(peer)
        peer.stop()
    at.require_lying()


@lockstep
def test_a_controller_ends_whose_simulator_is_killed(at: WatchedScene) -> None:
    """The robot is gone in the middle of a trot; the controller ends, a new one is served."""
    with driver(at.domain, *ENDLESS_TROT) as peer:
        at.require_walking(peer)
        at.process.kill()
        require_end(peer, ExitCode.FAILED, "no rt/lowstate for")
    with simulator(at.domain) as process:
        second = WatchedScene(process, at.domain)
        second.stand_up()
        at.largest_tilt = max(at.largest_tilt, second.largest_tilt)


def test_no_controller_takes_over_a_robot_that_stands(at: WatchedScene) -> None:
    """A controller wants a robot that stands under its sport service."""
    at.stand_up()
    with driver(at.domain) as peer:
        require_end(peer, ExitCode.RUNTIME, "must lie on its belly")
    at.require_standing()


def test_a_second_simulator_is_refused(at: WatchedScene) -> None:
    """A second simulator is started on the domain of one that serves."""
    at.stand_up()
    with Process([*PROGRAM, "unitree-sim", "--domain", str(at.domain)]) as second:
        require_end(second, ExitCode.RUNTIME, "already", "--domain")
    at.require_standing()
