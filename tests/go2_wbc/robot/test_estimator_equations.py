"""The estimator against the documented filter in numpy: all numbers at once, by an inverse.

Its Jacobians are finite differences of the functions that they are of, and its feet and their
velocities come from Pinocchio; nothing is shared with the estimator but the equations
of ``robot.estimator`` (Kalman, J. Basic Eng. 82, 1960; Sola, *Quaternion kinematics for the
error-state Kalman filter*, 2017, sec. 7).
"""

from collections.abc import Callable

import numpy as np
import pinocchio as pin
import pytest

from go2_wbc.legs import FOOT_NAMES
from go2_wbc.robot.estimator import EstimatorConfig, SensorReading, StateEstimator, estimate
from go2_wbc.robot.model import RobotModel
from tests.compiled import assert_plain_is_compiled
from tests.engine_helpers import STAND_JOINTS

STEP, COUNT = 0.002, 40  # s; of readings
NUDGE = 1e-6
EXACT = 2e-5  # m, m/s, rad; what is left is the differences' rounding, and dR / db half a step
SAME = 1e-3  # correlation
ONE = np.eye(3)
P_BASE_IMU = np.array([-0.02557, 0.0, 0.04232])  # m; the URDF's imu_joint
CONFIG = EstimatorConfig(lying_time=0.03, learning_speed=0.1)
FORCES = {
    "some feet half loaded": np.array([40.0, 15.0, 12.0, 0.0]),
    "all feet in the air": np.zeros(4),
    "all feet on the ground": np.array([40.0, 35.0, 60.0, 90.0]),
    "a foot on a stone": np.array([40.0, 35.0, 60.0, 90.0]),
    "two feet on a step": np.array([40.0, 35.0, 60.0, 90.0]),
}
# rad; of the joints of the feet that come down second, or second and third
LIFTED = {"stone": (np.array([0.1, 0.0, 0.0]), 1), "step": (np.array([0.0, 0.0, -0.35]), 2)}


def readings(case: str) -> list[SensorReading]:
    """A robot that turns and kicks, with much noise; its feet come down one after the other."""
    rng, forces = np.random.default_rng(5), FORCES[case]
    lifted = np.zeros(12)
    if (on := case.split()[-1]) in LIFTED:
        by, count = LIFTED[on]
        lifted[3 : 3 + 3 * count] = np.tile(by, count)
    return [
        SensorReading(
            time=STEP * tick,
            gyro=np.array([0.4, -0.3, 0.1]) + 0.1 * rng.standard_normal(3),
            accelerometer=np.array([0.5, -0.3, 9.6]) + rng.standard_normal(3),
            q_joints=STAND_JOINTS + lifted + 0.01 * rng.standard_normal(12),
            v_joints=rng.standard_normal(12),
            tau=np.zeros(12),
            foot_forces=forces * (tick > 3 * np.arange(4)),
        )
        for tick in range(COUNT)
    ]


class DocumentedFilter:
    """The filter, written for reading: x is p, v, R, gyro bias, force bias, feet."""

    def __init__(self, model: RobotModel, first: SensorReading) -> None:
        self.model, self.pin, self.data = model, model.pin_model, model.pin_model.createData()
        self.normals = np.tile([0.0, 0.0, 1.0], (4, 1))
        up = first.accelerometer
        roll, pitch = np.arctan2(up[1], up[2]), np.arctan2(-up[0], np.hypot(up[1], up[2]))
        R = pin.rpy.rpyToMatrix(roll, pitch, 0.0)
        feet = self.legs(first, np.zeros(3), R)[0]
        p = R @ P_BASE_IMU
        p[2] = model.foot_radius - feet[:, 2].min()
        self.x = [p, np.zeros(3), R, np.zeros(3), np.zeros(3), (p + feet).ravel()]
        tilt = [CONFIG.tilt, CONFIG.tilt, 1e-4]
        biases = [CONFIG.gyro_bias] * 3 + [CONFIG.accelerometer_bias] * 3
        self.P = np.diag([0.001] * 3 + [0.1] * 3 + tilt + biases + [0.01] * 12) ** 2
        self.age, self.gyro, self.lying, self.upset = np.zeros(4), first.gyro, 0.0, 0.0
        self.levels, self.met, self.doubt = [0.0] * 8, np.zeros(4), 0.0
        self.prints: list[list[np.ndarray]] = [[], []]  # of the front feet, of the hind feet
        self.step(first, 0.0)

    @staticmethod
    def plus(x: list[np.ndarray], error: np.ndarray) -> list[np.ndarray]:
        """The state that is off by ``error`` (27,)."""
        parts = np.split(error, [3, 6, 9, 12, 15])
        return [
            pin.exp3(part) @ number if place == 2 else number + part
            for place, (number, part) in enumerate(zip(x, parts, strict=True))
        ]

    @staticmethod
    def minus(a: list[np.ndarray], b: list[np.ndarray]) -> np.ndarray:
        """The error (27,) by which ``a`` is off ``b``."""
        pairs = enumerate(zip(a, b, strict=True))
        return np.concatenate([pin.log3(i @ j.T) if n == 2 else i - j for n, (i, j) in pairs])

    @staticmethod
    def jacobian(function: Callable[[np.ndarray], np.ndarray]) -> np.ndarray:
        """Of a function of the error, at no error."""
        return np.column_stack(
            [(function(e) - function(-e)) / (2 * NUDGE) for e in NUDGE * np.eye(27)]
        )

    def legs(
        self, reading: SensorReading, w: np.ndarray, R: np.ndarray
    ) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
        """Places of the feet, velocities of the IMU by each, those of rolling feet: world.

        And the feet's speeds along the trunk.
        """
        q = np.concatenate([np.zeros(6), [1.0], reading.q_joints])
        v = np.concatenate([np.zeros(3), w, reading.v_joints])
        pin.forwardKinematics(self.pin, self.data, q, v)
        place, velocity, rolling = np.empty((4, 3)), np.empty((4, 3)), np.zeros((4, 3))
        speed = np.empty(4)
        for leg, name in enumerate(FOOT_NAMES):
            frame = self.pin.getFrameId(name)
            place[leg] = pin.updateFramePlacement(self.pin, self.data, frame).translation
            u = pin.getFrameVelocity(self.pin, self.data, frame, pin.LOCAL_WORLD_ALIGNED)
            calf = R @ u.angular
            radius = self.model.foot_radius - 0.5 * CONFIG.compliance * reading.foot_forces[leg]
            normal = self.normals[leg]
            rolling[leg] = np.cross(calf, radius * normal)
            rolling[leg] += CONFIG.creep * (normal[2] * normal - [0.0, 0.0, 1.0])
            own = u.linear - np.cross(w, place[leg])
            speed[leg] = np.hypot(own[0], own[1])
            velocity[leg] = rolling[leg] - R @ (u.linear - np.cross(w, P_BASE_IMU))
        return (place - P_BASE_IMU) @ R.T, velocity, rolling, speed

    def step(self, reading: SensorReading, dt: float) -> None:
        """Take in a reading."""
        c, gyro, noise = CONFIG, 0.5 * (reading.gyro + self.gyro), np.zeros(27)
        self.gyro, before = reading.gyro, self.x
        w = reading.gyro - before[3]

        def moved(error: np.ndarray) -> list[np.ndarray]:
            p, v, R, b, d, f = self.plus(before, error)
            halfway = R @ pin.exp3(0.5 * dt * (gyro - b))
            a = halfway @ (reading.accelerometer - d) - [0.0, 0.0, self.model.gravity]
            return [
                *(p + dt * v + 0.5 * dt**2 * a, v + dt * a),
                *(R @ pin.exp3(dt * (gyro - b)), b, d, f),
            ]

        x = moved(np.zeros(27))
        F = self.jacobian(lambda e: self.minus(moved(e), x))
        noise[:3], noise[3:6] = 0.5 * c.acceleration * dt**2, c.acceleration * dt
        noise[6:9], noise[9:12] = c.gyro * dt, c.gyro_bias_walk * dt**0.5
        noise[12:15] = c.accelerometer_bias_walk * dt**0.5
        P = F @ self.P @ F.T + np.diag(noise**2)
        place, velocity, rolling, speed = self.legs(reading, w, x[2])
        trust = np.clip((reading.foot_forces - c.contact_force) / 20.0, 1e-3, 1.0)
        self.age = np.where(reading.foot_forces > c.contact_force, self.age, -dt)
        slip = c.touchdown_slip * np.exp(-np.maximum(self.age, 0.0) / c.touchdown_time)
        x[5] = x[5] + dt * rolling.ravel()
        verticals = c.vertical + c.vertical_share * np.hypot(*x[1][:2])
        verticals = verticals + c.landing * np.exp(-np.maximum(self.age, 0.0) / c.landing_time)
        seen = x[2]
        self.doubt = max(self.doubt - dt, 0.0)
        told: list[tuple[Callable[[list[np.ndarray]], np.ndarray], np.ndarray]] = []
        for leg in range(4):
            vertical = verticals[leg]
            level = (c.velocity / trust[leg]) ** 2 + slip[leg] ** 2
            level += (c.velocity_share * speed[leg]) ** 2
            variance = np.array([level, level, level + vertical**2])
            own = slice(3 * leg, 3 * leg + 3)
            chi = ((velocity[leg] - x[1]) ** 2 / (np.diag(P)[3:6] + variance)).sum()
            stands = trust[leg] > 1e-3
            factor = max(1.0, chi / c.slip**2) if stands else 1.0
            drift = c.foot_drift / trust[leg] + slip[leg] + c.drift_share * speed[leg]
            drift = drift + np.array([0.0, 0.0, vertical])
            P[15:, 15:][own, own] += np.diag(factor * (drift * dt) ** 2)
            s, m = place[leg], velocity[leg]
            told.append(
                (
                    lambda y, s=s, own=own: y[2] @ seen.T @ s - y[5][own] + y[0],
                    np.full(3, c.place**2),
                )
            )
            if stands:
                told.append(
                    (lambda y, m=m: (y[2] @ seen.T - ONE) @ x[1] + m - y[1], factor * variance)
                )
            if self.age[leg] < 0.0:
                pressed = self.model.foot_radius - c.compliance * reading.foot_forces[leg]
                self.met[leg] = x[0][2] + place[leg][2] - pressed
            if self.age[leg] < c.landing_time <= self.age[leg] + dt:
                z, height = slice(own.stop - 1, own.stop), np.full(1, c.height**2)
                variance = P[15 + z.start, 15 + z.start] + height[0]
                off = self.off_level(self.met[leg], variance)
                height, off = self.seen_slope(leg, x[5][own], P[z, z][0, 0], height, off)
                if off is not None:
                    ground = x[5][z] + off
                    told.append((lambda y, z=z, ground=ground: y[5][z] - ground, height))
        felt = np.linalg.norm(reading.accelerometer - x[4])
        carried = 0.5 * self.model.gravity + 0.1 * w @ w
        is_lying = felt > carried and not (trust > 1e-3).any()
        self.lying = self.lying + dt if is_lying else 0.0
        self.upset = max(self.upset - dt, 0.0)
        if self.lying >= c.lying_time:
            self.upset = 1.0
            told.append((lambda y: y[1], np.full(3, c.rest**2)))
        self.age = self.age + dt
        self._correct(x, P, told)
        self.met = self.met + self.x[0][2] - x[0][2]

    def off_level(self, met: float, variance: float) -> float | None:
        """How far the level on which a foot stands is above it, if that is known."""
        level = min(self.levels, key=lambda level: abs(level - met))
        off = level - met
        if abs(off) > CONFIG.uneven:
            self.levels = [met, *self.levels[:-1]]
            return None
        if abs(off) > CONFIG.terrace or off**2 > 9.0 * variance:
            self.doubt = CONFIG.uneven_time
        self.levels.remove(level)
        self.levels = [level - 0.2 * off if self.doubt else level, *self.levels]
        return None if self.doubt else off

    def seen_slope(
        self, leg: int, spot: np.ndarray, variance: float, height: np.ndarray, off: float | None
    ) -> tuple[np.ndarray, float | None]:
        """Variance and distance of the ground above where a foot stands, if it is in no levels."""
        end, met = leg // 2, self.met[leg]
        if self.doubt:
            plane, spread, lever = self.plane(self.prints[1 - end], spot)
            unsure, above = (0.003**2 + spread**2) * (1.0 + lever), plane[0] - met
            if lever < 1.0 and above**2 < 9.0 * (unsure + variance):
                height, off = np.full(1, unsure), float(above)
        self.prints[end] = [np.array([*spot[:2], met]), *self.prints[end][:7]]
        slopes = np.zeros(2)
        if self.doubt:
            plane, spread, _ = self.plane(self.prints[0] + self.prints[1], spot)
            slopes = plane[1:] / (1.0 + (spread / 0.02) ** 4)
        self.normals[leg] = np.array([*-slopes, 1.0]) / np.sqrt(1.0 + slopes @ slopes)
        return height, off

    @staticmethod
    def plane(prints: list[np.ndarray], spot: np.ndarray) -> tuple[np.ndarray, float, float]:
        """Height and slopes at ``spot``, the prints' deviation, and the leverage."""
        if not prints:
            return np.zeros(3), 0.0, np.inf
        off = np.array(prints) - [*spot[:2], 0.0]
        w = np.exp(-0.5 * (off[:, :2] ** 2).sum(axis=1) / 0.2**2)
        columns = np.column_stack([np.ones(len(off)), off[:, :2]])
        A = np.linalg.inv(columns.T @ np.diag(w) @ columns + np.diag([0.0, 1e-4, 1e-4]))
        plane = A @ columns.T @ (w * off[:, 2])
        left = w @ off[:, 2] ** 2 - plane @ columns.T @ (w * off[:, 2])
        return plane, float(np.sqrt(max(left, 0.0) / w.sum())), float(A[0, 0])

    def _correct(
        self,
        x: list[np.ndarray],
        P: np.ndarray,
        told: list[tuple[Callable[[list[np.ndarray]], np.ndarray], np.ndarray]],
    ) -> None:
        """Take in numbers that should be 0, with their variances."""

        def off(error: np.ndarray) -> np.ndarray:
            return np.concatenate([number(self.plus(x, error)) for number, _ in told])

        H, V = self.jacobian(off), np.diag(np.concatenate([variance for _, variance in told]))
        K = P @ H.T @ np.linalg.inv(H @ P @ H.T + V)
        learnt = np.ones(27)
        learnt[9:15] = 1.0 / (1.0 + (np.hypot(*x[1][:2]) / CONFIG.learning_speed) ** 4)
        if self.upset:
            learnt[9:15] = 0.0
        self.x = self.plus(x, -learnt * (K @ off(np.zeros(27))))
        P = P - (1.0 - np.outer(1.0 - learnt, 1.0 - learnt)) * (K @ H @ P)
        common, kept = np.eye(27), np.zeros(27)
        for axis in range(2):
            places = [axis, *range(15 + axis, 27, 3)]
            common[places, 8] = -P[axis, 8] / P[8, 8]
            kept[places] = P[axis, 8] / P[8, 8] ** 0.5
        self.P = common @ P @ common.T + np.outer(kept, kept)


@pytest.mark.parametrize("case", FORCES)
def test_the_estimate_is_that_of_the_documented_filter(case: str) -> None:
    model = RobotModel()
    given = readings(case)
    estimator, documented = (
        StateEstimator(model, CONFIG, watches=False),
        DocumentedFilter(model, given[0]),
    )
    states = [estimator.update(reading) for reading in given]
    for reading in given[1:]:
        documented.step(reading, STEP)
    p, v, R, b, *_ = documented.x
    w = given[-1].gyro - b
    found = states[-1]
    assert found.R_world_base == pytest.approx(R, abs=EXACT)
    assert found.q[:3] == pytest.approx(p - R @ P_BASE_IMU, abs=EXACT)
    assert found.v[:3] == pytest.approx(R.T @ v - np.cross(w, P_BASE_IMU), abs=EXACT)
    assert found.v[3:6] == pytest.approx(w, abs=EXACT)
    assert np.abs(v).max() > 1e2 * EXACT
    deviations = np.sqrt(np.diag(documented.P))
    off = (estimator.save()["state"].filter.P - documented.P) / np.outer(deviations, deviations)
    assert np.abs(off).max() < SAME


@pytest.mark.parametrize("case", FORCES)
def test_compiled_is_plain(case: str) -> None:
    estimator, given = StateEstimator(RobotModel(), CONFIG), readings(case)
    for reading in given[:20]:
        estimator.update(reading)
    estimator._read(given[20])
    made = np.empty(19), np.empty(18)
    kept = estimator._state, estimator._reading, STEP, estimator._numbers
    assert_plain_is_compiled(estimate, *kept, *made)
