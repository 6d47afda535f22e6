"""What the sensors of a plant give besides the state, and how noisy they are."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from typing import Any, final

import numpy as np
from jaxtyping import Float

from go2_wbc.brief import brief
from go2_wbc.compilation import Foreign, kernel, subroutine
from go2_wbc.records import Array3, Array4, Array12, packed
from go2_wbc.robot.estimator import EstimatorConfig, StateEstimator
from go2_wbc.robot.model import RobotModel
from go2_wbc.robot.state import OdometryCovariance, PartFault, RobotState, SensorReading
from go2_wbc.validation import NOT_NEGATIVE, ranged

EXACT = 1e-4
"""Standard deviation [m, rad, m/s, rad/s] that stands for the truth's 0, which many filters take
for unknown."""


@dataclass(frozen=True, slots=True)
class ImuSample:
    """One reading of the inertial measurement unit, in the IMU's frame (axes as the base's)."""

    quaternion: Float[np.ndarray, "4"]  #: orientation of the IMU in the world, x y z w
    gyro: Float[np.ndarray, "3"]  #: angular velocity [rad/s]
    accelerometer: Float[np.ndarray, "3"]
    """Specific force [m/s^2]; a robot at rest reads +9.81 upwards."""

    __repr__ = brief


@dataclass(frozen=True, slots=True)
@ranged(NOT_NEGATIVE)
class SensorNoise:
    """Standard deviations of the white noise on each quantity that a plant reports.

    The Go2 publishes no sensor data sheet. The values are the order of what published Go1/Go2
    learning code randomises over (encoder 0.01 rad, gyro 0.2 rad/s are its wide ends; here a
    fifth), and of a consumer MEMS unit sampled at 500 Hz.
    """

    position: float = 0.002  #: of the base [m], as from an estimator or motion capture
    linear_velocity: float = 0.02  #: of the base [m/s], from the same
    orientation: float = 0.005  #: base orientation, rotation vector [rad]
    gyro: float = 0.02  #: angular velocity [rad/s]
    accelerometer: float = 0.1  #: specific force [m/s^2]
    joint_position: float = 0.002  #: encoder [rad]
    joint_velocity: float = 0.05  #: encoder, differentiated [rad/s]
    foot_force: float = 2.0  #: foot sensor [N]

    def corrupt_state(self, state: RobotState, rng: np.random.Generator) -> RobotState:
        """``state`` with noise added; time and torque are known exactly."""
        q, v = state.q.copy(), state.v.copy()
        q[:3] += self.position * rng.standard_normal(3)
        q[3:7] = self._turn(q[3:7], rng)
        q[7:] += self.joint_position * rng.standard_normal(12)
        v[:3] += self.linear_velocity * rng.standard_normal(3)
        v[3:6] += self.gyro * rng.standard_normal(3)
        v[6:] += self.joint_velocity * rng.standard_normal(12)
        forces = state.foot_forces + self.foot_force * rng.standard_normal(4)
        return replace(state, q=q, v=v, foot_forces=np.maximum(forces, 0.0))

    def corrupt_imu(self, sample: ImuSample, rng: np.random.Generator) -> ImuSample:
        """``sample`` with noise added."""
        return ImuSample(
            quaternion=self._turn(sample.quaternion, rng),
            gyro=sample.gyro + self.gyro * rng.standard_normal(3),
            accelerometer=sample.accelerometer + self.accelerometer * rng.standard_normal(3),
        )

    @property
    def covariance(self) -> OdometryCovariance:
        """How sure a state with this noise is of the base: ``EXACT`` at the least."""
        parts = self.position, self.orientation, self.linear_velocity, self.gyro
        return OdometryCovariance.of_deviations(*(max(part, EXACT) for part in parts))

    def _turn(
        self, quaternion: Float[np.ndarray, "4"], rng: np.random.Generator
    ) -> Float[np.ndarray, "4"]:
        """``quaternion`` (x y z w) times a small random rotation, to first order."""
        half = 0.5 * self.orientation * rng.standard_normal(3)
        vector, scalar = quaternion[:3], quaternion[3]
        turned = np.empty(4)
        turned[:3] = vector + scalar * half + np.cross(vector, half)
        turned[3] = scalar - vector @ half
        return turned / np.linalg.norm(turned)


NONE = SensorNoise(*[0.0] * 8)  #: The truth


@dataclass(frozen=True, slots=True)
@ranged(NOT_NEGATIVE)
class SensorErrors:
    """How the sensors of ``sensors="imu"`` err: all that the controller is given then.

    Biases are drawn once per plant. The Go2 publishes no data sheet of its IMU; the values are of
    the order of a consumer MEMS unit's (such as Bosch's BMI088: gyro about 0.014 deg/s and
    accelerometer about 0.2 mg per root hertz, offsets about 1 deg/s and 20 mg), at 500 Hz, the
    noise three times that for the vibration of the legs, the accelerometer's offset a quarter after
    calibration. The encoders' resolution is that of the protocol of Unitree's GO-M8010-6 motor
    (angle 2 pi / 32768, speed 2 pi / 256 rad/s of the rotor, gear 6.33).
    """

    gyro: float = 0.012  #: white noise per sample [rad/s]
    gyro_bias: float = 0.0175  #: deviation of its bias [rad/s]
    accelerometer: float = 0.1  #: white noise per sample [m/s^2]
    accelerometer_bias: float = 0.05  #: deviation of its bias [m/s^2]
    angle_step: float = 3.0e-5  #: resolution of a joint's angle [rad]
    speed_step: float = 0.004  #: resolution of a joint's velocity [rad/s]
    speed: float = 0.02  #: white noise on it [rad/s], own choice: five steps
    force: float = 2.0  #: white noise on a foot's force [N]
    force_step: float = 1.0  #: resolution of a foot's force [N]; the robot sends whole numbers
    latency: float = 0.002
    """Age of what the controller is given [s], rounded to whole control periods; half of a round
    trip of the robot's bus would be 0.001."""


@subroutine
def in_steps(value: float, step: float) -> float:
    """The nearest multiple of ``step``; 0 leaves the value alone."""
    return step * np.rint(value / step) if step > 0.0 else value


@kernel
def read_sensors(
    errors: SensorErrors,
    bias: Float[np.ndarray, "6"],
    noise: Float[np.ndarray, "22"],
    gyro: Foreign[Array3],
    accelerometer: Foreign[Array3],
    q_joints: Foreign[Array12],
    v_joints: Foreign[Array12],
    foot_forces: Foreign[Array4],
    read: Float[np.ndarray, "34"],
) -> None:
    """Fill ``read`` with what the sensors say of these, in this order.

    ``bias`` of gyro and accelerometer; ``noise``, standard normal, of both, speeds and forces.
    """
    for k in range(3):
        read[k] = gyro[k] + bias[k] + errors.gyro * noise[k]
        read[3 + k] = accelerometer[k] + bias[3 + k] + errors.accelerometer * noise[3 + k]
    for j in range(12):
        read[6 + j] = in_steps(q_joints[j], errors.angle_step)
        read[18 + j] = in_steps(v_joints[j] + errors.speed * noise[6 + j], errors.speed_step)
    for leg in range(4):
        force = max(foot_forces[leg] + errors.force * noise[18 + leg], 0.0)
        read[30 + leg] = in_steps(force, errors.force_step)


@final
class Proprioception:
    """The state as a robot knows it: read with errors, late, and estimated from nothing else."""

    def __init__(
        self,
        errors: SensorErrors,
        model: RobotModel,
        period: float,
        rng: np.random.Generator,
        estimator: EstimatorConfig | None = None,
    ) -> None:
        """Draw the biases from ``rng``, of which every later error is drawn, too.

        ``model``: what the robot knows of itself.
        """
        self._errors, self._rng, self._config = packed(errors), rng, estimator
        self._late = round(errors.latency / period)
        self._model = model
        biases = np.repeat([errors.gyro_bias, errors.accelerometer_bias], 3)
        self._bias = biases * rng.standard_normal(6)
        self.restart()

    def restart(self) -> None:
        """Forget everything: the robot is switched on where it is."""
        self._estimator = StateEstimator(self._model, self._config)
        self._waiting: deque[SensorReading] = deque()

    def sense(
        self,
        true: RobotState,
        imu: ImuSample,
        broken: Callable[[SensorReading], SensorReading] = lambda reading: reading,
    ) -> tuple[RobotState, ImuSample]:
        """The estimated state and the IMU's reading, at the time of ``true``.

        Call it once in every control period. ``broken``: what broken sensors make of a reading.
        """
        self._waiting.append(broken(self._read(true, imu)))
        late = len(self._waiting) > self._late
        reading = replace(self._waiting.popleft() if late else self._waiting[0], time=true.time)
        state = self._estimator.update(reading)
        return state, ImuSample(state.q[3:7], reading.gyro, reading.accelerometer)

    @property
    def faults(self) -> tuple[PartFault, ...]:
        """Sensors that were found to be broken."""
        watch = self._estimator.watch
        return () if watch is None else watch.faults

    @property
    def covariance(self) -> OdometryCovariance:
        """How sure the estimate of the base is."""
        return self._estimator.covariance()

    def _read(self, true: RobotState, imu: ImuSample) -> SensorReading:
        read, noise = np.empty(34), self._rng.standard_normal(22)
        joints = true.joint_positions, true.joint_velocities
        imu_says = imu.gyro, imu.accelerometer
        read_sensors(self._errors, self._bias, noise, *imu_says, *joints, true.foot_forces, read)
        q, v = read[6:18], read[18:30]
        return SensorReading(true.time, read[:3], read[3:6], q, v, true.tau, read[30:])

    def save(self) -> Mapping[str, Any]:
        """All that the next states depend on, besides the generator."""
        return {"estimator": self._estimator.save(), "waiting": tuple(self._waiting)}

    def restore(self, saved: Mapping[str, Any]) -> None:
        """Go back to what ``save`` returned."""
        self._estimator.restore(saved["estimator"])
        self._waiting = deque(saved["waiting"])
