"""Servers of ROS 2 as processes on the loopback, and a probe that talks to them.

Importing this module needs no ROS; what it offers does.
"""

from __future__ import annotations

import json
import os
import threading
import time
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from typing import TYPE_CHECKING, Any, Final

from controller.bridges.ros2 import (
    BEHAVIOR_SERVICE,
    CMD_VEL,
    COMMAND_PERIOD,
    STATISTICS_SERVICE,
    topic,
)
from go2_wbc.errors import BridgeError
from tests.controller.bridges.processes import PROGRAM, Process

if TYPE_CHECKING:
    from controller.bridges.ros2 import GO2ControllerNode

DISCOVERY: Final = 20.0
"""Time [s] in which processes must find each other; half a second on an idle machine."""
ANSWER: Final = 60.0  #: Time [s] in which a call must be answered; four on an idle machine


@contextmanager
def joined() -> Iterator[None]:
    """ROS in this process and its children, on the loopback unless a range was chosen."""
    os.environ.setdefault("ROS_AUTOMATIC_DISCOVERY_RANGE", "LOCALHOST")
    from controller.bridges.ros2 import imports as ros

    ros.rclpy.init(args=[], signal_handler_options=ros.SignalHandlerOptions.NO)
    try:
        yield
    finally:
        ros.rclpy.try_shutdown()


def serving(
    *options: str,
    namespace: str,
    realtime: bool = True,
    environment: Mapping[str, str] | None = None,
    says: str = "serving /",
) -> Process:
    """A ``go2-wbc ros2``; the ``with`` block begins when it serves and ends it politely.

    Args:
        options: further ones.
        namespace: of its topics and services.
        realtime: at the pace of the wall clock. A server that runs freely gets no real-time
            priority, since it would take a whole core from everybody else.
        environment: variables beside those of this process.
        says: what it says when the block begins; empty does not wait.
    """
    command = [*PROGRAM, "ros2", "--namespace", namespace, *options]
    return Process(
        [*command, "--realtime"] if realtime else command,
        {**os.environ, "PYTHONUNBUFFERED": "1", **(environment or {})},
        says=says,
        has_priority=realtime,
        is_stopped=True,
    )


class Probe:
    """A node of plain rclpy, with nothing of the client's, which spins in a thread of its own.

    Attributes:
        node: to add subscriptions and clients to.
        namespace: of the robot.
    """

    def __init__(self, namespace: str = "robot1") -> None:
        """Join the graph; ``rclpy.init()`` must have been called."""
        from controller.bridges.ros2 import imports as ros

        self._ros, self.namespace = ros, namespace
        self.node = ros.Node(
            f"probe_{namespace}", start_parameter_services=False, enable_rosout=False
        )
        self._clients: dict[str, Any] = {}
        self._publisher = self.node.create_publisher(ros.Twist, topic(namespace, CMD_VEL), 10)
        self._executor = ros.SingleThreadedExecutor()
        self._executor.add_node(self.node)
        self._is_closing = threading.Event()
        self._thread = threading.Thread(target=self._spin, name="probe", daemon=True)
        self._thread.start()

    def _spin(self) -> None:
        while not self._is_closing.is_set():
            self._executor.spin_once(timeout_sec=0.1)

    # --- calls ----------------------------------------------------------------------------

    def send(self, command: str) -> Any:
        """The future of a behaviour.

        Raises:
            BridgeError: if there is no server.
        """
        kind = self._ros.RobotBehaviorCommand
        return self._called(kind, BEHAVIOR_SERVICE, kind.Request(command=command))

    def result(self, future: Any, limit: float = ANSWER) -> Any:
        """What ``future`` comes to.

        Raises:
            BridgeError: if it does not within ``limit`` seconds.
        """
        arrived = threading.Event()
        future.add_done_callback(lambda _future: arrived.set())
        if not arrived.wait(limit):
            raise BridgeError(f"/{self.namespace} has not answered within {limit:g} s")
        return future.result()

    def call(self, command: str) -> Any:
        """The answer to a behaviour; see ``send`` and ``result``."""
        return self.result(self.send(command))

    def trigger(self, name: str) -> Any:
        """The answer of one of the ``std_srvs/Trigger`` services; see ``send`` and ``result``."""
        kind = self._ros.Trigger
        return self.result(self._called(kind, name, kind.Request()))

    def _called(self, kind: Any, name: str, request: Any) -> Any:
        if name not in self._clients:
            self._clients[name] = self.node.create_client(kind, topic(self.namespace, name))
        client = self._clients[name]
        if not client.wait_for_service(DISCOVERY):
            raise BridgeError(f"nobody offers {client.srv_name}")
        return client.call_async(request)

    def statistics(self) -> dict[str, Any]:
        """What the server counts and measures; see ``send`` and ``result``."""
        return json.loads(self.trigger(STATISTICS_SERVICE).message)

    # --- velocities -----------------------------------------------------------------------

    def move(self, x: float, turn: float = 0.0, *, y: float = 0.0) -> None:
        """Publish one velocity command: x, y [m/s], turn [rad/s]."""
        message = self._ros.Twist()
        message.linear.x, message.linear.y, message.angular.z = x, y, turn
        self._publisher.publish(message)

    def drive(self, seconds: float, x: float, turn: float = 0.0, *, y: float = 0.0) -> int:
        """Command at 50 Hz for so long on the wall clock; returns how many commands were sent."""
        count, began = round(seconds / COMMAND_PERIOD), time.monotonic()
        for sent in range(count):
            self.move(x, turn, y=y)
            time.sleep(max(began + (sent + 1) * COMMAND_PERIOD - time.monotonic(), 0.0))
        return count

    def close(self) -> None:
        """Leave the graph."""
        self._is_closing.set()
        self._thread.join(5.0)
        self._executor.shutdown()
        self.node.destroy_node()


@contextmanager
def quiet_client(namespace: str) -> Iterator[GO2ControllerNode]:
    """A client in this process; its complaints are not shown."""
    from controller.bridges.ros2 import imports as ros
    from controller.bridges.ros2.client import GO2ControllerNode

    client = GO2ControllerNode(namespace, node_name=f"client_of_{namespace}")
    client.get_logger().set_level(ros.LoggingSeverity.FATAL)
    try:
        yield client
    finally:
        client.destroy_node()
