"""A motor is judged by what it was asked for and what it gave."""

import numpy as np
import pytest

from go2_wbc.robot.model import RobotModel
from go2_wbc.robot.motor_watch import MotorWatch
from go2_wbc.robot.state import JointCommand, RobotState

DT = 0.002
LATE = 7  #: Ticks, 14 ms: by so much may a command act late


def watched(share: float, *, late: int = 0, amplitude: float = 8.0, ticks: int = 500) -> MotorWatch:
    """After a second of a swinging torque, of which joint 4 gives ``share``."""
    watch = MotorWatch(RobotModel().motor)
    asked = [amplitude * (1.0 + 0.6 * np.sin(2.0 * np.pi * 3.0 * DT * k)) for k in range(ticks)]
    for k in range(late, ticks):
        tau = np.full(12, asked[k - late])
        tau[4] *= share
        state = RobotState(DT * k, np.zeros(19), np.zeros(18), tau, np.zeros(4), np.ones(4, bool))
        watch.update(JointCommand.torque(np.full(12, asked[k])), state, DT)
    return watch


@pytest.mark.parametrize("late", [0, LATE])
def test_a_sound_motor_is_not_named(late: int) -> None:
    assert watched(1.0, late=late).faults == ()


@pytest.mark.parametrize("late", [0, LATE])
@pytest.mark.parametrize(("share", "what"), [(0.0, "is dead"), (0.5, "gives 5")])
def test_a_broken_motor_is_named_once(share: float, what: str, late: int) -> None:
    (fault,) = watched(share, late=late).faults
    assert fault.part == "motor of FR_thigh_joint"
    assert fault.what.startswith(what) or late
    assert fault.since < DT * late + 0.3
    assert fault.is_survived is (share > 0.0)


def test_a_motor_that_dies_while_less_and_less_is_asked_is_dead() -> None:
    watch = MotorWatch(RobotModel().motor)
    for t in DT * np.arange(400):
        tau = np.full(12, 8.0 * np.exp(-max(t - 0.4, 0.0) / 0.2))
        given = tau * (np.arange(12) != 4) if t > 0.4 else tau
        state = RobotState(t, np.zeros(19), np.zeros(18), given, np.zeros(4), np.ones(4, bool))
        watch.update(JointCommand.torque(tau), state, DT)
    (fault,) = watch.faults
    assert fault.part == "motor of FR_thigh_joint"
    assert not fault.is_survived


def test_a_motor_of_which_little_is_asked_is_not_judged() -> None:
    assert watched(0.0, amplitude=0.03).faults == ()


def test_a_motor_is_not_asked_for_more_than_it_can_give() -> None:
    most = float(RobotModel().motor.peak[4])
    watch = MotorWatch(RobotModel().motor)
    for k in range(300):
        tau = np.full(12, most)
        state = RobotState(DT * k, np.zeros(19), np.zeros(18), tau, np.zeros(4), np.ones(4, bool))
        watch.update(JointCommand.torque(np.full(12, 3.0 * most)), state, DT)
    assert "motor of FR_thigh_joint" not in [fault.part for fault in watch.faults]
