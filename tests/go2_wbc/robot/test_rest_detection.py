"""The state estimator of a robot that tumbles, falls on its back, or begins in the air."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pinocchio as pin
import pytest
from jaxtyping import Float

from benchmarks.balance import dropped
from controller import GO2Controller
from go2_wbc.robot.estimator import EstimatorConfig, SensorReading, StateEstimator
from go2_wbc.robot.model import RobotModel
from go2_wbc.robot.state import RobotState
from go2_wbc.robot.state_filter import THETA
from tests.engine_helpers import STAND_JOINTS

STEP = 0.002  # s
ON_BACK = pin.rpy.rpyToMatrix(2.5, -0.3, 0.0)
FALLING = np.array([0.1, 0.3, -0.2])  # m/s^2
TILT_BAR = np.radians(1.5)  # the biases that a start forgets are 0.3 deg
HEIGHT_BAR = 0.005  # m; in a tick


def resting(
    time: float, R: Float[np.ndarray, "3 3"], forces: float = 0.0, jolt: float = 0.0
) -> SensorReading:
    """What a robot reads that does not move."""
    felt = R.T @ [0.0, 0.0, 9.81] + [jolt, 0.0, 0.0]
    loads = np.full(4, forces)
    return SensorReading(time, np.zeros(3), felt, STAND_JOINTS, np.zeros(12), np.zeros(12), loads)


def tilt_between(state: RobotState, R: Float[np.ndarray, "3 3"]) -> float:
    """Angle [rad] between what is up for the estimate and in truth."""
    return float(np.arccos(np.clip(state.R_world_base[2] @ R[2], -1.0, 1.0)))


def found_after(time: float, every: int = 0, config: EstimatorConfig | None = None) -> float:
    """Tilt [rad] by which a robot is off that stood, and rests on its back unseen by its gyro.

    Its accelerometer is jolted in one of ``every`` readings.
    """
    estimator = StateEstimator(RobotModel(), config)
    for tick in range(200):
        estimator.update(resting(STEP * tick, np.eye(3), forces=40.0))
    tilts = []
    for tick in range(round(time / STEP)):
        jolt = 30.0 if every and tick % every == 0 else 0.0
        state = estimator.update(resting(STEP * (200 + tick), ON_BACK, jolt=jolt))
        tilts.append(tilt_between(state, ON_BACK))
    return tilts[-1]


def test_a_robot_that_was_lost_is_found_once_it_is_at_rest() -> None:
    assert found_after(0.35) < TILT_BAR
    assert found_after(0.35, config=EstimatorConfig(still_time=100.0)) > 5 * TILT_BAR


def test_who_begins_in_the_air_does_not_trust_its_tilt() -> None:
    deviations = []
    for felt in (resting(0.0, np.eye(3)), replace(resting(0.0, np.eye(3)), accelerometer=FALLING)):
        estimator = StateEstimator(RobotModel())
        estimator.update(felt)
        deviations.append(float(estimator.save()["state"].filter.P[THETA, THETA]) ** 0.5)
    assert deviations[0] < EstimatorConfig().tilt
    assert deviations[1] > 0.5


def test_jolts_delay_that_and_do_not_prevent_it() -> None:
    assert found_after(0.6, every=20) < 3 * TILT_BAR
    assert found_after(0.6, every=1) > 5 * TILT_BAR


def test_a_robot_that_rolled_onto_its_feet_forgets_its_biases_and_keeps_its_height() -> None:
    estimator, rate = StateEstimator(RobotModel()), 5.0
    for tick in range(200):
        estimator.update(resting(STEP * tick, pin.rpy.rpyToMatrix(2.0, 0.0, 0.0)))
    for tick in range(200):
        R = pin.rpy.rpyToMatrix(2.0 - rate * STEP * (tick + 1), 0.0, 0.0)
        rolling = replace(resting(STEP * (200 + tick), R), gyro=np.array([-rate, 0.0, 0.0]))
        estimator.update(rolling)
    saved = estimator.save()
    x = saved["state"].filter.x
    x.gyro_bias[:], x.force_bias[:] = 0.04, 0.04
    estimator.restore(saved)
    rests = [resting(STEP * (400 + tick), np.eye(3), forces=40.0) for tick in range(300)]
    states = [estimator.update(given) for given in rests]
    assert tilt_between(states[-1], np.eye(3)) < TILT_BAR
    x = estimator.save()["state"].filter.x
    assert np.abs([x.gyro_bias, x.force_bias]).max() < 0.002
    heights = np.array([state.q[2] for state in states])
    assert np.abs(np.diff(heights)).max() < HEIGHT_BAR
    assert not estimator.save()["state"].rest.tumbled


def test_a_robot_that_never_tumbled_does_not_begin_anew() -> None:
    estimator = StateEstimator(RobotModel())
    leaning = pin.rpy.rpyToMatrix(0.0, -0.75, 0.0)  # as reared
    for tick in range(300):
        estimator.update(resting(STEP * tick, leaning if tick < 200 else np.eye(3), forces=40.0))
    estimator.update(resting(STEP * 300, np.eye(3), forces=40.0))
    assert not estimator.save()["state"].rest.tumbled


@pytest.mark.slow
@pytest.mark.parametrize("seed", [9001, 9003, 9006])
def test_a_dropped_robot_stands_up_on_its_own_sensors(seed: int) -> None:
    # None of these stood before: attitude, biases and speed were lost in the fall.
    plant = dropped(seed, sensors="imu")
    with GO2Controller(plant=plant) as go2:
        go2.wait(1.0)
        assert go2.recover(), go2.last_outcome.reason
        assert go2.stand(), go2.last_outcome.reason
    assert plant.truth().tilt < np.radians(3.0)
    plant.close()
