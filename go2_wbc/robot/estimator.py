"""Where the robot is and how fast it goes, from what a real one measures: IMU, encoders, feet.

A linear Kalman filter in the manner of Bledt et al., *MIT Cheetah 3*, IROS (2018), sec. III-B,
which makes Bloesch et al., *State estimation for legged robots*, RSS (2012), linear by taking the
orientation from the IMU. Its state is position and velocity of the IMU and the four feet's centres,
in the world. The accelerometer drives it; per foot on the ground it is corrected by

    place       f_i - p = R (p_i - r_imu)           (encoders through the leg's kinematics)
    velocity    v = w_i x (r n) - R u_i             (the same, differentiated)
    height      f_i = r above the ground            (flat ground)

where u_i is the velocity of the foot's centre relative to the IMU. A foot is a sphere of radius r
that rolls: its centre moves with w_i x (r n), w_i being the calf's angular velocity and n the
upward normal. Taken for a fixed point, as in the papers, it would make a walking robot seem slower.

With the orientation given, the three axes of the world share no uncertainty: the filter is three
small ones of six states each, x = (p, v, f_1 .. f_4), computed side by side (Kalman, J. Basic Eng.
82, 1960). P is an axis's covariance, a the acceleration of the IMU in the world, dt the step:

    predict     p += v dt + a dt^2 / 2,   v += a dt,   f_i += w_i x (r n) dt
                P  = F P F' + Q,          F = identity but for dp/dv = dt
    correct     K  = P H' (H P H' + V)^-1,   x += K (y - H x),   P -= K H P

y are the measurements above with the variances V, H says what they would be.
"""

from __future__ import annotations

from dataclasses import dataclass, fields

import numpy as np
import pinocchio as pin
from jaxtyping import Float

from go2_wbc.errors import ConfigError
from go2_wbc.legs import FOOT_NAMES
from go2_wbc.robot.description import BASE_LINK
from go2_wbc.robot.model import RobotModel
from go2_wbc.robot.rotations import cross
from go2_wbc.robot.state import RobotState
from go2_wbc.validation import require_positive

IMU_FRAME = "imu"
_POSITION, _VELOCITY, _FEET = 0, 1, slice(2, 6)
_PLACES, _VELOCITIES, _HEIGHTS, _REST = slice(0, 4), slice(4, 8), slice(8, 12), 12
_LEAST_TRUST = 1e-3
"""Trust in a foot in the air: its variances are a million times those of a standing one."""
_UNKNOWN = 1e6
"""Variance [m^2, m^2/s^2] of what was not measured."""
_START_DEVIATIONS = np.array([0.001, 0.1, 0.01, 0.01, 0.01, 0.01])
"""Of position [m], velocity [m/s] and feet [m] when the filter begins (own choice); the position is
the origin by definition."""


@dataclass(frozen=True, slots=True)
class SensorReading:
    """What the robot measures at one instant.

    Attributes:
        time: robot time [s].
        quaternion: orientation in the world by the IMU's own filter, x y z w.
        gyro: angular velocity [rad/s] in the base frame.
        accelerometer: specific force [m/s^2] in the base frame; +9.81 upwards at rest.
        q_joints: joint angles [rad].
        v_joints: joint velocities [rad/s].
        tau: joint torques [N m].
        foot_forces: normal force at each foot [N].
    """

    time: float
    quaternion: Float[np.ndarray, "4"]
    gyro: Float[np.ndarray, "3"]
    accelerometer: Float[np.ndarray, "3"]
    q_joints: Float[np.ndarray, "12"]
    v_joints: Float[np.ndarray, "12"]
    tau: Float[np.ndarray, "12"]
    foot_forces: Float[np.ndarray, "4"]


@dataclass(frozen=True, slots=True)
class EstimatorConfig:
    """Standard deviations of what the filter is told, and when a foot counts as on the ground.

    Those of the sensors are Bledt's (MIT's published code), the rest own tuning in simulation.

    Attributes:
        acceleration: of the accelerometer with the attitude's error, per sample [m/s^2].
        foot_drift: speed of a standing foot that rolling does not explain [m/s].
        place: of a foot's place by kinematics [m].
        velocity: of the velocity by one standing foot [m/s].
        height: of the ground [m].
        contact_force: force [N] above which a foot counts as touching.
        trusted_force: force [N] from which on a foot is fully believed to stand.
        rest: of the assumption that a robot whose feet carry nothing lies still [m/s].
        longest_step: time [s] between two readings after which the filter begins anew.
    """

    acceleration: float = 0.5
    foot_drift: float = 0.05
    place: float = 0.002
    velocity: float = 0.05
    height: float = 0.005
    contact_force: float = 5.0
    trusted_force: float = 25.0
    rest: float = 0.3
    longest_step: float = 0.1

    def __post_init__(self) -> None:
        """Raise ConfigError for a number that is not positive, or forces the wrong way round."""
        require_positive(self, *(f.name for f in fields(self)))
        if self.trusted_force <= self.contact_force:
            raise ConfigError(
                f"trusted_force must be above contact_force ({self.contact_force:g} N), "
                f"got {self.trusted_force:g} N"
            )


class StateEstimator:
    """Turns sensor readings into ``RobotState``; the world's origin is where the base was first."""

    def __init__(self, model: RobotModel, config: EstimatorConfig | None = None) -> None:
        """Estimate the state of ``model``'s robot."""
        self._config = config or EstimatorConfig()
        self._radius, self._gravity = model.foot_radius, model.gravity
        self._pin_model = model.pin_model
        self._data = self._pin_model.createData()
        self._foot_frames = [self._pin_model.getFrameId(name) for name in FOOT_NAMES]
        imu = IMU_FRAME if self._pin_model.existFrame(IMU_FRAME) else BASE_LINK
        frame = self._pin_model.frames[self._pin_model.getFrameId(imu)]
        self._p_base_imu = frame.placement.translation.copy()
        self._time = -np.inf  # before the first reading
        self._x = np.zeros((6, 3))
        self._P = np.zeros((3, 6, 6))
        self._H = np.zeros((13, 6))
        self._H[_PLACES, _POSITION], self._H[_PLACES, _FEET] = -1.0, np.eye(4)  # f_i - p
        self._H[_VELOCITIES, _VELOCITY] = 1.0
        self._H[_HEIGHTS, _FEET] = np.eye(4)
        self._H[_REST, _VELOCITY] = 1.0

    def update(self, reading: SensorReading) -> RobotState:
        """Take in a reading that is newer than the last one; returns the state at its time."""
        quaternion = reading.quaternion / np.linalg.norm(reading.quaternion)
        R = pin.Quaternion(quaternion).toRotationMatrix()
        p_feet, v_feet, rolling = self._feet(reading, R)
        trust = self._trust(reading.foot_forces)
        step = reading.time - self._time
        if np.isinf(step):
            self._x[_POSITION] = R @ self._p_base_imu
        if not 0.0 <= step <= self._config.longest_step:
            self._begin(p_feet)
        else:
            acceleration = R @ reading.accelerometer  # what moves the IMU but gravity
            acceleration[2] -= self._gravity
            self._predict(step, acceleration, rolling, trust)
        self._correct(p_feet, rolling - v_feet, trust)
        self._time = reading.time
        return self._state(reading, quaternion, R)

    def _feet(
        self, reading: SensorReading, R: Float[np.ndarray, "3 3"]
    ) -> tuple[Float[np.ndarray, "4 3"], Float[np.ndarray, "4 3"], Float[np.ndarray, "4 3"]]:
        """Place and velocity of the feet's centres relative to the IMU, and of rolling ones.

        All along the world's axes; the last is how a centre moves if its foot rolls on the ground.
        """
        q = np.concatenate([[0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0], reading.q_joints])
        v = np.concatenate([np.zeros(3), reading.gyro, reading.v_joints])
        model, data = self._pin_model, self._data
        pin.forwardKinematics(model, data, q, v)
        p, u, w = np.empty((4, 3)), np.empty((4, 3)), np.empty((4, 3))
        for leg, frame in enumerate(self._foot_frames):
            p[leg] = pin.updateFramePlacement(model, data, frame).translation
            velocity = pin.getFrameVelocity(model, data, frame, pin.LOCAL_WORLD_ALIGNED)
            u[leg], w[leg] = velocity.linear, velocity.angular
        # the base stands still but for turning here, so the IMU moves with w x r
        p -= self._p_base_imu
        u -= cross(reading.gyro, self._p_base_imu)
        w_world = w @ R.T
        rolling = np.zeros((4, 3))  # w x (0, 0, r)
        rolling[:, 0], rolling[:, 1] = self._radius * w_world[:, 1], -self._radius * w_world[:, 0]
        return p @ R.T, u @ R.T, rolling

    def _trust(self, forces: Float[np.ndarray, "4"]) -> Float[np.ndarray, "4"]:
        """How far each foot is believed to stand: near 0 in the air, 1 on the ground."""
        low, high = self._config.contact_force, self._config.trusted_force
        return np.clip((forces - low) / (high - low), _LEAST_TRUST, 1.0)

    def _begin(self, p_feet: Float[np.ndarray, "4 3"]) -> None:
        """At rest above the last known spot, the lowest foot on the ground."""
        p = self._x[_POSITION].copy()
        p[2] = self._radius - p_feet[:, 2].min()
        self._x[_POSITION], self._x[_VELOCITY], self._x[_FEET] = p, 0.0, p + p_feet
        self._P[:] = np.diag(_START_DEVIATIONS**2)

    def _predict(
        self,
        step: float,
        acceleration: Float[np.ndarray, "3"],
        rolling: Float[np.ndarray, "4 3"],
        trust: Float[np.ndarray, "4"],
    ) -> None:
        x, config = self._x, self._config
        x[_POSITION] += step * x[_VELOCITY] + 0.5 * step**2 * acceleration
        x[_VELOCITY] += step * acceleration
        x[_FEET] += step * rolling
        F = np.eye(6)
        F[_POSITION, _VELOCITY] = step
        drift = config.foot_drift / trust  # a swinging foot goes where the encoders say
        speed = config.acceleration * step
        # deviations of p, v, f_i from that of a, constant over the step, and the drift
        noise = np.array([0.5 * speed * step, speed, *(drift * step)]) ** 2
        self._P = F @ self._P @ F.T + np.diag(noise)

    def _correct(
        self,
        p_feet: Float[np.ndarray, "4 3"],
        v_imu: Float[np.ndarray, "4 3"],
        trust: Float[np.ndarray, "4"],
    ) -> None:
        config, H = self._config, self._H
        measured = np.zeros((13, 3))
        measured[_PLACES], measured[_VELOCITIES] = p_feet, v_imu
        measured[_HEIGHTS, 2] = self._radius
        variance = np.empty((3, 13))
        variance[:, _PLACES] = config.place**2
        variance[:, _VELOCITIES] = (config.velocity / trust) ** 2
        variance[:, _HEIGHTS] = _UNKNOWN  # the ground says nothing of x and y
        variance[2, _HEIGHTS] = (config.height / trust) ** 2
        is_carried = trust.max() > _LEAST_TRUST
        variance[:, _REST] = _UNKNOWN if is_carried else config.rest**2
        PHt = self._P @ H.T
        S = H @ PHt
        S[:, range(13), range(13)] += variance
        gain = np.linalg.solve(S, PHt.transpose(0, 2, 1)).transpose(0, 2, 1)
        innovation = (measured - H @ self._x).T
        self._x += np.einsum("aij,aj->ia", gain, innovation)
        self._P -= gain @ PHt.transpose(0, 2, 1)
        # rounding would make it asymmetric, and then indefinite
        self._P = 0.5 * (self._P + self._P.transpose(0, 2, 1))

    def _state(
        self,
        reading: SensorReading,
        quaternion: Float[np.ndarray, "4"],
        R: Float[np.ndarray, "3 3"],
    ) -> RobotState:
        # from the IMU to the base: p - R r_imu, R' v - w x r_imu
        p_world_base = self._x[_POSITION] - R @ self._p_base_imu
        v_base = R.T @ self._x[_VELOCITY] - cross(reading.gyro, self._p_base_imu)
        return RobotState(
            time=reading.time,
            q=np.concatenate([p_world_base, quaternion, reading.q_joints]),
            v=np.concatenate([v_base, reading.gyro, reading.v_joints]),
            tau=reading.tau,
            foot_forces=reading.foot_forces,
            feet_in_contact=reading.foot_forces > self._config.contact_force,
        )
