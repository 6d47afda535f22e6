"""What the robot measures, as messages: each topic at its own rate of robot time."""

from __future__ import annotations

import logging
import time
from array import array
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from controller.bridges.ros2 import ODOM
from controller.bridges.ros2 import imports as ros
from go2_wbc.legs import JOINT_NAMES, Leg
from go2_wbc.plant.mujoco.plant import MujocoPlant
from go2_wbc.plant.sensors import SensorErrors, SensorNoise
from go2_wbc.robot.estimator import EstimatorConfig
from go2_wbc.robot.state import RobotState

_log = logging.getLogger(__name__)

QUEUE = 10  #: Messages that are kept for a slow reader
STATE_RATE, TRANSFORM_RATE = 100.0, 50.0
"""Messages per second of robot time: of what is measured, and of /tf."""
FEET_ORDER = (Leg.FR, Leg.FL, Leg.RR, Leg.RL)  #: The order of the feet in ``RobotFootContact``
_NOISE, _ERRORS, _FILTER = SensorNoise(), SensorErrors(), EstimatorConfig()
IMU_DEVIATIONS: Mapping[str, tuple[float, float, float]] = {
    "ideal": (1e-3, 1e-3, 1e-2),
    "noisy": (_NOISE.orientation, _NOISE.gyro, _NOISE.accelerometer),
    "imu": (_FILTER.tilt, _ERRORS.gyro, _ERRORS.accelerometer),
}
"""Of the simulated IMU's orientation [rad], gyro [rad/s] and accelerometer [m/s^2], by its sensors;
not 0 with ideal ones, since many filters take 0 for unknown."""


Fill = Callable[[Any, RobotState, Any], None]  #: Writes a state and its stamp into a message


@dataclass(slots=True)
class _Stream:
    """A topic: its message, who fills that in, and the robot time [s] at which it is due."""

    publisher: Any
    message: Any
    fill: Fill
    period: float
    due: float = 0.0


class StatePublisher:
    """Publishes the state of one robot."""

    def __init__(
        self, node: Any, simulator: MujocoPlant, *, realtime: bool, sensors: str = "ideal"
    ) -> None:
        """Publish on ``node``.

        Args:
            node: of the robot.
            simulator: whose state is published.
            realtime: stamp with the wall clock, and publish no /clock.
            sensors: of the simulator, which say the variances of its IMU.
        """
        self._node, self._simulator, self._realtime = node, simulator, realtime
        self.counts: dict[str, int] = {}  #: messages published so far, by topic
        self._streams: list[_Stream] = []
        namespace = node.get_namespace().removeprefix("/")
        base, odom = f"{namespace}/base_link", f"{namespace}/odom"
        joints = ros.JointState(name=list(JOINT_NAMES))
        self._add("joint_states", joints, _fill_joints)
        self._add(
            ODOM,
            ros.Odometry(header=ros.Header(frame_id=odom), child_frame_id=base),
            self._fill_odometry,
        )
        self._add("imu", _imu(f"{namespace}/imu", sensors), self._fill_imu)
        if ros.RobotFootContact is not None:
            self._add("foot_contact", ros.RobotFootContact(), _fill_contacts)
        if ros.TFMessage is not None:
            transform = ros.TransformStamped(header=ros.Header(frame_id=odom), child_frame_id=base)
            message = ros.TFMessage(transforms=[transform])
            self._add("/tf", message, _fill_transform, TRANSFORM_RATE)
        if not realtime and node.count_publishers("/clock") > 0:
            _log.warning("another process publishes /clock: this one does not; use --realtime")
        elif not realtime:
            self._add("/clock", ros.Clock(), _fill_clock)

    def _add(self, name: str, message: Any, fill: Fill, rate: float = STATE_RATE) -> None:
        publisher = self._node.create_publisher(type(message), name, QUEUE)
        self._streams.append(_Stream(publisher, message, fill, 1.0 / rate))
        self.counts[publisher.topic_name] = 0

    def publish_due(self) -> None:
        """Publish whatever is due now."""
        state = self._simulator.read()
        due = [stream for stream in self._streams if state.time >= stream.due - 1e-9]
        if not due:
            return
        stamp = _stamp(time.time() if self._realtime else state.time)
        for stream in due:
            stream.due = max(stream.due + stream.period, state.time)
            stream.fill(stream.message, state, stamp)
            stream.publisher.publish(stream.message)
            self.counts[stream.publisher.topic_name] += 1

    def _fill_imu(self, message: Any, _state: RobotState, stamp: Any) -> None:
        sample = self._simulator.imu()
        message.header.stamp = stamp
        _set_quaternion(message.orientation, sample.quaternion.tolist())
        _set_vector(message.angular_velocity, sample.gyro.tolist())
        _set_vector(message.linear_acceleration, sample.accelerometer.tolist())

    def _fill_odometry(self, message: Any, state: RobotState, stamp: Any) -> None:
        message.header.stamp = stamp
        pose, twist = message.pose.pose, message.twist.twist
        _set_vector(pose.position, state.q[:3].tolist())
        _set_quaternion(pose.orientation, state.q[3:7].tolist())
        _set_vector(twist.linear, state.v[:3].tolist())
        _set_vector(twist.angular, state.v[3:6].tolist())
        covariance = self._simulator.odometry_covariance
        message.pose.covariance[:] = covariance.pose.ravel()
        message.twist.covariance[:] = covariance.twist.ravel()


def _imu(frame: str, sensors: str) -> Any:
    message = ros.Imu(header=ros.Header(frame_id=frame))
    turn, gyro, acceleration = IMU_DEVIATIONS[sensors]
    message.orientation_covariance[[0, 4, 8]] = turn**2
    message.angular_velocity_covariance[[0, 4, 8]] = gyro**2
    message.linear_acceleration_covariance[[0, 4, 8]] = acceleration**2
    return message


def _fill_joints(message: Any, state: RobotState, stamp: Any) -> None:
    message.header.stamp = stamp
    message.position = array("d", state.joint_positions.tobytes())
    message.velocity = array("d", state.joint_velocities.tobytes())
    message.effort = array("d", state.tau.tobytes())


def _fill_contacts(message: Any, state: RobotState, _stamp: Any) -> None:
    message.contacts = [bool(state.feet_in_contact[leg]) for leg in FEET_ORDER]


def _fill_transform(message: Any, state: RobotState, stamp: Any) -> None:
    (stamped,) = message.transforms
    stamped.header.stamp = stamp
    _set_vector(stamped.transform.translation, state.q[:3].tolist())
    _set_quaternion(stamped.transform.rotation, state.q[3:7].tolist())


def _fill_clock(message: Any, _state: RobotState, stamp: Any) -> None:
    message.clock = stamp


def state_of(message: Any) -> RobotState:
    """Base pose and velocity of a ``nav_msgs/Odometry``; joints, torques and feet are zero."""
    stamp, pose, twist = message.header.stamp, message.pose.pose, message.twist.twist
    q, v = np.zeros(19), np.zeros(18)
    q[:3] = pose.position.x, pose.position.y, pose.position.z
    at = pose.orientation
    q[3:7] = at.x, at.y, at.z, at.w
    v[:3] = twist.linear.x, twist.linear.y, twist.linear.z
    v[3:6] = twist.angular.x, twist.angular.y, twist.angular.z
    zeros = np.zeros(4)
    return RobotState(stamp.sec + 1e-9 * stamp.nanosec, q, v, np.zeros(12), zeros, zeros > 0)


def _stamp(seconds: float) -> Any:
    whole = int(seconds)
    return ros.Time(sec=whole, nanosec=int((seconds - whole) * 1e9))


def _set_vector(vector: Any, values: list[float]) -> None:
    vector.x, vector.y, vector.z = values


def _set_quaternion(quaternion: Any, values: list[float]) -> None:
    quaternion.x, quaternion.y, quaternion.z, quaternion.w = values
