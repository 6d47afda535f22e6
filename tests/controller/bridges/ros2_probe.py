"""A probe that watches the robot of a ROS 2 server by its odometry."""

from __future__ import annotations

import math
import os
import time
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final

import numpy as np

from benchmarks.bridges.processes import wait_until
from benchmarks.bridges.ros2_processes import DISCOVERY, Probe
from controller.bridges.ros2 import ODOM, topic
from go2_wbc.errors import BridgeError
from go2_wbc.robot.state import RobotState

ODOM_QUEUE: Final = 5
"""Messages of odometry that wait for a probe: more of them would be stale on a busy machine."""


@dataclass(frozen=True, slots=True)
class Place:
    """Position [m] and heading [rad] in the world, and the robot's own time [s]."""

    xy: tuple[float, float]
    yaw: float
    time: float

    def way_from(self, start: Place) -> float:
        """Distance [m] from ``start`` on the ground."""
        return math.dist(start.xy, self.xy)

    def speed_from(self, start: Place) -> float:
        """Mean speed [m/s] on the straight way from ``start``."""
        return self.way_from(start) / (self.time - start.time)


class WatchingProbe(Probe):
    """Watches odometry all the time, whatever the others do.

    Attributes:
        largest_tilt: of the base so far [rad]; nan without odometry.
    """

    def __init__(self, namespace: str = "robot1") -> None:
        super().__init__(namespace)
        self.largest_tilt = math.nan
        self._newest: RobotState | None = None
        kind, where = self._ros.Odometry, topic(namespace, ODOM)
        self.node.create_subscription(kind, where, self._note, ODOM_QUEUE)

    def _note(self, message: Any) -> None:
        from controller.bridges.ros2.states import state_of

        self._newest = state = state_of(message)
        self.largest_tilt = float(np.fmax(self.largest_tilt, state.tilt))

    def state(self) -> RobotState:
        """The next base pose and velocity of odometry.

        Raises:
            BridgeError: if there is none.
        """
        self._newest = None
        if not wait_until(lambda: self._newest is not None, DISCOVERY) or self._newest is None:
            raise BridgeError(f"no odometry of /{self.namespace}")
        return self._newest

    def height(self) -> float:
        """Of the base [m]; see ``state``."""
        return float(self.state().q[2])

    def place(self) -> Place:
        """Where the robot is, and its own time: on a busy machine less passes than on the wall."""
        figures = self.statistics()
        x, y, _ = figures["position"]
        return Place((x, y), figures["heading"], figures["robot_time"])

    def let_pass(self, seconds: float) -> None:
        """Let this much of the robot's own time pass."""
        end = self.place().time + seconds
        while (left := end - self.place().time) > 0.0:
            time.sleep(min(left, 0.05))


def without(folder: Path, *packages: str) -> dict[str, str]:
    """The variables of a process to which ``packages`` are as if they were not installed.

    Args:
        folder: an empty one, in which hollow packages are made.
        packages: Python packages of interfaces.
    """
    for package in packages:
        (folder / package).mkdir()
        (folder / package / "__init__.py").touch()
    return {"PYTHONPATH": os.pathsep.join([str(folder), os.environ.get("PYTHONPATH", "")])}
