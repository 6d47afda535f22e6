"""Identified friction: near the plant's own, ready for the configuration, refused where wrong."""

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from go2_wbc.config import load_config
from go2_wbc.errors import PlantError, PlantTimeout
from go2_wbc.plant import MujocoPlant, Plant
from go2_wbc.plant.friction_identification import (
    OVER_THE_BACK,
    FrictionEstimate,
    _all_legs,
    fitted,
    identify_friction,
)
from go2_wbc.plant.mujoco.model import JointDynamics
from go2_wbc.robot.model import RobotModel
from go2_wbc.robot.state import JointCommand, RobotState
from tests.controller.plants import lying_state
from tests.go2_wbc.plant.helpers import stand_up

DRY_ERROR, VISCOUS_ERROR = 0.04, 0.06  # [N m], [N m s/rad]; measured 0.02 and 0.04 at most
SPEEDS = np.tile([0.25, 0.5, 1.0, 1.5], (12, 1))
ANY = np.arange(12.0)[:, None]


class Doctored(Plant):
    """A simulated robot whose states pass through ``change``."""

    def __init__(self, change: Callable[[RobotState], RobotState]) -> None:
        self._inner, self._change = MujocoPlant(), change

    @property
    def control_period(self) -> float:
        return self._inner.control_period

    def read(self) -> RobotState:
        return self._change(self._inner.read())

    def write(self, command: JointCommand) -> None:
        self._inner.write(command)

    def close(self) -> None:
        self._inner.close()


class Obedient(Plant):
    """Its joints go as they are told, against friction, which is more near the ends of a way."""

    def __init__(self) -> None:
        self._model, self.sent = RobotModel(), list[JointCommand]()
        self._state = lying_state(3.0)

    @property
    def control_period(self) -> float:
        return 0.03

    def read(self) -> RobotState:
        return self._state

    def write(self, command: JointCommand) -> None:
        self.sent.append(command)
        q, v = self._state.q.copy(), np.zeros(18)
        if command.kp.any():
            q[7:], v[6:] = command.q_des, command.v_des
        time, air = self._state.time + self.control_period, np.zeros(4, dtype=bool)
        state = RobotState(time, q, v, np.zeros(12), np.zeros(4), air)
        off = np.abs(q[7:] - _all_legs(OVER_THE_BACK)).max() > 0.21
        friction = (0.3 + 0.5 * off) * np.sign(v[6:]) + 0.2 * v[6:]
        self._state = replace(state, tau=self._model.snapshot(state).bias[6:] + friction)

    def close(self) -> None: ...


def test_of_joints_that_follow_the_friction_is_found_exactly() -> None:
    plant, shares = Obedient(), list[float]()
    found = identify_friction(plant, on_progress=shares.append)
    np.testing.assert_allclose(found.dry, 0.3, atol=1e-9)
    np.testing.assert_allclose(found.viscous, 0.2, atol=1e-9)
    np.testing.assert_allclose(shares, np.arange(1, 13) / 12)
    moved = np.array([command.q_des for command in plant.sent if command.kp.any()])
    assert np.ptp(moved, axis=0).min() > 0.79
    left, right = np.array([0.3, 1.3, -2.66]), np.array([-0.3, 1.3, -2.66])
    np.testing.assert_allclose(moved[-1], np.tile([*left, *right], 2), atol=0.01)
    limp = [command for command in plant.sent if not command.kp.any()]
    assert limp == plant.sent[-10:]
    assert all((command.kd == 3.0).all() for command in limp)
    assert 50.0 < plant.read().time - 3.0 < 70.0


def noisy(dynamics: JointDynamics) -> MujocoPlant:
    return MujocoPlant(
        joint_dynamics=dynamics, control_period=0.004, sensors="noisy", payload=3.0, seed=4
    )


def heavy(dynamics: JointDynamics) -> MujocoPlant:
    return MujocoPlant(joint_dynamics=dynamics, control_period=0.004, mass_scale=1.1)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("make", "dry", "viscous"),
    [(noisy, (0.1, 0.5, 0.3), (2.0, 0.0, 0.5)), (heavy, (0.4, 0.2, 1.4), (0.1, 2.0, 1.0))],
)
def test_the_friction_of_every_joint_is_found(
    make: Callable[[JointDynamics], MujocoPlant],
    dry: tuple[float, float, float],
    viscous: tuple[float, float, float],
) -> None:
    plant = make(JointDynamics(damping=viscous, friction_loss=dry))
    shares: list[float] = []
    found = identify_friction(plant, on_progress=shares.append)
    np.testing.assert_allclose(found.dry, dry * 4, atol=DRY_ERROR)
    np.testing.assert_allclose(found.viscous, viscous * 4, atol=VISCOUS_ERROR)
    assert (np.array(found.feed_forward.viscous) <= 0.76 * found.viscous + 1e-3).all()
    assert shares == sorted(shares)
    assert shares[-1] == 1.0
    state = plant.read()
    assert state.tilt < 0.2
    assert np.abs(state.joint_velocities).max() < 0.5, "it ends limp and at rest"


def test_a_straight_line_is_found_exactly_and_written_for_the_configuration(tmp_path: Path) -> None:
    dry, viscous = 0.1 + 0.1 * ANY, 0.05 * ANY
    found = fitted(SPEEDS, dry + viscous * SPEEDS)
    np.testing.assert_allclose(found.dry, dry.ravel(), atol=1e-9)
    np.testing.assert_allclose(found.viscous, viscous.ravel(), atol=1e-9)
    path = tmp_path / "friction.toml"
    path.write_text(found.toml(), encoding="utf-8")
    friction = load_config(path).wbc.joint_friction
    assert friction == found.feed_forward
    np.testing.assert_allclose(friction.dry, dry.ravel(), atol=1e-3)
    np.testing.assert_allclose(friction.viscous, 0.75 * viscous.ravel(), atol=1e-3)


def test_what_is_uncertain_of_the_viscous_friction_is_not_fed_forward() -> None:
    found = FrictionEstimate(
        dry=np.full(12, 0.2),
        viscous=np.array([1.0, 0.1] * 6),
        dry_error=np.full(12, 0.01),
        viscous_error=np.full(12, 0.1),
    )
    np.testing.assert_allclose(found.feed_forward.viscous, [0.6, 0.0] * 6)


def test_what_is_no_friction_or_cannot_be_measured_is_refused_by_name() -> None:
    friction = 0.2 + 0.1 * SPEEDS
    friction[5] = [1.0, 0.2, 1.5, 0.1]
    with pytest.raises(PlantError, match=r"FR_calf_joint is no sum of a dry and a viscous part"):
        fitted(SPEEDS, friction)
    friction = np.full((12, 4), 0.2)
    friction[7] = -1.0
    with pytest.raises(PlantError, match=r"dry friction of RL_thigh_joint .* -1\.000, below 0"):
        fitted(SPEEDS, friction)
    plant = MujocoPlant()
    stand_up(plant)
    with pytest.raises(PlantError, match="lay the robot on its belly"):
        identify_friction(plant)
    with pytest.raises(PlantTimeout, match="clock stands still"):
        identify_friction(Doctored(lambda state: replace(state, time=0.0)))


def test_a_foot_that_touches_and_a_plant_without_torques_are_refused() -> None:
    def touching(state: RobotState) -> RobotState:
        return replace(state, feet_in_contact=np.array([False, False, True, False]))

    with pytest.raises(PlantError, match="RL_foot must be in the air"):
        identify_friction(Doctored(touching))

    def without_torque(state: RobotState) -> RobotState:
        return replace(state, tau=np.zeros(12))

    with pytest.raises(PlantError, match="does not say what torques"):
        identify_friction(Doctored(without_torque))
