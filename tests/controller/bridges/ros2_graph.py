"""Real servers in real processes on the loopback, and a probe that talks to them.

Importing this module needs no ROS: ``needs_ros2`` skips what does.
"""

from __future__ import annotations

import contextlib
import importlib.util
import json
import os
import signal
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import pytest

ROOT = Path(__file__).resolve().parents[3]
DISCOVERY = 15.0
"""Time [s] in which processes must find each other; half a second on an idle machine."""
ANSWER = 30.0
"""Time [s] in which a behaviour must be answered; four on an idle machine."""

HAS_ROS2 = importlib.util.find_spec("rclpy") is not None
HAS_INTERFACES = importlib.util.find_spec("quadropted_msgs") is not None
IS_REQUIRED = "GO2_WBC_REQUIRE_ROS2" in os.environ
"""Set by ``make test-ros2``: what is missing is then a failure, not a test that is skipped."""
needs_ros2 = pytest.mark.skipif(
    not (HAS_ROS2 and HAS_INTERFACES) and not IS_REQUIRED,
    reason="ROS 2 is not here: run `make test-ros2`, which installs the extra [ros2]",
)


def isolate() -> None:
    """Keep this process and its children on the loopback, in a ROS domain of their own."""
    worker = int(os.environ.get("PYTEST_XDIST_WORKER", "gw0").removeprefix("gw"))
    os.environ["ROS_AUTOMATIC_DISCOVERY_RANGE"] = "LOCALHOST"
    os.environ["ROS_DOMAIN_ID"] = str(20 + (os.getppid() + 7 * worker) % 70)
    os.environ.setdefault("ROS_LOG_DIR", str(Path(tempfile.gettempdir()) / "go2-wbc-ros-log"))


class Server:
    """``go2-wbc ros2`` in a process of its own."""

    def __init__(self, *options: str, namespace: str = "robot1", path: str = "") -> None:
        self.namespace = namespace
        self._log = tempfile.NamedTemporaryFile("w+", suffix=".log")  # noqa: SIM115
        environment = {**os.environ, "PYTHONUNBUFFERED": "1"}
        if path:
            environment["PYTHONPATH"] = path
        arguments = ["-m", "controller.cli.main", "ros2", "--namespace", namespace, *options]
        self.process = subprocess.Popen(
            [sys.executable, *arguments],
            cwd=ROOT,
            env=environment,
            stdin=subprocess.DEVNULL,
            stdout=self._log,
            stderr=subprocess.STDOUT,
        )

    @property
    def said(self) -> str:
        return Path(self._log.name).read_text(encoding="utf-8")

    def await_ready(self) -> Server:
        wait_until(lambda: "serving" in self.said or self.process.poll() is not None, 60.0)
        assert "serving" in self.said, self.said
        return self

    def end(self) -> int:
        """Ask it to end, as Ctrl-C does; its exit code."""
        self.process.send_signal(signal.SIGINT)
        return self.process.wait(20.0)

    def kill(self) -> None:
        self.process.kill()
        self.process.wait(20.0)
        self._log.close()


@contextlib.contextmanager
def serving(*options: str, namespace: str = "robot1", path: str = "") -> Iterator[Server]:
    server = Server(*options, namespace=namespace, path=path)
    try:
        yield server.await_ready()
    finally:
        server.kill()


def wait_until(condition: Callable[[], bool], limit: float) -> None:
    end = time.monotonic() + limit
    while not condition() and time.monotonic() < end:
        time.sleep(0.02)


@dataclass(frozen=True)
class Place:
    """Position [m] and heading [rad] in the world, and robot time [s]."""

    xy: tuple[float, float]
    yaw: float
    time: float


class Probe:
    """A node of plain rclpy, with nothing of the client's."""

    def __init__(self, namespace: str = "robot1") -> None:
        import rclpy
        from geometry_msgs.msg import Twist
        from nav_msgs.msg import Odometry
        from quadropted_msgs.srv import RobotBehaviorCommand
        from std_srvs.srv import Trigger

        self._rclpy, self._twist, self._trigger = rclpy, Twist, Trigger
        self._request = RobotBehaviorCommand.Request
        self.namespace = namespace
        self.node = rclpy.create_node(f"probe_{namespace}")
        self._client = self.node.create_client(
            RobotBehaviorCommand, f"/{namespace}/robot_behavior_command"
        )
        self._triggers: dict[str, Any] = {}
        self._publisher = self.node.create_publisher(Twist, f"/{namespace}/cmd_vel", 10)
        self.odometry: Any = None
        self.node.create_subscription(Odometry, f"/{namespace}/odom", self._note, 1)

    def _note(self, message: Any) -> None:
        self.odometry = message

    def spin(self, seconds: float) -> None:
        end = time.monotonic() + seconds
        while time.monotonic() < end:
            self._rclpy.spin_once(self.node, timeout_sec=0.01)

    def send(self, command: str) -> Any:
        """The future of a behaviour."""
        assert self._client.wait_for_service(DISCOVERY)
        return self._client.call_async(self._request(command=command))

    def result(self, future: Any, limit: float = ANSWER) -> Any:
        self._rclpy.spin_until_future_complete(self.node, future, timeout_sec=limit)
        assert future.done()
        return future.result()

    def call(self, command: str) -> Any:
        return self.result(self.send(command))

    def trigger(self, name: str) -> Any:
        client = self._triggers.get(name)
        if client is None:
            client = self.node.create_client(self._trigger, f"/{self.namespace}/{name}")
            self._triggers[name] = client
        assert client.wait_for_service(DISCOVERY)
        return self.result(client.call_async(self._trigger.Request()))

    def statistics(self) -> dict[str, Any]:
        return json.loads(self.trigger("statistics").message)

    def move(self, x: float, turn: float = 0.0, *, y: float = 0.0) -> None:
        message = self._twist()
        message.linear.x, message.linear.y, message.angular.z = x, y, turn
        self._publisher.publish(message)

    def drive(self, seconds: float, x: float, turn: float = 0.0, *, y: float = 0.0) -> None:
        """Command at 50 Hz."""
        end = time.monotonic() + seconds
        while time.monotonic() < end:
            self.move(x, turn, y=y)
            self.spin(0.02)

    def pose(self) -> tuple[float, float, float, float]:
        """Newest x, y, z [m] and robot or wall time [s] of odometry."""
        self.odometry, end = None, time.monotonic() + DISCOVERY
        while self.odometry is None and time.monotonic() < end:
            self._rclpy.spin_once(self.node, timeout_sec=0.1)
        assert self.odometry is not None, "no odometry"
        at, stamp = self.odometry.pose.pose.position, self.odometry.header.stamp
        return at.x, at.y, at.z, stamp.sec + 1e-9 * stamp.nanosec

    def place(self) -> Place:
        """Where the robot is, and its own time: on a busy machine less passes than on the wall."""
        figures = self.statistics()
        x, y, _ = figures["position"]
        return Place((x, y), figures["heading"], figures["robot_time"])

    def let_pass(self, seconds: float) -> None:
        """Let this much of the robot's own time pass."""
        end = self.place().time + seconds
        while self.place().time < end:
            self.spin(0.05)

    def close(self) -> None:
        self.node.destroy_node()
