"""A robot's state from an odometry message."""

from __future__ import annotations

from typing import Any

import numpy as np

from go2_wbc.robot.state import RobotState


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
