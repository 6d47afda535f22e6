"""What the robot measures, as messages: each topic at its own rate of robot time."""

from __future__ import annotations

import time
from array import array
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np

from controller.bridges.ros2 import imports as ros
from controller.bridges.ros2.names import ODOM, QUEUE, Rates, topic
from go2_wbc.legs import JOINT_NAMES, Leg
from go2_wbc.plant.base import Plant
from go2_wbc.plant.mujoco.plant import MujocoPlant
from go2_wbc.robot.state import RobotState

FEET_ORDER = (Leg.FR, Leg.FL, Leg.RR, Leg.RL)
"""The order of the feet in ``RobotFootContact``."""
GYRO_VARIANCE = 1e-6
ACCELERATION_VARIANCE = 1e-4
ORIENTATION_VARIANCE = 1e-6
"""Variances of the simulated IMU [(rad/s)^2, (m/s^2)^2, rad^2]: its sensors are ideal; not 0, since
many filters take 0 for unknown."""


@dataclass(slots=True)
class _Stream:
    """One publisher, its period [s], and the robot time [s] at which it is due."""

    publish: Callable[[RobotState, Any], None]
    period: float
    due: float = 0.0


class StatePublisher:
    """Publishes the state of one robot.

    Attributes:
        counts: messages published so far, by topic.
    """

    def __init__(
        self, node: Any, namespace: str, plant: Plant, rates: Rates, *, clock: bool, realtime: bool
    ) -> None:
        """Publish on ``node``; ``clock``: also /clock; ``realtime``: stamp with the wall clock."""
        self._node, self._namespace, self._plant = node, namespace, plant
        self._realtime = realtime
        self.counts: dict[str, int] = {}
        self._streams = [
            _Stream(self._joints(), 1.0 / rates.states),
            _Stream(self._odometry(), 1.0 / rates.states),
        ]
        if isinstance(plant, MujocoPlant):
            self._streams.append(_Stream(self._imu(plant), 1.0 / rates.states))
        if ros.RobotFootContact is not None:
            self._streams.append(_Stream(self._contacts(), 1.0 / rates.contacts))
        if ros.TFMessage is not None:
            self._streams.append(_Stream(self._transform(), 1.0 / rates.transforms))
        if clock:
            self._streams.append(_Stream(self._clock(), 1.0 / rates.clock))

    def publish_due(self) -> None:
        """Publish whatever is due now."""
        state = self._plant.read()
        due = [stream for stream in self._streams if state.time >= stream.due - 1e-9]
        if not due:
            return
        stamp = _stamp(time.time() if self._realtime else state.time)
        for stream in due:
            stream.due = max(stream.due + stream.period, state.time)
            stream.publish(state, stamp)

    def _publisher(self, kind: Any, name: str) -> Callable[[Any], None]:
        publisher = self._node.create_publisher(kind, name, QUEUE)
        self.counts[name] = 0

        def publish(message: Any) -> None:
            publisher.publish(message)
            self.counts[name] += 1

        return publish

    def _joints(self) -> Callable[[RobotState, Any], None]:
        publish = self._publisher(ros.JointState, topic(self._namespace, "joint_states"))
        message = ros.JointState(name=list(JOINT_NAMES))

        def send(state: RobotState, stamp: Any) -> None:
            message.header.stamp = stamp
            message.position = array("d", state.joint_positions.tobytes())
            message.velocity = array("d", state.joint_velocities.tobytes())
            message.effort = array("d", state.tau.tobytes())
            publish(message)

        return send

    def _odometry(self) -> Callable[[RobotState, Any], None]:
        publish = self._publisher(ros.Odometry, topic(self._namespace, ODOM))
        message = ros.Odometry(child_frame_id=f"{self._namespace}/base_link")
        message.header.frame_id = f"{self._namespace}/odom"

        def send(state: RobotState, stamp: Any) -> None:
            message.header.stamp = stamp
            pose, twist = message.pose.pose, message.twist.twist
            _set_vector(pose.position, state.q[:3].tolist())
            _set_quaternion(pose.orientation, state.q[3:7].tolist())
            _set_vector(twist.linear, state.v[:3].tolist())
            _set_vector(twist.angular, state.v[3:6].tolist())
            publish(message)

        return send

    def _imu(self, plant: MujocoPlant) -> Callable[[RobotState, Any], None]:
        publish = self._publisher(ros.Imu, topic(self._namespace, "imu"))
        message = ros.Imu()
        message.header.frame_id = f"{self._namespace}/imu"
        for covariance, variance in (
            (message.orientation_covariance, ORIENTATION_VARIANCE),
            (message.angular_velocity_covariance, GYRO_VARIANCE),
            (message.linear_acceleration_covariance, ACCELERATION_VARIANCE),
        ):
            covariance[[0, 4, 8]] = variance

        def send(_state: RobotState, stamp: Any) -> None:
            sample = plant.imu()
            message.header.stamp = stamp
            _set_quaternion(message.orientation, sample.quaternion.tolist())
            _set_vector(message.angular_velocity, sample.gyro.tolist())
            _set_vector(message.linear_acceleration, sample.accelerometer.tolist())
            publish(message)

        return send

    def _contacts(self) -> Callable[[RobotState, Any], None]:
        publish = self._publisher(ros.RobotFootContact, topic(self._namespace, "foot_contact"))
        message = ros.RobotFootContact()

        def send(state: RobotState, _stamp: Any) -> None:
            touching = state.feet_in_contact
            message.contacts = [bool(touching[leg]) for leg in FEET_ORDER]
            publish(message)

        return send

    def _transform(self) -> Callable[[RobotState, Any], None]:
        publish = self._publisher(ros.TFMessage, "/tf")
        transform = ros.TransformStamped(child_frame_id=f"{self._namespace}/base_link")
        transform.header.frame_id = f"{self._namespace}/odom"
        message = ros.TFMessage(transforms=[transform])

        def send(state: RobotState, stamp: Any) -> None:
            transform.header.stamp = stamp
            _set_vector(transform.transform.translation, state.q[:3].tolist())
            _set_quaternion(transform.transform.rotation, state.q[3:7].tolist())
            publish(message)

        return send

    def _clock(self) -> Callable[[RobotState, Any], None]:
        publish = self._publisher(ros.Clock, "/clock")

        def send(_state: RobotState, stamp: Any) -> None:
            publish(ros.Clock(clock=stamp))

        return send


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
