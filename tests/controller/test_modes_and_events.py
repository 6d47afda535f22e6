"""In every mode something notices a fall, a foot without ground, a broken part, a second thread."""

from collections.abc import Callable, Iterator
from concurrent.futures import Future

import numpy as np
import pytest

from controller import GO2Controller, Mode
from go2_wbc.errors import ModeError
from go2_wbc.plant import MujocoPlant
from go2_wbc.plant.mujoco.ground_truth import GroundTruth
from tests.controller.plants import HANG_GUARD, PERIOD, in_thread

# N, s: it throws over a robot that stands, and lifts a foot that carries 40 N.
SHOVE, SHOVE_TIME = np.array([0.0, 900.0, 300.0]), 0.15
LIFT, LIFT_TIME = np.array([0.0, 0.0, 60.0]), 0.4
MOTOR = "FR_calf_joint"
DOWN = (Mode.FALLEN, Mode.DAMPED)


class Robot:
    """A robot, what brings it into a mode, and what it is told there."""

    def __init__(self) -> None:
        self.plant = MujocoPlant(control_period=PERIOD)
        self.truth = GroundTruth(self.plant)
        self.go2 = GO2Controller(plant=self.truth)

    def fall(self) -> None:
        self.go2.stand()
        self.plant.push(SHOVE, SHOVE_TIME)
        self.go2.wait(2.0)
        assert self.go2.mode is Mode.FALLEN

    def go_limp(self) -> None:
        self.go2.stand()
        self.go2.damp()
        self.go2.wait(1.0)

    def trot(self) -> None:
        self.go2.walk()
        self.go2.move(0.5)
        self.go2.wait(1.0)

    def is_down(self) -> bool:
        return self.truth.fall() is not None


def wait(robot: Robot) -> None:
    robot.go2.wait(2.5)


# How the robot comes into each mode, what is called there, and after how long [s] of that the
# event comes.
MODES: dict[str, tuple[Callable[[Robot], object], Callable[[Robot], object], float]] = {
    "standing": (lambda r: r.go2.stand(), wait, 0.1),
    "walking": (Robot.trot, wait, 0.1),
    "playing": (lambda r: r.go2.stand(), lambda r: r.go2.play("bow"), 0.8),
    "jumping": (lambda r: r.go2.stand(), lambda r: r.go2.play("jump_up"), 1.2),
    "sitting": (lambda r: r.go2.sit(), wait, 0.1),
    "lying": (lambda _: None, wait, 0.1),
    "limp": (Robot.go_limp, wait, 0.1),
    "fallen": (Robot.fall, wait, 0.1),
    "recovering": (Robot.fall, lambda r: r.go2.recover(), 0.7),
}
ON_THE_GROUND = ("lying", "limp", "fallen")


@pytest.fixture
def robot() -> Iterator[Robot]:
    robot = Robot()
    yield robot
    robot.go2.close()
    robot.plant.close()


def met(robot: Robot, mode: str, event: Callable[[], object]) -> object:
    """What the call says in which ``event`` comes."""
    prepare, call, moment = MODES[mode]
    prepare(robot)
    start = robot.plant.time + moment

    def look() -> None:
        if robot.plant.time >= start:
            robot.truth.on_tick = None
            event()

    robot.truth.on_tick = look
    return call(robot)


@pytest.mark.parametrize("mode", MODES)
def test_a_fall_is_noticed_in_every_mode(robot: Robot, mode: str) -> None:
    said = met(robot, mode, lambda: robot.plant.push(SHOVE, SHOVE_TIME))
    robot.go2.wait(0.5)
    if mode not in ("lying", "limp", "recovering"):  # these may end on the belly again
        assert robot.go2.mode is Mode.FALLEN
    assert robot.go2.mode in DOWN or not robot.is_down() or mode == "lying"
    assert said is not True or robot.go2.mode is Mode.STANDING
    assert robot.go2.health.is_sound  # tumbling limply was taken for broken motors


@pytest.mark.parametrize("mode", MODES)
def test_a_foot_without_ground_ends_well_or_is_told(robot: Robot, mode: str) -> None:
    said = met(robot, mode, lambda: robot.plant.push(LIFT, LIFT_TIME, "FR_foot"))
    robot.go2.wait(0.5)
    assert robot.go2.mode in DOWN or not robot.is_down() or mode in ON_THE_GROUND
    assert said is not True or robot.go2.mode is Mode.STANDING


@pytest.mark.parametrize("mode", MODES)
def test_a_dead_motor_is_named_in_every_mode(robot: Robot, mode: str) -> None:
    said = met(robot, mode, lambda: robot.plant.fault("motor", MOTOR))
    if mode in ON_THE_GROUND:  # nothing is asked of the motors there
        go2 = robot.go2
        said = go2.recover() if go2.mode is Mode.FALLEN else go2.stand()
    assert not said
    assert robot.go2.mode in DOWN
    assert MOTOR in str(robot.go2.health)
    assert MOTOR in robot.go2.last_outcome.reason or mode in ("fallen", "recovering", "walking")


@pytest.mark.parametrize("mode", MODES)
def test_a_second_thread_is_refused_but_for_damp(robot: Robot, mode: str) -> None:
    refused: list[Exception | None] = []
    damped: list[Future[None]] = []

    def call_twice() -> None:
        refused.append(in_thread(robot.go2.sit).exception(HANG_GUARD))  # type: ignore[arg-type]
        damped.append(in_thread(robot.go2.damp))

    said = met(robot, mode, call_twice)
    damped[0].result(HANG_GUARD)
    assert isinstance(refused[0], ModeError)
    assert not said
    assert robot.go2.mode in DOWN
