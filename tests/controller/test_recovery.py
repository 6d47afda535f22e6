"""A leg that a fall has left beside the trunk is folded before the robot rises, or it says no."""

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest

from controller import GO2Controller, Mode, recovery
from controller.behaviours import DAMPING
from controller.modes import unfolded_legs
from go2_wbc.legs import Leg
from go2_wbc.plant import MujocoPlant
from go2_wbc.robot.description import find_profile
from go2_wbc.robot.model import RobotModel
from go2_wbc.robot.state import JointCommand, RobotState
from tests.controller.plants import PERIOD, WatchedPlant
from tests.engine_helpers import state_of

TUCKED_JOINTS = find_profile().tucked_joints

WRAPPED = (0.0, 4.5, -2.0)  # rad; the rear thigh points ahead, beside the trunk, at its limit
# rad/s; enough to drive it against the trunk, where it jams.
KICK = 8.0
SETTLE_TICKS = 150


def wrapped() -> WatchedPlant:
    """A robot on its belly, its left rear leg jammed beside the trunk."""
    plant = MujocoPlant(control_period=PERIOD)
    q = np.concatenate([[0.0, 0.0, 0.25, 0.0, 0.0, 0.0, 1.0], np.tile([0.0, 0.9, -1.8], 4)])
    v = np.zeros(18)
    q[7:][Leg.RL.joints] = WRAPPED
    v[6:][Leg.RL.joints] = (0.0, KICK, 0.0)
    plant.place(q, v)
    for _ in range(SETTLE_TICKS):
        plant.write(JointCommand.damping(DAMPING))
    thigh = plant.read().joint_positions[Leg.RL.joints][1]
    assert thigh == pytest.approx(WRAPPED[1], abs=0.05)
    return WatchedPlant(plant)


class LamePlant(WatchedPlant):
    """A robot whose left rear leg does nothing, though its motors say that they work."""

    _asked = np.zeros(3)

    def read(self) -> RobotState:
        state = super().read()
        tau = state.tau.copy()
        tau[Leg.RL.joints] = self._asked
        return replace(state, tau=tau)

    def write(self, command: JointCommand) -> None:
        works = np.ones(12)
        works[Leg.RL.joints] = 0.0
        off = command.q_des - self.inner.read().joint_positions
        self._asked = (command.tau + command.kp * off)[Leg.RL.joints]
        tau, kp, kd = works * command.tau, works * command.kp, works * command.kd
        super().write(replace(command, tau=tau, kp=kp, kd=kd))


def test_a_leg_that_is_jammed_beside_the_trunk_is_freed_before_the_robot_rises() -> None:
    # It rose with that leg where it was: it stood on three, or fell over.
    model = RobotModel()
    with GO2Controller(plant=wrapped()) as go2:
        assert go2.recover(), go2.last_outcome.reason
        q = go2.state.joint_positions
        assert ((model.q_lower <= q) & (q <= model.q_upper)).all()
        assert go2.state.feet_in_contact.all()
        assert go2.telemetry.qp_failures == 0


@pytest.mark.parametrize(
    ("call", "reason"),
    [
        (GO2Controller.recover, "could not fold RL below the trunk"),
        (GO2Controller.stand, "cannot stand up: RL not below the trunk; call recover()"),
    ],
)
def test_a_leg_that_cannot_be_folded_is_named_and_the_robot_stays_down(
    monkeypatch: pytest.MonkeyPatch, call: Callable[[GO2Controller], bool], reason: str
) -> None:
    monkeypatch.setattr(recovery, "TRIES", 1)
    with GO2Controller(plant=LamePlant(wrapped().inner)) as go2:
        assert call(go2) is False
        assert go2.last_outcome.reason == reason
        assert go2.mode is Mode.FALLEN
        assert go2.state.q[2] < 0.2


def test_the_legs_that_are_not_folded_are_those_far_from_the_tucked_posture() -> None:
    q = np.concatenate([[0.0, 0.0, 0.1, 0.0, 0.0, 0.0, 1.0], TUCKED_JOINTS])
    assert unfolded_legs(RobotModel().snapshot(state_of(q))) == []
    q[7:][Leg.FR.joints] += (0.4, -0.4, 0.4)
    assert unfolded_legs(RobotModel().snapshot(state_of(q))) == []
    q[7:][Leg.RL.joints] += (0.0, 0.0, 0.6)
    q[7:][Leg.FL.joints] += (0.6, 0.0, 0.0)
    assert unfolded_legs(RobotModel().snapshot(state_of(q))) == [Leg.FL, Leg.RL]


def test_on_its_back_with_crossed_legs_it_rolls_to_the_other_side_in_the_end() -> None:
    # Rolling by one side only it fell back every time: the legs of that side were stuck.
    plant = MujocoPlant(control_period=PERIOD)
    upside_down = [0.0, 0.0, 0.072, 1.0, 0.0, 0.0, 0.0]
    rear = [-0.4, 0.8, -1.85, 1.1, 0.36, -2.68]
    plant.place(np.array([*upside_down, 0.0, 1.31, -2.7, 0.0, 1.31, -2.7, *rear]), np.zeros(18))
    with GO2Controller(plant=plant) as go2:
        assert go2.recover(), go2.last_outcome.reason
        assert go2.state.feet_in_contact.all()
