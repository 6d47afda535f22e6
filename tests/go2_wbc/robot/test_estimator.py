"""The state estimator against MuJoCo's truth, open loop and with the controller living on it."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from controller import GO2Controller
from go2_wbc.errors import ConfigError
from go2_wbc.plant import MujocoPlant, Plant
from go2_wbc.plant.sensors import SensorNoise
from go2_wbc.robot.estimator import EstimatorConfig, SensorReading, StateEstimator
from go2_wbc.robot.model import RobotModel
from go2_wbc.robot.state import JointCommand, RobotState

PERIOD = 0.004
# m/s; of the estimate while trotting at 0.5 m/s. A foot taken for a point that does not roll would
# be off by 4 % and more.
MEAN_BAR, RMS_BAR = 0.015, 0.03
STILL_BAR = 0.01  # m/s
PLACE_BAR = 0.05  # of the distance walked
LYING_DRIFT = 0.015  # m in 4 s; the feet of a limp robot slide a little, which looks like walking


class BlindPlant(Plant):
    """A simulated robot whose pose and speed are estimated from its noisy sensors."""

    def __init__(self, seed: int) -> None:
        self.truth = MujocoPlant(control_period=PERIOD)
        self._noise = SensorNoise()
        self._rng = np.random.default_rng(seed)
        self._estimator = StateEstimator(RobotModel())
        self.errors: list[np.ndarray] = []
        self._state = self._estimate()

    @property
    def control_period(self) -> float:
        return PERIOD

    def read(self) -> RobotState:
        return self._state

    def write(self, command: JointCommand) -> None:
        self.truth.write(command)
        self._state = self._estimate()

    def close(self) -> None:
        self.truth.close()

    def _estimate(self) -> RobotState:
        true = self.truth.read()
        state = self._noise.corrupt_state(true, self._rng)
        imu = self._noise.corrupt_imu(self.truth.imu(), self._rng)
        estimate = self._estimator.update(
            SensorReading(
                time=state.time,
                quaternion=imu.quaternion,
                gyro=imu.gyro,
                accelerometer=imu.accelerometer,
                q_joints=state.joint_positions,
                v_joints=state.joint_velocities,
                tau=state.tau,
                foot_forces=state.foot_forces,
            )
        )
        self.errors.append(estimate.v[:3] - true.v[:3])
        return estimate


@pytest.fixture(scope="module")
def walked() -> tuple[np.ndarray, float, float, np.ndarray]:
    """Velocity errors of a trot and of standing; distance by the estimate and in truth."""
    plant = BlindPlant(seed=3)
    with GO2Controller(plant=plant) as go2:
        assert go2.stand(), go2.last_outcome.reason
        plant.errors.clear()
        go2.wait(1.0)
        standing = np.array(plant.errors)
        assert go2.walk()
        go2.move(0.5)
        go2.wait(1.5)
        plant.errors.clear()
        start, true_start = go2.state.q[:2], plant.truth.read().q[:2]
        go2.wait(3.0)
        trotting = np.array(plant.errors)
        way = float(np.linalg.norm(go2.state.q[:2] - start))
        true_way = float(np.linalg.norm(plant.truth.read().q[:2] - true_start))
        assert go2.last_outcome.ok, go2.last_outcome.reason
    plant.close()
    return trotting, way, true_way, standing


@pytest.mark.slow
def test_a_trot_on_noisy_sensors_is_estimated(
    walked: tuple[np.ndarray, float, float, np.ndarray],
) -> None:
    trotting, way, true_way, _ = walked
    assert np.abs(trotting.mean(axis=0)[:2]).max() < MEAN_BAR
    assert np.sqrt((trotting**2).mean(axis=0)).max() < RMS_BAR
    assert way == pytest.approx(true_way, rel=PLACE_BAR)
    assert true_way == pytest.approx(1.5, rel=0.1)


@pytest.mark.slow
def test_a_standing_robot_stands_still(
    walked: tuple[np.ndarray, float, float, np.ndarray],
) -> None:
    assert np.sqrt((walked[3] ** 2).mean(axis=0)).max() < STILL_BAR


@pytest.mark.parametrize("seed", range(3))
def test_a_lying_robot_does_not_drift_away(seed: int) -> None:
    plant = BlindPlant(seed)
    start = plant.truth.read().q[:2]
    for _ in range(1000):
        plant.write(JointCommand.damping(3.0))
    drift = plant.read().q[:2] - (plant.truth.read().q[:2] - start)
    assert np.linalg.norm(drift) < LYING_DRIFT
    assert np.abs(plant.read().v[:3]).max() < 0.05
    plant.close()


def reading(time: float) -> SensorReading:
    gravity = np.array([0.0, 0.0, 9.81])
    joints = np.tile([0.0, 0.8, -1.6], 4)
    forces = np.full(4, 40.0)
    upright = np.array([0.0, 0.0, 0.0, 1.0])
    return SensorReading(
        time, upright, np.zeros(3), gravity, joints, np.zeros(12), np.zeros(12), forces
    )


def test_it_begins_above_the_lowest_foot_and_stays_there() -> None:
    model = RobotModel()
    estimator = StateEstimator(model)
    states = [estimator.update(reading(0.002 * tick)) for tick in range(200)]
    assert states[0].q[:2] == pytest.approx([0.0, 0.0], abs=1e-9)
    _, p_feet = model.forward_kinematics(states[-1].q)
    assert p_feet[:, 2] == pytest.approx(model.foot_radius, abs=1e-3)
    assert np.abs(states[-1].v).max() < 1e-6


def test_a_gap_in_the_readings_begins_the_filter_anew() -> None:
    estimator = StateEstimator(RobotModel())
    estimator.update(reading(0.0))
    falling = replace(reading(0.002), accelerometer=np.array([50.0, 0.0, 9.81]))
    assert estimator.update(falling).v[0] > 0.0
    assert estimator.update(reading(5.0)).v[0] == pytest.approx(0.0, abs=1e-9)


def test_numbers_must_be_positive() -> None:
    with pytest.raises(ConfigError, match="velocity"):
        EstimatorConfig(velocity=-1.0)


def test_a_foot_is_trusted_above_the_force_at_which_it_touches() -> None:
    with pytest.raises(ConfigError, match="trusted_force must be above contact_force"):
        EstimatorConfig(contact_force=30.0)


def test_the_estimate_does_not_depend_on_when_the_clock_began() -> None:
    def speed(begin: float) -> float:
        estimator = StateEstimator(RobotModel())
        states = [
            estimator.update(
                replace(
                    reading(begin + 0.002 * tick),
                    accelerometer=np.array([1.0, 0.0, 9.81]),
                    foot_forces=np.zeros(4),
                )
            )
            for tick in range(50)
        ]
        return float(states[-1].v[0])

    assert speed(0.0) > 0.01
    assert speed(1000.0) == pytest.approx(speed(0.0), rel=1e-6)
