"""The state estimator against the least-squares problem that a Kalman filter solves tick by tick.

With all readings at once, the most likely states minimise the sum of squares of every residual
divided by its standard deviation (Bell & Cathey, IEEE Trans. Autom. Control 38(2), 1993); the last
of them is what the filter must say.
"""

from __future__ import annotations

import numpy as np
import pytest

from go2_wbc.robot.estimator import EstimatorConfig, SensorReading, StateEstimator
from go2_wbc.robot.model import RobotModel
from tests.engine_helpers import STAND_JOINTS

STEP, COUNT = 0.01, 5  # s; of readings
EXACT = 1e-6  # m, m/s; both leave out what has nearly no weight
P_BASE_IMU = np.array([-0.02557, 0.0, 0.04232])  # m; the URDF's imu_joint
GRAVITY = np.array([0.0, 0.0, 9.81])
CONFIG = EstimatorConfig()
DEVIATIONS = (0.001, 0.1, 0.01, 0.01, 0.01, 0.01)  # m, m/s, m: of position, speed, feet at first
FORCES = {
    "some feet half loaded": np.array([40.0, 15.0, 12.0, 0.0]),
    "all feet in the air": np.zeros(4),
}


def readings(forces: np.ndarray) -> list[SensorReading]:
    """An upright robot whose joints are read without a speed, and with much noise."""
    rng = np.random.default_rng(5)
    return [
        SensorReading(
            time=STEP * tick,
            quaternion=np.array([0.0, 0.0, 0.0, 1.0]),
            gyro=np.zeros(3),
            accelerometer=GRAVITY + 3.0 * rng.standard_normal(3),
            q_joints=STAND_JOINTS + 0.02 * rng.standard_normal(12),
            v_joints=np.zeros(12),
            tau=np.zeros(12),
            foot_forces=forces,
        )
        for tick in range(COUNT)
    ]


class LeastSquares:
    """Statements about the states (6,) of all instants: a row, what it should give, how surely."""

    def __init__(self) -> None:
        self._rows: list[np.ndarray] = []
        self._values: list[float] = []

    def say(
        self,
        tick: int,
        now: np.ndarray,
        value: float,
        sigma: float,
        before: np.ndarray | None = None,
    ) -> None:
        """``now`` of the state at ``tick`` and ``before`` of the one before sum to ``value``."""
        row = np.zeros((COUNT, 6))
        row[tick] = now
        if before is not None:
            row[tick - 1] = before
        self._rows.append(row.ravel() / sigma)
        self._values.append(value / sigma)

    def begin(self, state: np.ndarray) -> None:
        """What is assumed before the first reading."""
        for row, value, sigma in zip(np.eye(6), state, DEVIATIONS, strict=True):
            self.say(0, row, value, sigma)

    def push(self, tick: int, a: float) -> None:
        """Position and velocity follow from those before and the acceleration ``a``."""
        p, v = np.eye(6)[:2]
        sigma = CONFIG.acceleration
        self.say(tick, p, STEP**2 / 2 * a, STEP**2 / 2 * sigma, -p - STEP * v)
        self.say(tick, v, STEP * a, STEP * sigma, -v)

    def last(self) -> np.ndarray:
        """The last state (6,) of the best solution."""
        return np.linalg.lstsq(np.array(self._rows), np.array(self._values), rcond=None)[0][-6:]


def most_likely(given: list[SensorReading], model: RobotModel) -> np.ndarray:
    """Position, velocity and feet (6, 3) of the last instant, from all readings at once."""
    low, high = CONFIG.contact_force, CONFIG.trusted_force
    trust = np.clip((given[0].foot_forces - low) / (high - low), 1e-3, 1.0)
    feet = np.array([_feet(reading, model) for reading in given])
    start = P_BASE_IMU.copy()
    start[2] = model.foot_radius - feet[0][:, 2].min()
    begin = np.vstack([start, np.zeros(3), start + feet[0]])
    p, v, *f = np.eye(6)
    last = np.zeros((6, 3))
    for axis, told in enumerate([LeastSquares() for _ in range(3)]):
        told.begin(begin[:, axis])
        for tick, leg in np.ndindex(COUNT, 4):
            told.say(tick, f[leg] - p, feet[tick, leg, axis], CONFIG.place)
            told.say(tick, v, 0.0, CONFIG.velocity / trust[leg])
            if axis == 2:
                told.say(tick, f[leg], model.foot_radius, CONFIG.height / trust[leg])
            if tick:
                told.say(tick, f[leg], 0.0, CONFIG.foot_drift / trust[leg] * STEP, -f[leg])
        if not (given[0].foot_forces > low).any():
            for tick in range(COUNT):
                told.say(tick, v, 0.0, CONFIG.rest)
        for tick in range(1, COUNT):
            told.push(tick, (given[tick].accelerometer - GRAVITY)[axis])
        last[:, axis] = told.last()
    return last


def _feet(reading: SensorReading, model: RobotModel) -> np.ndarray:
    """Foot centres (4, 3) from the IMU."""
    q = np.concatenate([np.zeros(6), [1.0], reading.q_joints])
    return model.forward_kinematics(q)[1] - P_BASE_IMU


@pytest.mark.parametrize("case", FORCES)
def test_the_estimate_is_the_most_likely_state_by_the_documented_deviations(case: str) -> None:
    model = RobotModel()
    given = readings(FORCES[case])
    estimator = StateEstimator(model, CONFIG)
    states = [estimator.update(reading) for reading in given]
    expected = most_likely(given, model)
    assert states[-1].v[:3] == pytest.approx(expected[1], abs=EXACT)
    assert states[-1].q[:3] + P_BASE_IMU == pytest.approx(expected[0], abs=EXACT)
    assert np.abs(expected[1]).max() > 1e4 * EXACT
