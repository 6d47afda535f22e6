"""The controller's side of low-level control: from ``JointCommand`` to messages, and back."""

from __future__ import annotations

import numpy as np
from jaxtyping import Shaped

from controller.bridges.unitree import layout
from controller.bridges.unitree.layout import (
    FEET_FROM_UNITREE,
    JOINTS_FROM_UNITREE,
    JOINTS_TO_UNITREE,
    MOTORS,
    seal,
)
from go2_wbc.robot.estimator import SensorReading
from go2_wbc.robot.state import JointCommand


def low_cmd_message(command: JointCommand) -> Shaped[np.ndarray, "1"]:
    """``rt/lowcmd`` that asks for ``command``; motors that do not exist stay switched off."""
    message = layout.new_message(layout.LOW_CMD)
    message["head"], message["level_flag"] = layout.HEAD, layout.LOW_LEVEL
    motors = message["motor_cmd"][0, :MOTORS]
    motors["mode"] = layout.SERVO
    motors["q"], motors["dq"] = command.q_des[JOINTS_TO_UNITREE], command.v_des[JOINTS_TO_UNITREE]
    motors["kp"], motors["kd"] = command.kp[JOINTS_TO_UNITREE], command.kd[JOINTS_TO_UNITREE]
    motors["tau"] = command.tau[JOINTS_TO_UNITREE]
    seal(message)
    return message


def sensor_reading(message: Shaped[np.ndarray, "1"]) -> SensorReading:
    """What a ``rt/lowstate`` message says, in our order of legs and joints."""
    motors = message["motor_state"][0, :MOTORS][JOINTS_FROM_UNITREE]
    imu = message["imu_state"][0]
    return SensorReading(
        time=0.001 * float(message["tick"][0]),
        quaternion=imu["quaternion"].astype(float)[[1, 2, 3, 0]],
        gyro=imu["gyroscope"].astype(float),
        accelerometer=imu["accelerometer"].astype(float),
        q_joints=motors["q"].astype(float),
        v_joints=motors["dq"].astype(float),
        tau=motors["tau_est"].astype(float),
        foot_forces=message["foot_force"][0].astype(float)[FEET_FROM_UNITREE],
    )
