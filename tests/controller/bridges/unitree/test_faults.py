"""Killed processes, garbage and floods: the robot damps or stands, says why, and recovers."""

from __future__ import annotations

import json
import time
from collections.abc import Iterator
from dataclasses import replace

import numpy as np
import pytest

from controller.bench.bridges.processes import Process, wait_until
from controller.bench.bridges.unitree_processes import Observer, driver, simulator
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
from tests.controller.bridges.unitree.support import free_domain, needs_dds

pytestmark = [needs_dds, pytest.mark.slow]
LIMIT = 60.0  # s; only ends a test that hangs
UPRIGHT = 0.35  # rad
STANDS, LIES = 0.25, 0.13  # m; height of the base above which, below which
FLOOD = 5000.0  # Hz
# s; a loaded test machine pauses processes for longer than the 30 ms of the real limit.
PATIENT = ("--stale-limit", "1.0")
encode = codec_of(LOW_CMD).encode


class Robot:
    """A simulator, an observer of it, and a client of its sport service."""

    def __init__(self, process: Process, domain: int) -> None:
        from controller.bridges.unitree import idl
        from controller.bridges.unitree.rpc import Client

        self.process, self.domain = process, domain
        self.observer = Observer(domain)
        self.client = Client(self.observer.bus, SPORT_SERVICE)
        self.commands = self.observer.bus.writer("rt/lowcmd", idl.low_cmd())
        assert self.client.wait_for_server(LIMIT)

    def stand(self) -> None:
        assert self.client.call(Api.RECOVERY_STAND, timeout=10.0).code == Code.OK
        assert self.observer.wait_for_rest()
        assert self.stands

    def take_back(self) -> None:
        from controller.bridges.unitree.rpc import Client

        switcher = Client(self.observer.bus, SWITCHER_SERVICE)
        assert switcher.wait_for_server(LIMIT)
        assert switcher.call(SwitcherApi.SELECT_MODE, '{"name": "normal"}').code == Code.OK
        assert wait_until(lambda: "low-level control has ended" in self.process.text, LIMIT)

    @property
    def stands(self) -> bool:
        return self.observer.height > STANDS and self.observer.tilt < UPRIGHT

    @property
    def lies(self) -> bool:
        return self.observer.height < LIES and self.observer.tilt < UPRIGHT


@pytest.fixture
def robot(request: pytest.FixtureRequest) -> Iterator[Robot]:
    domain = free_domain()
    with simulator(domain, *getattr(request, "param", ())) as process:
        yield Robot(process, domain)


def garbage(kind: str) -> bytes:
    command = JointCommand.servo(np.zeros(12), np.zeros(12), 400.0, 1.0)
    match kind:
        case "nan":
            return encode(low_cmd_message(replace(command, tau=np.full(12, np.nan))))
        case "limits":
            return encode(low_cmd_message(replace(command, q_des=np.full(12, 9.0))))
        case "checksum":
            message = low_cmd_message(JointCommand.torque(np.full(12, 20.0)))
            message["crc"] ^= 1
            return encode(message)
        case _:
            return bytes(range(100))


def flood(robot: Robot, samples: list[bytes], seconds: float) -> int:
    """Write the samples in turn at 5 kHz; returns how many were written."""
    start, count = time.monotonic(), 0
    while (now := time.monotonic() - start) < seconds:
        while count < now * FLOOD:
            robot.commands.write(samples[count % len(samples)])
            count += 1
        time.sleep(0.0005)
    return count


def test_garbage_and_floods_on_lowcmd_do_not_move_a_standing_robot(robot: Robot) -> None:
    robot.stand()
    flood(robot, [garbage(kind) for kind in ("nan", "limits", "checksum")], 3.0)
    assert robot.stands
    good = encode(low_cmd_message(JointCommand.damping(3.0)))
    flood(robot, [good], 2.0)  # good, but the sport service has the robot
    assert robot.stands
    said = robot.process.text
    for reason in ("tau is not finite", "q out of limits", "wrong checksum", "lie down or Damp"):
        assert reason in said
    assert robot.client.call(Api.STAND_DOWN, timeout=10.0).code == Code.OK


def test_a_flood_of_moves_leaves_the_service_and_the_robot_alive(robot: Robot) -> None:
    robot.stand()
    start, count = time.monotonic(), 0
    bad = [json.dumps({"x": float("nan"), "y": 0, "z": 0}), "rubbish", "[1]", '{"x": "fast"}']
    good = json.dumps({"x": 0.3, "y": 0.0, "z": 0.0})
    while (now := time.monotonic() - start) < 3.0:
        while count < now * FLOOD:
            robot.client.send(Api.MOVE, bad[count % 4] if count % 5 else good)
            count += 1
        time.sleep(0.0005)
    assert robot.stands
    assert robot.client.call(Api.STOP_MOVE, timeout=10.0).code == Code.OK
    assert robot.client.call(Api.SPEED_LEVEL, '{"data": 7}').code == Code.BAD_PARAMETER
    assert robot.client.call(1030).code == Code.NOT_SUPPORTED


def test_when_the_client_of_a_move_is_gone_the_robot_stops_and_stands(robot: Robot) -> None:
    robot.stand()
    parameter = json.dumps({"x": 0.5, "y": 0.0, "z": 0.0})
    for _ in range(40):  # then silence, as after kill -9
        robot.client.send(Api.MOVE, parameter)
        time.sleep(0.05)
    assert robot.observer.mode == SportMode.LOCOMOTION
    assert robot.observer.now()["velocity"][0, 0] > 0.3
    assert wait_until(lambda: abs(float(robot.observer.now()["velocity"][0, 0])) < 0.1, 5.0)
    assert robot.stands


@pytest.mark.parametrize("robot", [("--lockstep",)], indirect=True)
def test_a_controller_killed_in_the_middle_of_a_trot_leaves_the_robot_limp(robot: Robot) -> None:
    with driver(robot.domain, *PATIENT, "--steps", "stand", "trot", "--seconds", "60") as peer:
        assert wait_until(lambda: robot.observer.now()["velocity"][0, 0] > 0.4, LIMIT), peer.text
        peer.kill()
    assert wait_until(lambda: robot.lies, LIMIT)
    assert "no good lowcmd" in robot.process.text
    assert robot.client.call(Api.STAND_UP).code == Code.NOT_READY  # the driver has released it
    robot.take_back()
    robot.stand()


def test_a_robot_that_is_gone_ends_the_controller_with_a_reason() -> None:
    domain = free_domain()
    with simulator(domain, "--lockstep") as process:
        observer = Observer(domain)
        with driver(domain, *PATIENT, "--steps", "stand", "trot", "--seconds", "60") as peer:
            assert wait_until(lambda: observer.height > STANDS, LIMIT), peer.text
            process.kill()
            text = peer.finish(LIMIT)
            assert peer.code == ExitCode.FAILED, text
        assert "no rt/lowstate for" in text
        with simulator(domain):
            Robot(process, domain).stand()


def test_a_controller_asked_to_end_damps_the_robot(robot: Robot) -> None:
    with driver(robot.domain, *PATIENT, "--steps", "stand", "trot", "--seconds", "60") as peer:
        assert wait_until(lambda: robot.observer.height > STANDS, LIMIT), peer.text
        peer.stop()
    assert wait_until(lambda: robot.lies, LIMIT)


def test_a_robot_that_stands_is_not_taken_over(robot: Robot) -> None:
    robot.stand()
    with driver(robot.domain) as peer:
        text = peer.finish(LIMIT)
        assert peer.code == ExitCode.RUNTIME
    assert "must lie on its belly" in text
    assert robot.stands
