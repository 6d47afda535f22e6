"""Where the robot is and how fast it goes, from what a real one measures: IMU, encoders, feet.

An error-state Kalman filter after Bloesch et al., *State estimation for legged robots*, RSS (2012):
position, velocity and orientation of the IMU, the biases of its gyro and accelerometer, and the
feet's centres, in a world whose origin and heading are the base's at the start (``state_filter``:
state, error, F and Q). The IMU drives it; per foot on the ground it is corrected by
(``foot_odometry``: H and R)

    place       f_i - p = R (p_i - r_imu)           (encoders through the leg's kinematics)
    velocity    v = w_i x (r n) - R u_i             (the same, differentiated)
    height      f_i = r above ground that is known  (once, when the foot has come down)

and at rest (``rest_detection``) by

    rest        v = 0, and if it lies gyro = b_g    R = still_velocity^2, still_gyro^2
    lying       v = 0                               R = rest^2

where u_i is the velocity of the foot's centre relative to the IMU. A foot is a sphere of radius r
that rolls: its centre moves with w_i x (r n), w_i being the calf's angular velocity and n the
upward normal. Taken for a fixed point, as in the papers, it would make a walking robot seem slower.
Roll and pitch follow from gravity, seen through the velocity; heading is dead reckoning. Levels are
those of the steps met last. Where feet come down between them, n and the height are those of a
plane through the last prints: levels had turned the pitch by 7 deg within 8 s on 15 deg, and the
upright n put the height 13 mm off per second on 20 deg.

An error of the heading moves all places by the way walked since. Feet that stand tell of the
heading, and by that lever had moved base and feet together by 6 cm/s: a robot that was to stand on
a slope followed until it stood beside its feet. So the heading's error turns the world about the
robot (``turn_world_about_robot``; robot-centred filters do it by their choice of the state: Bloesch
et al., IROS 2015, *Robust visual inertial odometry using a direct EKF-based approach*).

A foot whose velocity is not that of a standing one, by what the filter expects, counts less
(``slip``). One that has stood for longer than in any stride hardly drifts: feet that stay tell of
the heading, and of the gyro's bias while the trunk moves above them.

A robot whose joints and IMU read rest for a while has no velocity, and if it lies its gyro reads
its bias: a zero-velocity update (Foxlin, IEEE Computer Graphics and Applications 25(6), 2005). On
its feet it may turn slowly and read rest: the bias taken from that let the heading of a dance of a
minute drift by 1.7 deg, and 0.35 as it is. At speed the biases are hardly learnt
(``learning_speed``), and not at all from a trunk on the ground. After a tumble, or when what is at
rest has been taken for something else, the filter begins anew.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
import pinocchio as pin

from go2_wbc.algebra.linear import cross, triple
from go2_wbc.compilation import kernel, subroutine
from go2_wbc.legs import LEGS
from go2_wbc.records import Array3, Array3x3, Array4x3, Array18, Array19, Record, packed
from go2_wbc.robot.estimator_config import EstimatorConfig
from go2_wbc.robot.foot_odometry import Foot, Level, follow_foot, see_foot, see_ground, take_in_leg
from go2_wbc.robot.footprints import FAR
from go2_wbc.robot.leg_kinematics import LegGeometry, Legs, foot_places, leg_table
from go2_wbc.robot.model import RobotModel
from go2_wbc.robot.rest_detection import (
    TUMBLED,
    Rest,
    begin_anew,
    is_at_rest,
    is_upset,
    lies,
    take_in_rest,
)
from go2_wbc.robot.sensor_watch import SensorWatch
from go2_wbc.robot.speed_noise import noise_of_gyro
from go2_wbc.robot.state import OdometryCovariance, RobotState, SensorReading
from go2_wbc.robot.state_filter import (
    ERROR,
    FEET,
    FORCE_BIAS,
    GYRO_BIAS,
    THETA,
    VELOCITY,
    Estimate,
    EstimateError,
    Filter,
    correct,
    learn_in_part,
    predict,
    process_noise,
    rotation_of_estimate,
    take_in_one,
    turn_world_about_robot,
)

_TAKEN = ("gyro", "accelerometer", "q_joints", "v_joints", "foot_forces")
"""What of a reading the filter takes."""
_START_DEVIATIONS = (0.001, 0.1, 0.01)
"""Of position [m], velocity [m/s] and feet [m] when the filter begins (own choice); the position is
the origin by definition."""
_THROWN_DEVIATIONS, _THROWN_TILT = (0.001, 2.0, 1.0), 1.0
"""The same of a robot that falls, or is thrown, and of its roll and pitch [rad]."""
_AFTER_GYRO = ((THETA, 2, 0.05), (VELOCITY, 3, 0.2))
_AFTER_FORCE = ((THETA, 2, 0.05), (VELOCITY, 3, 0.2), (FORCE_BIAS, 3, 0.2))
"""Of what, and by which deviations, the filter is unsure once the gyro or the accelerometer has
erred for a while: roll and pitch [rad], the velocity [m/s], the accelerometer's bias [m/s^2]."""
_STEADY_HEADING = 1e-4
"""Deviation [rad] of the heading when the filter begins: it is 0 by definition."""


@dataclass(frozen=True, slots=True)
class EstimatorNumbers:
    """What a step of the filter is computed with."""

    config: EstimatorConfig  #: of the estimator
    legs: Legs  #: their lengths
    p_base_imu: Array3  #: place of the IMU in the base frame [m]
    foot_radius: float  #: [m]
    gravity: float  #: [m/s^2]


class EstimatorState(Record):
    """What is kept from tick to tick."""

    filter: Filter  #: the estimate, and how sure it is
    gyro: Array3  #: the last reading [rad/s]
    gyro_noise: float  #: its noise, if that is more than usual [rad/s]
    rest: Rest  #: whether the robot rests, lies or has tumbled
    level: Level  #: the ground
    feet: tuple[Foot, Foot, Foot, Foot]  #: what the legs measure


@subroutine
def learning(x: Estimate, speed: float) -> float:
    """Share of their corrections that the biases take: 1 at rest, half at ``speed``."""
    ratio = (x.v[0] * x.v[0] + x.v[1] * x.v[1]) / (speed * speed)
    return 1.0 / (1.0 + ratio * ratio)


@subroutine
def report(
    x: Estimate,
    reading: SensorReading,
    w: Array3,
    p_imu: Array3,
    R: Array3x3,
    q: Array19,
    v: Array18,
) -> None:
    """Fill q (19,) and v (18,) of a ``RobotState`` from the motion of the IMU."""
    rotation_of_estimate(x, R)
    turning = cross(triple(w), triple(p_imu))
    for i in range(3):
        q[i], v[i], v[3 + i] = x.p[i], -turning[i], w[i]
        for k in range(3):
            q[i] -= R[i, k] * p_imu[k]
            v[i] += R[k, i] * x.v[k]
    q[3:7] = x.quaternion
    q[7:], v[6:] = reading.q_joints, reading.v_joints


@subroutine
def follow_feet(
    s: EstimatorState,
    reading: SensorReading,
    dt: float,
    c: EstimatorNumbers,
    w: Array3,
    R: Array3x3,
    rests: bool,
) -> bool:
    """Let the legs measure, and move the feet on; returns whether some foot stands."""
    f, told = s.filter, c.config
    speed = np.sqrt(f.x.v[0] * f.x.v[0] + f.x.v[1] * f.x.v[1])
    vertical, is_carried = told.vertical + told.vertical_share * speed, False
    for leg in range(4):
        foot, force = s.feet[leg], reading.foot_forces[leg]
        joints = slice(3 * leg, 3 * leg + 3)
        pressed = c.foot_radius - 0.5 * told.compliance * force
        q, u = reading.q_joints[joints], reading.v_joints[joints]
        creep = told.creep if foot.age <= told.settled_time else 0.0
        see_foot(foot, c.legs.geometry[leg], q, u, c.p_base_imu, w, pressed, creep, R)
        age = follow_foot(f, foot, leg, force, dt, vertical, rests, told)
        see_ground(f, foot, leg, force, age, c.foot_radius, s.level, told)
        if foot.carries:
            is_carried = True
    return is_carried


@kernel
def estimate(
    s: EstimatorState,
    reading: SensorReading,
    dt: float,
    c: EstimatorNumbers,
    q: Array19,
    v: Array18,
) -> int:
    """Take in a reading, ``dt`` seconds after the last one, and fill the robot's state.

    Returns whether the estimate has to begin anew, and why; see ``begin_anew``.
    """
    f, told, gravity = s.filter, c.config, c.gravity
    x, P = f.x, f.P
    w, mean, R, noise = np.empty(3), np.empty(3), np.empty((3, 3)), np.empty(ERROR)
    f.error[:] = 0.0
    for k in range(3):
        w[k] = reading.gyro[k] - x.gyro_bias[k]
        mean[k] = 0.5 * (reading.gyro[k] + s.gyro[k]) - x.gyro_bias[k]
        s.gyro[k] = reading.gyro[k]
    process_noise(told, dt, noise)
    if s.gyro_noise > told.gyro:
        noise[THETA : THETA + 3] = (s.gyro_noise * dt) ** 2
    rests = is_at_rest(x, s.rest, reading, dt, gravity, told)
    predict(f, dt, mean, reading.accelerometer, gravity, R, noise)
    rotation_of_estimate(x, R)
    biases = slice(GYRO_BIAS, FEET)
    before, share_learnt = P[biases, biases].copy(), learning(x, told.learning_speed)
    s.level.doubt_time = max(s.level.doubt_time - dt, 0.0)
    is_carried = follow_feet(s, reading, dt, c, w, R, rests)
    for leg in range(4):
        take_in_leg(f, s.feet[leg], leg, told)
    is_lying = lies(x, s.rest, reading, dt, is_carried, gravity, told)
    if is_upset(s.rest, dt, is_lying, R) and not rests:
        share_learnt = 0.0
    if rests:
        take_in_rest(f, reading, is_carried, told)
    elif is_lying:
        for k in range(3):
            take_in_one(f, VELOCITY + k, -x.v[k], told.rest**2)
    learn_in_part(f, before, share_learnt)
    turn_world_about_robot(P)
    correct(f)
    for leg in range(4):
        s.feet[leg].met += f.error[2]
    for k in range(3):
        w[k] = reading.gyro[k] - x.gyro_bias[k]
    report(x, reading, w, c.p_base_imu, R, q, v)
    return begin_anew(x, s.rest, reading, dt, R, gravity, told)


class StateEstimator:
    """Turns sensor readings into ``RobotState``; the world's origin is where the base was first.

    Attributes:
        watch: what puts readings right that contradict the others, and names the broken part;
            None if nobody watches.
    """

    def __init__(
        self, model: RobotModel, config: EstimatorConfig | None = None, *, watches: bool = True
    ) -> None:
        """Estimate the state of ``model``'s robot, and watch its sensors unless told not to."""
        self._config = config or EstimatorConfig()
        self._p_base_imu = model.p_base_imu
        self._geometry = [LegGeometry.of(model, leg) for leg in LEGS]
        sizes = self._p_base_imu, model.foot_radius, model.gravity
        self._numbers = packed(EstimatorNumbers(self._config, leg_table(model), *sizes))
        self._time = -np.inf  # before the first reading
        zeros = np.zeros(12)
        reading = SensorReading(0.0, zeros[:3], zeros[:3], zeros, zeros, zeros, zeros[:4])
        self._reading, self._state = packed(reading), EstimatorState()
        self._taken = [getattr(self._reading, name) for name in _TAKEN]
        self._x, self._P = self._state.filter.x, self._state.filter.P
        self._x.quaternion[3] = 1.0
        self.watch = SensorWatch(model) if watches else None

    def update(self, reading: SensorReading) -> RobotState:
        """Take in a reading that is newer than the last one; returns the state at its time."""
        if self.watch is not None:
            reading = self.watch.checked(reading, self._x.quaternion)
            self._state.gyro_noise = noise_of_gyro(self.watch.speed_noise)
            if (turn := self.watch.misturned) is not None:
                self._turn_back(turn)
        step = reading.time - self._time
        if not 0.0 <= step <= self._config.longest_step:
            self._begin(reading)
            step = 0.0
        self._read(reading)
        q, v = np.empty(19), np.empty(18)
        if off := estimate(self._state, self._reading, step, self._numbers, q, v):
            self._forget(reading, keeps_height=off == TUMBLED)
            estimate(self._state, self._reading, 0.0, self._numbers, q, v)
        self._time = reading.time
        return RobotState(
            time=reading.time,
            q=q,
            v=v,
            tau=reading.tau,
            foot_forces=reading.foot_forces,
            feet_in_contact=reading.foot_forces > self._config.contact_force,
        )

    def _turn_back(self, turn: Array3) -> None:
        """Take back a turn [rad] in the base frame that was none, and doubt tilt and velocity.

        Also what of the accelerometer's bias has hidden it: left there, it would turn it back.
        """
        R = pin.Quaternion(self._x.quaternion).toRotationMatrix() @ pin.exp3(-turn)
        self._x.quaternion[:] = pin.Quaternion(R).coeffs()
        if turn.any():
            usual = self._config.accelerometer_bias
            self._x.force_bias[:] = self._x.force_bias.clip(-usual, usual)
        for first, count, deviation in _AFTER_GYRO if turn.any() else _AFTER_FORCE:
            doubted = range(first, first + count)
            self._P[doubted, doubted] += deviation**2

    def _read(self, reading: SensorReading) -> None:
        for taken, name in zip(self._taken, _TAKEN, strict=True):
            taken[:] = getattr(reading, name)

    def covariance(self) -> OdometryCovariance:
        """How sure the last state is of the base, from the covariance of the filter's errors.

        With the IMU at r in the base frame, and the error of the orientation theta in the world:
        dp_base = dp - theta x R r, dv_base = R' (dv - theta x v) - dw x r, and dw is the bias's
        error and the gyro's noise. That place and heading go wrong together is not kept.
        """
        x, P, r = self._x, self._P, self._p_base_imu
        R, one = pin.Quaternion(x.quaternion).toRotationMatrix(), np.eye(3)
        of_pose, of_twist = np.zeros((6, ERROR)), np.zeros((6, ERROR))
        velocity, theta, gyro = (slice(n, n + 3) for n in (VELOCITY, THETA, GYRO_BIAS))
        of_pose[:3, :3], of_pose[:3, theta], of_pose[3:, theta] = one, pin.skew(R @ r), one
        of_twist[:3, velocity], of_twist[:3, theta] = R.T, R.T @ pin.skew(x.v)
        of_twist[:, gyro] = of_gyro = -np.vstack([pin.skew(r), one])
        twist = of_twist @ P @ of_twist.T + self._config.gyro**2 * of_gyro @ of_gyro.T
        return OdometryCovariance(of_pose @ P @ of_pose.T, twist)

    def save(self) -> Mapping[str, Any]:
        """All that the next estimates depend on, besides the readings."""
        return {
            "time": self._time,
            "state": EstimatorState.of(self._state.row.copy()),
            "watch": None if self.watch is None else self.watch.save(),
        }

    def restore(self, saved: Mapping[str, Any]) -> None:
        """Go back to what ``save`` returned."""
        self._time = saved["time"]
        if self.watch is not None and saved["watch"] is not None:
            self.watch.restore(saved["watch"])
        self._state.row[:] = saved["state"].row

    def _forget(self, reading: SensorReading, keeps_height: bool) -> None:
        """Begin anew, without biases; at the height that the IMU had, or on level ground at 0."""
        self._x.gyro_bias[:], self._x.force_bias[:] = 0.0, 0.0
        self._begin(reading, float(self._x.p[2]) if keeps_height else None, knows_biases=False)

    def _begin(
        self, reading: SensorReading, height: float | None = None, knows_biases: bool = True
    ) -> None:
        """At rest above the last known spot, the lowest foot on the ground; gravity says the tilt.

        Heading and biases stay what they were. ``height`` [m] of the IMU: None for level ground.
        """
        is_first, config, x, P = np.isinf(self._time), self._config, self._x, self._P
        R = pin.Quaternion(x.quaternion).toRotationMatrix()
        R = _upright(R, reading.accelerometer - x.force_bias)
        p_feet = self._feet(reading, R)
        if is_first:
            x.p[:] = R @ self._p_base_imu
        above = self._numbers.foot_radius - float(p_feet[:, 2].min())
        x.p[2] = above if height is None else height
        x.v[:], x.quaternion[:] = 0.0, pin.Quaternion(R).coeffs()
        x.p_feet[:] = x.p + p_feet
        biases = slice(GYRO_BIAS, FEET)
        known = np.diag(P)[biases].copy()
        if is_first or not knows_biases:
            known[:3], known[3:] = config.gyro_bias**2, config.accelerometer_bias**2
        force = np.linalg.norm(reading.accelerometer)
        is_thrown = abs(force - self._numbers.gravity) > config.still_force
        place, velocity, feet = _THROWN_DEVIATIONS if is_thrown else _START_DEVIATIONS
        tilt = _THROWN_TILT if is_thrown else config.tilt
        deviations = EstimateError(theta=[tilt, tilt, _STEADY_HEADING])
        deviations.p[:], deviations.v[:], deviations.p_feet[:] = place, velocity, feet
        variances = deviations.row**2
        variances[biases] = known
        P[:] = np.diag(variances)
        s = self._state
        s.rest.row[:], s.level.row[:] = 0.0, 0.0
        s.level.heights[:], s.level.prints[:] = x.p[2] - above, FAR
        s.gyro[:], s.rest.joint_speeds[:] = reading.gyro, reading.v_joints
        for foot in s.feet:
            foot.age, foot.normal[:] = 0.0, (0.0, 0.0, 1.0)

    def _feet(self, reading: SensorReading, R: Array3x3) -> Array4x3:
        """Places of the feet's centres [m] from the IMU, along the world's axes."""
        angles = reading.q_joints.reshape(4, 1, 3)
        places = [foot_places(leg, q) for leg, q in zip(self._geometry, angles, strict=True)]
        return (np.concatenate(places) - self._p_base_imu) @ R.T


def _upright(R: Array3x3, force: Array3) -> Array3x3:
    """The orientation with the heading of ``R`` in which ``force`` points up."""
    up = force / np.linalg.norm(force)
    roll = np.arctan2(up[1], up[2])
    pitch = np.arctan2(-up[0], np.hypot(up[1], up[2]))
    return pin.rpy.rpyToMatrix(roll, pitch, float(pin.rpy.matrixToRpy(R)[2]))
