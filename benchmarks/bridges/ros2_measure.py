"""Measures a running server from another process: latency, loss, speed, CPU, and a demo."""

from __future__ import annotations

import json
import math
import time
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from typing import Any

import numpy as np

from controller.bridges.ros2 import imports as ros
from controller.bridges.ros2.client import GO2ControllerNode
from controller.bridges.ros2.names import CMD_VEL, COMMAND_QUEUE, STATISTICS_SERVICE, topic
from go2_wbc.errors import BridgeError

CALLS = 300
UNKNOWN = "no_such_behaviour"
"""A command that moves nothing: what is left is the way there and back."""
SPEED = 0.3
"""Forward speed [m/s] that is commanded."""
COMMAND_PERIOD = 0.02
DRIVE_TIME = 20.0
SETTLE_TIME = 2.0
"""Time [s] at the start of the drive that does not count for the speed."""
ROS_CPU = ("ros_cpu_in_loop", "cpu_of_other_threads")
"""What of the server's statistics is processor time of the ROS side."""
CALL_LIMIT = 5.0
"""Time [s] after which a call counts as lost."""


@dataclass(frozen=True, slots=True)
class RoundTrips:
    """Times [ms] of the calls that were answered, and how many were not."""

    times: tuple[float, ...]
    lost: int

    def percentile(self, share: float) -> float:
        """The time [ms] that this share [%] of the calls did not exceed."""
        return float(np.percentile(self.times, share)) if self.times else math.nan


@dataclass(frozen=True, slots=True)
class Drive:
    """What came of a drive at 50 commands a second.

    Attributes:
        sent: commands.
        received: commands, counted by the server.
        speed: mean forward speed [m/s], in the robot's own time.
        pace: robot time per wall time; below 1 the machine is too busy for real time.
        cpu_share: processor time of the server's ROS side per wall time.
    """

    sent: int
    received: int
    speed: float
    pace: float
    cpu_share: float


class Meter:
    """A client that measures the server of one namespace.

    Attributes:
        go2: the client.
    """

    def __init__(self, namespace: str) -> None:
        """Join the graph.

        Raises:
            MissingDependency: if ROS 2 or the interfaces are not installed.
            BridgeError: if there is no server.
        """
        ros.rclpy.init(args=[], signal_handler_options=ros.SignalHandlerOptions.NO)
        self.go2 = GO2ControllerNode(namespace, node_name="go2_meter")
        self.go2.get_logger().set_level(ros.LoggingSeverity.WARN)
        self._statistics = self.go2.create_client(ros.Trigger, topic(namespace, STATISTICS_SERVICE))
        self._publisher = self.go2.create_publisher(
            ros.Twist, topic(namespace, CMD_VEL), COMMAND_QUEUE
        )
        self._spinner = ros.SingleThreadedExecutor()
        if not self._statistics.wait_for_service(CALL_LIMIT):
            self.close()
            raise BridgeError(f"no server of /{namespace} to measure")

    def close(self) -> None:
        """Leave the graph."""
        self.go2.destroy_node()
        ros.rclpy.try_shutdown()

    def round_trips(self, calls: int = CALLS) -> RoundTrips:
        """Call a behaviour that does not exist, one after the other."""
        client = self.go2._behavior_client
        times, lost = [], 0
        for _ in range(calls):
            began = time.perf_counter()
            answer = self._await(
                client.call_async(ros.RobotBehaviorCommand.Request(command=UNKNOWN))
            )
            if answer is None or answer.success:
                lost += 1
            else:
                times.append(1000.0 * (time.perf_counter() - began))
        return RoundTrips(tuple(times), lost)

    def drive(self) -> Drive:
        """Walk straight ahead, with 50 commands a second.

        Raises:
            BridgeError: if the robot does not walk or the server does not answer.
        """
        if not self.go2.walk():
            raise BridgeError(f"the robot does not walk: {self.go2.last_message}")
        before, began = self._figures(), time.monotonic()
        message = ros.Twist()
        message.linear.x = SPEED
        sent, start = 0, before
        while time.monotonic() - began < DRIVE_TIME:
            self._publisher.publish(message)
            sent += 1
            while time.monotonic() - began < sent * COMMAND_PERIOD:
                self._spin(sent * COMMAND_PERIOD - (time.monotonic() - began))
            if start is before and time.monotonic() - began > SETTLE_TIME:
                start = self._figures()
        after = self._figures()
        self.go2.stop()
        way = math.dist(after["position"][:2], start["position"][:2])
        wall_time = after["wall_time"] - before["wall_time"]
        cpu = sum(after[name] - before[name] for name in ROS_CPU)
        return Drive(
            sent,
            after["cmd_vel"]["received"] - before["cmd_vel"]["received"],
            way / (after["robot_time"] - start["robot_time"]),
            (after["robot_time"] - before["robot_time"]) / wall_time,
            cpu / wall_time,
        )

    def _figures(self) -> dict[str, Any]:
        answer = self._await(self._statistics.call_async(ros.Trigger.Request()))
        if answer is None:
            raise BridgeError("the server does not answer")
        return json.loads(answer.message)

    def _await(self, future: Any) -> Any:
        self._spinner.add_node(self.go2)
        self._spinner.spin_until_future_complete(future, timeout_sec=CALL_LIMIT)
        self._spinner.remove_node(self.go2)
        return future.result() if future.done() else None

    def _spin(self, seconds: float) -> None:
        self._spinner.add_node(self.go2)
        self._spinner.spin_once(timeout_sec=max(seconds, 0.0))
        self._spinner.remove_node(self.go2)


@contextmanager
def metering(namespace: str) -> Iterator[Meter]:
    """A meter that is closed afterwards."""
    meter = Meter(namespace)
    try:
        yield meter
    finally:
        meter.close()
