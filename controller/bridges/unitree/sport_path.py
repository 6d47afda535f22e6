"""``TrajectoryFollow``: a path in time, walked by velocity commands closed on the odometry."""

from __future__ import annotations

import math
from typing import Final, final

import numpy as np
from jaxtyping import Float

from controller.navigation import APPROACH
from go2_wbc.planning.command import VelocityCommand
from go2_wbc.robot.rotations import wrap_angle
from go2_wbc.robot.state import RobotState

ARRIVAL_TIME: Final = 2.0
"""Time [s] after its last point that a robot gets to reach it: own choice."""
NEAR_PLACE, NEAR_ANGLE = 0.02, math.radians(1.5)
"""Distance [m] and angle [rad] from the last point that count as there: those of a goal."""


@final
class SportPath:
    """Points that the robot passes at their times.

    As in Unitree's own example (unitree_ros2, ``example/src/src/sport_mode_ctrl.cpp``) places and
    velocities are given in the frame of ``rt/sportmodestate``, and whoever wants to go on sends a
    new path before the old one ends. Its time begins when the robot is ready to walk.
    """

    def __init__(self, points: Float[np.ndarray, "n 7"]) -> None:
        """``points``: time [s], x, y [m], yaw [rad], vx, vy [m/s], vyaw [rad/s] of each."""
        self._times, self._places, self._rates = points[:, 0], points[:, 1:4].copy(), points[:, 4:]
        self._places[:, 2] = np.unwrap(self._places[:, 2])
        self._start: float | None = None

    def command(self, state: RobotState) -> VelocityCommand | None:
        """The velocity, in the robot's frame, that leads along the path; None at its end."""
        if self._start is None:
            self._start = state.time
        t, end = state.time - self._start, float(self._times[-1])
        x, y, yaw = (float(np.interp(t, self._times, column)) for column in self._places.T)
        vx, vy, vyaw = (float(np.interp(t, self._times, column)) for column in self._rates.T)
        if not self._times[0] <= t < end:
            vx = vy = vyaw = 0.0  # it rests where the path begins and ends
        dx, dy = x - float(state.q[0]), y - float(state.q[1])
        turn = wrap_angle(yaw - state.yaw)
        is_there = math.hypot(dx, dy) < NEAR_PLACE and abs(turn) < NEAR_ANGLE
        if t >= end and (is_there or t > end + ARRIVAL_TIME):
            return None
        vx, vy = vx + APPROACH * dx, vy + APPROACH * dy
        c, s = math.cos(state.yaw), math.sin(state.yaw)
        return VelocityCommand(c * vx + s * vy, -s * vx + c * vy, vyaw + APPROACH * turn)
