"""Where the robot is and how fast it goes, from what a real one measures: IMU, encoders, feet.

An error-state Kalman filter after Bloesch et al., *State estimation for legged robots*, RSS (2012):
position, velocity and orientation of the IMU, the biases of its gyro and accelerometer, and the
feet's centres, in a world whose origin and heading are the base's at the start. The IMU drives it;
per foot on the ground it is corrected by

    place       f_i - p = R (p_i - r_imu)           (encoders through the leg's kinematics)
    velocity    v = w_i x (r n) - R u_i             (the same, differentiated)
    height      f_i = r above level ground          (once, when the foot has come down)

where u_i is the velocity of the foot's centre relative to the IMU. A foot is a sphere of radius r
that rolls: its centre moves with w_i x (r n), w_i being the calf's angular velocity and n the
upward normal. Taken for a fixed point, as in the papers, it would make a walking robot seem slower.
Roll and pitch follow from gravity, seen through the velocity; heading is dead reckoning. Where
feet come down beside level ground their heights are not taken in: on a slope of 15 deg that had
turned the pitch by 7 deg within 8 s.

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
minute drift by 1.7 deg, and 0.35 as it is. One that lies is told from one in flight by the gravity
that its trunk feels, beyond what the IMU of a turning one feels beside the CoM. At speed the biases
are hardly learnt (``learning_speed``), and not at all from a trunk on the ground. After a tumble,
or when what is at rest has been taken for something else, the filter begins anew.
``kernels.estimation`` and ``kernels.filtering`` are the arithmetic.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, fields
from types import MappingProxyType
from typing import Any

import numpy as np
import pinocchio as pin
from jaxtyping import Float

from go2_wbc.errors import ConfigError
from go2_wbc.lazy import without_collecting
from go2_wbc.legs import LEGS
from go2_wbc.robot.description import BASE_LINK
from go2_wbc.robot.leg_kinematics import LegGeometry, foot_places, leg_table
from go2_wbc.robot.model import RobotModel
from go2_wbc.robot.state import OdometryCovariance, RobotState
from go2_wbc.validation import require_positive

IMU_FRAME = "imu"
_START_DEVIATIONS = (0.001, 0.1, 0.01)
"""Of position [m], velocity [m/s] and feet [m] when the filter begins (own choice); the position is
the origin by definition."""
_THROWN_DEVIATIONS, _THROWN_TILT = (0.001, 2.0, 1.0), 1.0
"""The same of a robot that falls, or is thrown, and of its roll and pitch [rad]."""
_STEADY_HEADING = 1e-4
"""Deviation [rad] of the heading when the filter begins: it is 0 by definition."""


@dataclass(frozen=True, slots=True)
class SensorReading:
    """What the robot measures at one instant.

    Attributes:
        time: robot time [s].
        gyro: angular velocity [rad/s] in the base frame.
        accelerometer: specific force [m/s^2] in the base frame; +9.81 upwards at rest.
        q_joints: joint angles [rad].
        v_joints: joint velocities [rad/s].
        tau: joint torques [N m].
        foot_forces: normal force at each foot [N].
    """

    time: float
    gyro: Float[np.ndarray, "3"]
    accelerometer: Float[np.ndarray, "3"]
    q_joints: Float[np.ndarray, "12"]
    v_joints: Float[np.ndarray, "12"]
    tau: Float[np.ndarray, "12"]
    foot_forces: Float[np.ndarray, "4"]


@dataclass(frozen=True, slots=True)
class EstimatorConfig:
    """Standard deviations of what the filter is told, and when a foot counts as on the ground.

    Own tuning in simulation, from the values of MIT's published code for the Cheetah 3 on.

    Attributes:
        acceleration: of the accelerometer, per sample [m/s^2].
        foot_drift: speed of a standing foot that rolling does not explain [m/s].
        drift_share: the same, by which it grows with the foot's speed along the trunk [m/s per
            m/s]: turning feet creep so that the trunk seems to turn faster.
        settled_drift: that speed once the foot has stood for ``settled_time`` [m/s].
        settled_time: time [s] after which a foot has settled: no stride of a gait stands so long.
        place: of a foot's place by kinematics [m].
        velocity: of the velocity by one standing foot [m/s].
        velocity_share: the same, by which it grows with the foot's speed along the trunk.
        height: of the ground where a foot comes down, against level ground [m].
        uneven: distance [m] from level ground at which a foot comes down on something else. Heavy
            legs sink by 20 mm into MuJoCo's floor as they land; taken for steps, that left the
            height to feet which spring back, and it drifted by 0.1 m/s.
        uneven_time: time [s] after which the ground counts as level again, where it is then.
        contact_force: force [N] above which a foot counts as touching: five deviations of its
            noise. A foot felt in the middle of its swing is taken for a stone: the trunk of a trot
            on the level went up and down by 20 mm.
        trusted_force: force [N] from which on a foot is fully believed to stand.
        rest: of the assumption that a robot whose feet carry nothing lies still [m/s].
        lying_time: time [s] after which a robot is taken to lie that neither its feet carry nor
            falls freely.
        gyro: of the gyro, per sample [rad/s].
        gyro_bias: of its bias at the start [rad/s].
        gyro_bias_walk: by which that changes in a second [rad/s].
        accelerometer_bias: of the accelerometer's bias at the start [m/s^2].
        accelerometer_bias_walk: by which that changes in a second [m/s^2].
        learning_speed: speed of the trunk [m/s] at which half of what corrects the biases is
            believed. A foot creeps ahead as it comes down and back as it pushes off, in step with
            the trunk's bouncing: fast, that looks like a tilt, and a bias that hides it.
        tilt: of roll and pitch at the start, by the accelerometer [rad].
        slip: deviations of a standing foot's velocity above which it is taken for slipping.
        still_time: time [s] after which what reads as rest is taken for it.
        still_joints: root of the mean square of the joints' smoothed velocities at rest
            [rad/s].
        still_turning: angular velocity at rest [rad/s].
        still_force: by which the accelerometer's length differs from gravity at rest [m/s^2].
        still_velocity: of the velocity at rest [m/s].
        still_gyro: of the gyro's bias by one reading at rest, swaying included [rad/s].
        still_drift: speed of a foot at rest [m/s].
        touchdown_slip: speed of a foot's centre when it has just come down [m/s].
        touchdown_time: in which that decays by 1 / e [s].
        vertical: speed at which a standing foot is pressed flat and springs back [m/s].
        vertical_share: the same, by which it grows with the trunk's speed [m/s per m/s]: at speed
            a pitch is as good a reason for what feet spring back.
        compliance: by which a foot's sphere is pressed flat [m/N]; it rolls on its middle.
        longest_step: time [s] between two readings after which the filter begins anew.
    """

    acceleration: float = 0.2
    foot_drift: float = 0.05
    drift_share: float = 0.2
    settled_drift: float = 0.005
    settled_time: float = 0.45
    place: float = 0.002
    velocity: float = 0.05
    velocity_share: float = 0.05
    height: float = 0.02
    uneven: float = 0.03
    uneven_time: float = 2.0
    contact_force: float = 10.0
    trusted_force: float = 30.0
    rest: float = 0.3
    lying_time: float = 0.1
    gyro: float = 0.02
    gyro_bias: float = 0.02
    gyro_bias_walk: float = 1e-4
    accelerometer_bias: float = 0.05
    accelerometer_bias_walk: float = 1e-3
    learning_speed: float = 1.0
    tilt: float = 0.02
    slip: float = 3.0
    still_time: float = 0.3
    still_joints: float = 0.03
    still_turning: float = 0.12
    still_force: float = 0.6
    still_velocity: float = 0.02
    still_gyro: float = 0.05
    still_drift: float = 0.0005
    touchdown_slip: float = 1.5
    touchdown_time: float = 0.009
    vertical: float = 0.5
    vertical_share: float = 0.1
    compliance: float = 5e-5
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
        with without_collecting():
            from go2_wbc.kernels import estimation, filtering  # compiled; who needs it waits

        self._config = config or EstimatorConfig()
        pin_model = model.pin_model
        imu = IMU_FRAME if pin_model.existFrame(IMU_FRAME) else BASE_LINK
        placement = pin_model.frames[pin_model.getFrameId(imu)].placement
        self._p_base_imu = np.array(placement.translation)
        self._geometry = [LegGeometry.of(model, leg) for leg in LEGS]
        self._legs, self._radius = leg_table(model).row.reshape(4, 6), model.foot_radius
        self._gravity = model.gravity
        self._numbers = self._in_order(model)
        self._kernel = estimation
        self._biases = slice(filtering.GYRO_BIAS, filtering.FEET)
        self._time = -np.inf  # before the first reading
        self._x = np.zeros(filtering.STATE)
        self._x[9] = 1.0
        self._P = np.zeros((filtering.ERROR, filtering.ERROR))
        self._memory = np.zeros(estimation.MEMORY)

    def _in_order(self, model: RobotModel) -> Float[np.ndarray, " n"]:
        """The numbers of the filter, in the kernel's order."""
        c = self._config
        return np.array(
            [
                *(c.acceleration, c.foot_drift, c.place, c.velocity, c.height),
                *(c.contact_force, c.trusted_force, c.rest, c.gyro, c.gyro_bias_walk),
                *(c.accelerometer_bias_walk, c.slip, c.still_time, c.still_joints),
                *(c.still_turning, c.still_force, c.still_velocity, c.still_drift),
                *(model.foot_radius, model.gravity),
                *(c.touchdown_slip, c.touchdown_time, c.vertical, c.compliance, c.still_gyro),
                *(c.vertical_share, c.lying_time, c.learning_speed),
                *(c.drift_share, c.velocity_share),
                *(c.uneven, c.uneven_time, c.gyro_bias, c.accelerometer_bias),
                *(c.settled_drift, c.settled_time),
            ]
        )

    def update(self, reading: SensorReading) -> RobotState:
        """Take in a reading that is newer than the last one; returns the state at its time."""
        step = reading.time - self._time
        if not 0.0 <= step <= self._config.longest_step:
            self._begin(reading)
            step = 0.0
        row = np.concatenate(
            [
                [step],
                reading.gyro,
                reading.accelerometer,
                reading.q_joints,
                reading.v_joints,
                reading.foot_forces,
            ]
        )
        q, v = np.empty(19), np.empty(18)
        if off := self._advance(row, q, v):
            self._forget(reading, keeps_height=off == self._kernel.TUMBLED)
            row[0] = 0.0
            self._advance(row, q, v)
        self._time = reading.time
        return RobotState(
            time=reading.time,
            q=q,
            v=v,
            tau=reading.tau,
            foot_forces=reading.foot_forces,
            feet_in_contact=reading.foot_forces > self._config.contact_force,
        )

    def _advance(
        self, row: Float[np.ndarray, "35"], q: Float[np.ndarray, "19"], v: Float[np.ndarray, "18"]
    ) -> int:
        """One step of the filter, which fills q and v; returns why to begin anew, or 0."""
        kept = self._x, self._P, self._memory
        return int(
            self._kernel.estimate(*kept, row, self._legs, self._p_base_imu, self._numbers, q, v)
        )

    def covariance(self) -> OdometryCovariance:
        """How sure the last state is of the base, from the covariance of the filter's errors.

        With the IMU at r in the base frame, and the error of the orientation theta in the world:
        dp_base = dp - theta x R r, dv_base = R' (dv - theta x v) - dw x r, and dw is the bias's
        error and the gyro's noise. That place and heading go wrong together is not kept.
        """
        R, r = pin.Quaternion(self._x[6:10]).toRotationMatrix(), pin.skew(self._p_base_imu)
        one = np.eye(3)
        of_pose, of_twist = np.zeros((6, len(self._P))), np.zeros((6, len(self._P)))
        of_pose[:3, :3], of_pose[:3, 6:9], of_pose[3:, 6:9] = (
            one,
            pin.skew(R @ self._p_base_imu),
            one,
        )
        of_twist[:3, 3:6], of_twist[:3, 6:9] = R.T, R.T @ pin.skew(self._x[3:6])
        of_twist[:, 9:12] = of_gyro = -np.vstack([r, one])
        twist = of_twist @ self._P @ of_twist.T + self._config.gyro**2 * of_gyro @ of_gyro.T
        return OdometryCovariance(of_pose @ self._P @ of_pose.T, twist)

    def save(self) -> Mapping[str, Any]:
        """All that the next estimates depend on, besides the readings."""
        return MappingProxyType(
            {
                "time": self._time,
                "x": self._x.copy(),
                "P": self._P.copy(),
                "memory": self._memory.copy(),
            }
        )

    def restore(self, saved: Mapping[str, Any]) -> None:
        """Go back to what ``save`` returned."""
        self._time = saved["time"]
        self._x[:], self._P[:], self._memory[:] = saved["x"], saved["P"], saved["memory"]

    def _forget(self, reading: SensorReading, keeps_height: bool) -> None:
        """Begin anew, without biases; at the height that the IMU had, or on level ground at 0."""
        self._x[self._biases] = 0.0
        self._begin(reading, float(self._x[2]) if keeps_height else None, knows_biases=False)

    def _begin(
        self, reading: SensorReading, height: float | None = None, knows_biases: bool = True
    ) -> None:
        """At rest above the last known spot, the lowest foot on the ground; gravity says the tilt.

        Heading and biases stay what they were. ``height`` [m] of the IMU: None for level ground.
        """
        is_first, config, x = np.isinf(self._time), self._config, self._x
        R = _upright(pin.Quaternion(x[6:10]).toRotationMatrix(), reading.accelerometer - x[13:16])
        p_feet = self._feet(reading, R)
        if is_first:
            x[:3] = R @ self._p_base_imu
        above = self._radius - float(p_feet[:, 2].min())
        x[2] = above if height is None else height
        x[3:6], x[6:10] = 0.0, pin.Quaternion(R).coeffs()
        x[16:] = (x[:3] + p_feet).ravel()
        biases = np.diag(self._P)[9:15].copy()
        if is_first or not knows_biases:
            biases[:3], biases[3:] = config.gyro_bias**2, config.accelerometer_bias**2
        is_thrown = abs(np.linalg.norm(reading.accelerometer) - self._gravity) > config.still_force
        place, velocity, feet = _THROWN_DEVIATIONS if is_thrown else _START_DEVIATIONS
        tilt = _THROWN_TILT if is_thrown else config.tilt
        turning = [tilt, tilt, _STEADY_HEADING]
        deviations = np.array([*[place] * 3, *[velocity] * 3, *turning, *[0.0] * 6, *[feet] * 12])
        self._P[:] = np.diag(deviations**2)
        self._P[range(9, 15), range(9, 15)] = biases
        self._memory[:] = 0.0
        self._memory[self._kernel.LEVEL] = x[2] - above
        self._memory[5:8] = reading.gyro
        self._memory[8:20] = reading.v_joints

    def _feet(
        self, reading: SensorReading, R: Float[np.ndarray, "3 3"]
    ) -> Float[np.ndarray, "4 3"]:
        """Places of the feet's centres [m] from the IMU, along the world's axes."""
        angles = reading.q_joints.reshape(4, 1, 3)
        places = [foot_places(leg, q) for leg, q in zip(self._geometry, angles, strict=True)]
        return (np.concatenate(places) - self._p_base_imu) @ R.T


def _upright(
    R: Float[np.ndarray, "3 3"], force: Float[np.ndarray, "3"]
) -> Float[np.ndarray, "3 3"]:
    """The orientation with the heading of ``R`` in which ``force`` points up."""
    up = force / np.linalg.norm(force)
    roll = np.arctan2(up[1], up[2])
    pitch = np.arctan2(-up[0], np.hypot(up[1], up[2]))
    return pin.rpy.rpyToMatrix(roll, pitch, float(pin.rpy.matrixToRpy(R)[2]))
