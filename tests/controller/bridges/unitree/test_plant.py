"""Whatever goes wrong with a robot, ``UnitreePlant`` damps it and goes on damping it.

The bus is played by this file: states come from here, and every command is kept.
"""

from __future__ import annotations

import threading
import time
from collections.abc import Callable, Iterator

import numpy as np
import pytest

from controller import GO2Controller
from controller.bridges.unitree import messages
from controller.bridges.unitree.low_level import GuardConfig, low_cmd_message, low_state_message
from controller.bridges.unitree.messages import decode_message, encode_message, seal
from controller.bridges.unitree.plant import UnitreePlant
from go2_wbc.errors import (
    CommandError,
    ConfigError,
    DynamicMotionRefused,
    PlantError,
    PlantTimeout,
    StanceMismatch,
)
from go2_wbc.plant import MujocoPlant
from go2_wbc.plant.base import Plant
from go2_wbc.robot.model import RobotModel
from go2_wbc.robot.state import JointCommand
from motions import Timeline, compile_timeline
from tests.controller.bridges.processes import wait_until
from tests.controller.bridges.unitree.support import needs_dds

pytestmark = needs_dds
PUSH = JointCommand.torque(np.full(12, 0.5))
DAMPED = JointCommand.damping(3.0)
PERIOD = 0.002
MANY = 10  # commands: one alone may get lost
# s; a busy machine pauses this process for longer than the real limits of 30 and 100 ms.
PATIENT = GuardConfig(stale_limit=5.0, hang_limit=20.0)
QUICK_TO_HEAR = GuardConfig(stale_limit=0.3, hang_limit=20.0)
QUICK_TO_HANG = GuardConfig(stale_limit=5.0, hang_limit=0.5)
LIMIT = 60.0  # s; only ends a test that hangs
Change = Callable[[np.ndarray], None]


class Robot:
    """Both ends of the bus: publishes a lying robot's state, doctored by ``change``."""

    def __init__(self) -> None:
        plant = MujocoPlant()
        self._lying = plant.read(), plant.imu()
        plant.close()
        self.change: Change = lambda message: None
        self.is_alive = True
        self.tick, self._next = 1000, time.monotonic()
        self.commands: list[np.ndarray] = []
        self.writers = self.readers = 1

    def reader(self, topic: str, *, depth: int) -> Robot:
        return self

    def writer(self, topic: str) -> Robot:
        return self

    def wait(self, seconds: float) -> bool:
        time.sleep(min(seconds, PERIOD) if self.is_alive else seconds)
        return self.is_alive

    def take(self) -> list[bytes]:
        if not self.is_alive or time.monotonic() < self._next:
            return []
        self._next = time.monotonic() + PERIOD
        self.tick += 2
        message = low_state_message(*self._lying)
        message["tick"] = self.tick
        self.change(message)
        seal(message)
        return [encode_message(message)]

    def write(self, data: bytes) -> None:
        self.commands.append(decode_message(messages.LOW_CMD, data))

    def is_damped_since(self, start: int) -> bool:
        """Whether many commands come from then on, and all of them brake."""
        assert wait_until(lambda: len(self.commands) > start + MANY, LIMIT)
        return all(map(is_damping, self.commands[start:]))


def is_damping(command: np.ndarray) -> bool:
    return bool((command["motor_cmd"] == low_cmd_message(DAMPED)["motor_cmd"]).all())


@pytest.fixture
def robot(monkeypatch: pytest.MonkeyPatch) -> Robot:
    robot = Robot()
    monkeypatch.setattr("controller.bridges.unitree.bus.Bus", lambda domain, interface: robot)
    monkeypatch.setattr(UnitreePlant, "_release_sport", lambda *args: None)
    return robot


def driven(guards: GuardConfig) -> Plant:
    return UnitreePlant("lo", 1, i_have_the_remote_in_hand=True, guards=guards)


@pytest.fixture
def guards() -> GuardConfig:
    return PATIENT


@pytest.fixture
def plant(robot: Robot, guards: GuardConfig) -> Iterator[Plant]:
    plant = driven(guards)
    write_often(plant)
    assert robot.commands[-1]["motor_cmd"]["tau"].any()
    yield plant
    plant.close()


def write_often(plant: Plant) -> None:
    for _ in range(5):
        plant.write(PUSH)


def tilted(message: np.ndarray) -> None:
    message["imu_state"]["quaternion"] = (np.cos(0.7), np.sin(0.7), 0.0, 0.0)


def overstretched(message: np.ndarray) -> None:
    message["motor_state"]["q"][0, 0] = 2.0


def broken(message: np.ndarray) -> None:
    message["motor_state"]["q"][0, 3] = np.nan


def standing(message: np.ndarray) -> None:
    message["motor_state"]["q"][0, :12] = np.tile([0.0, 0.67, -1.3], 4)


def restarted(message: np.ndarray) -> None:
    message["tick"] = 5


@pytest.mark.parametrize(
    ("change", "reason"),
    [
        (tilted, "tilted: roll 80 deg"),
        (overstretched, "rad beyond its limit"),
        (broken, "not finite"),
        (restarted, "clock went back"),
    ],
)
def test_a_bad_state_damps_the_robot_for_good(
    robot: Robot, plant: Plant, change: Change, reason: str
) -> None:
    robot.change = change
    with pytest.raises(PlantError, match=reason):
        write_often(plant)
    stopped = len(robot.commands)
    robot.change = lambda message: None
    assert robot.is_damped_since(stopped)
    with pytest.raises(PlantError, match=reason):  # also when the state is fine again
        plant.write(PUSH)


@pytest.mark.parametrize("guards", [QUICK_TO_HEAR])
def test_silence_of_the_robot_damps_it_for_good(robot: Robot, plant: Plant) -> None:
    robot.is_alive = False
    with pytest.raises(PlantTimeout, match="no rt/lowstate for"):
        plant.write(PUSH)
    assert robot.is_damped_since(len(robot.commands))


def test_a_command_that_gets_lost_on_the_way_to_a_waiting_robot_is_sent_again(
    robot: Robot, plant: Plant
) -> None:
    robot.is_alive = False  # in lockstep: silent until it hears the command
    heard = robot.write
    losses = iter(range(3))

    def lose_some(data: bytes) -> None:
        heard(data)
        robot.is_alive = next(losses, None) is None

    robot.write = lose_some
    before, tick = len(robot.commands), robot.tick
    plant.write(PUSH)
    sent = [command.tobytes() for command in robot.commands[before:]]
    assert len(sent) == 4
    assert len(set(sent)) == 1
    assert robot.tick == tick + 2


@pytest.mark.parametrize("guards", [QUICK_TO_HANG])
def test_silence_of_the_controller_damps_the_robot_for_good(robot: Robot, plant: Plant) -> None:
    assert wait_until(lambda: is_damping(robot.commands[-1]), LIMIT)
    assert robot.is_damped_since(len(robot.commands))
    with pytest.raises(PlantError, match="no command for 500 ms"):
        plant.write(PUSH)


def test_a_controller_that_would_pause_between_calls_is_refused(plant: Plant) -> None:
    with pytest.raises(ConfigError, match="UnitreePlant must get commands without a break"):
        GO2Controller(plant=plant)


def test_a_dynamic_motion_is_refused_unless_it_is_allowed(plant: Plant) -> None:
    assert plant.is_hardware
    line = Timeline(balance=False).foot("FL", z=0.03, over=0.4).foot("RR", z=0.03, over=0.4)
    two_feet = compile_timeline(line.home(over=0.4), RobotModel())
    with GO2Controller(plant=plant, realtime=True) as go2:
        with pytest.raises(DynamicMotionRefused, match="UnitreePlant may move a robot"):
            go2.play(two_feet, check=False)
        with pytest.raises(StanceMismatch, match="the robot is lying"):
            go2.play(two_feet, check=False, allow_dynamic=True)


def test_at_the_exit_damping_is_sent_many_times_then_nothing(robot: Robot) -> None:
    plant = driven(PATIENT)
    plant.write(PUSH)
    pushed = len(robot.commands)
    plant.close()
    sent = robot.commands[pushed:]
    assert len(sent) > MANY
    assert all(map(is_damping, sent))
    assert wait_until(lambda: "unitree-watchdog" not in names_of_threads(), LIMIT)
    assert len(robot.commands) == pushed + len(sent)


def names_of_threads() -> list[str]:
    return [thread.name for thread in threading.enumerate()]


@pytest.mark.parametrize(
    ("at_first", "when_taken_over"), [(standing, None), (broken, None), (None, tilted)]
)
def test_a_robot_that_does_not_lie_or_gets_up_while_it_is_taken_over_is_sent_nothing(
    robot: Robot,
    monkeypatch: pytest.MonkeyPatch,
    at_first: Change | None,
    when_taken_over: Change | None,
) -> None:
    def take_over(*_: object) -> None:
        robot.change = when_taken_over or robot.change

    robot.change = at_first or robot.change
    monkeypatch.setattr(UnitreePlant, "_release_sport", take_over)
    with pytest.raises(PlantError, match="must lie on its belly"):
        driven(PATIENT)
    assert robot.commands == []


def test_the_soft_start_grows_over_half_a_second(robot: Robot) -> None:
    plant = driven(PATIENT)
    start = len(robot.commands)
    for _ in range(260):  # of 2 ms
        plant.write(PUSH)
    torques = [float(c["motor_cmd"]["tau"][0, 0]) for c in robot.commands[start:]]
    assert torques[0] == pytest.approx(0.0, abs=0.02)
    assert torques == sorted(torques)
    assert torques[-1] == pytest.approx(0.5)
    plant.close()


@pytest.mark.parametrize(
    ("command", "name"),
    [
        (JointCommand.damping(-1.0), "kd"),
        (JointCommand.damping(1000.0), "kd"),
        (JointCommand.servo(np.zeros(12), np.zeros(12), 1e4, 1.0), "kp"),
        (JointCommand.servo(np.zeros(12), np.full(12, 500.0), 10.0, 1.0), "v_des"),
    ],
)
def test_gains_out_of_bounds_are_refused(
    robot: Robot, plant: Plant, command: JointCommand, name: str
) -> None:
    before = len(robot.commands)
    with pytest.raises(CommandError, match=name):
        plant.write(command)
    assert len(robot.commands) == before
