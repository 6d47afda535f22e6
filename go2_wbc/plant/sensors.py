"""What the sensors of a plant give besides the state, and how noisy they are."""

from __future__ import annotations

from dataclasses import dataclass, fields, replace

import numpy as np
from jaxtyping import Float

from go2_wbc.robot.state import RobotState
from go2_wbc.validation import require_not_negative


@dataclass(frozen=True, slots=True)
class ImuSample:
    """One reading of the inertial measurement unit, in the IMU's frame (axes as the base's).

    Attributes:
        quaternion: orientation of the IMU in the world, x y z w.
        gyro: angular velocity [rad/s].
        accelerometer: specific force [m/s^2]; a robot at rest reads +9.81 upwards.
    """

    quaternion: Float[np.ndarray, "4"]
    gyro: Float[np.ndarray, "3"]
    accelerometer: Float[np.ndarray, "3"]


@dataclass(frozen=True, slots=True)
class SensorNoise:
    """Standard deviations of the white noise on each quantity that a plant reports.

    The Go2 publishes no sensor data sheet. The values are the order of what published Go1/Go2
    learning code randomises over (encoder 0.01 rad, gyro 0.2 rad/s are its wide ends; here a
    fifth), and of a consumer MEMS unit sampled at 500 Hz.

    Attributes:
        position: base position [m], as from an estimator or motion capture.
        linear_velocity: base linear velocity [m/s].
        orientation: base orientation, rotation vector [rad].
        gyro: angular velocity [rad/s].
        accelerometer: specific force [m/s^2].
        joint_position: encoder [rad].
        joint_velocity: encoder, differentiated [rad/s].
        foot_force: foot sensor [N].
    """

    position: float = 0.002
    linear_velocity: float = 0.02
    orientation: float = 0.005
    gyro: float = 0.02
    accelerometer: float = 0.1
    joint_position: float = 0.002
    joint_velocity: float = 0.05
    foot_force: float = 2.0

    def __post_init__(self) -> None:
        """Raise ConfigError for a negative deviation."""
        require_not_negative(self, *(f.name for f in fields(self)))

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
