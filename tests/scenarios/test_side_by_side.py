"""Several robots in one process do not know of each other."""

import pytest

from controller import GO2Controller, Mode
from go2_wbc.plant import MujocoPlant
from go2_wbc.robot.state import RobotState
from tests.controller.plants import HANG_GUARD, PERIOD, in_thread
from tests.go2_wbc.plant.contract import same

SPEED = {"left": 0.2, "right": -0.2}
SEED = {"left": 1, "right": 2}
ROUNDS = 4


def robot(name: str) -> GO2Controller:
    plant = MujocoPlant(control_period=PERIOD, sensors="noisy", seed=SEED[name])
    return GO2Controller(namespace=name, plant=plant)


def start(go2: GO2Controller) -> None:
    assert go2.walk()
    go2.move(0.3, SPEED[go2.namespace])


def alone(name: str) -> RobotState:
    with robot(name) as go2:
        start(go2)
        for _ in range(ROUNDS):
            go2.wait(0.1)
        return go2.state


@pytest.fixture(scope="module")
def solo() -> dict[str, RobotState]:
    """Where each robot ends when it is the only one."""
    return {name: alone(name) for name in SPEED}


def test_two_robots_in_turns_do_what_each_does_alone(solo: dict[str, RobotState]) -> None:
    with robot("left") as left, robot("right") as right:
        start(left)
        start(right)
        for _ in range(ROUNDS):
            left.wait(0.1)
            right.wait(0.1)
        assert left.command != right.command
        assert same(left.state, solo["left"])
        assert same(right.state, solo["right"])


def test_two_robots_in_two_threads_do_what_each_does_alone(solo: dict[str, RobotState]) -> None:
    runs = {name: in_thread(lambda name=name: alone(name)) for name in SPEED}
    for name, run in runs.items():
        assert same(run.result(HANG_GUARD), solo[name])


def test_closing_or_damping_one_robot_leaves_the_other_alone() -> None:
    with robot("left") as left, robot("right") as right:
        assert right.stand()
        left.damp()
        assert (left.mode, right.mode) == (Mode.DAMPED, Mode.STANDING)
        assert right.last_outcome.ok
        left.close()
        assert right.stand()
        assert (left.mode, right.mode) == (Mode.CLOSED, Mode.STANDING)
