"""Where the faults of ROS 2 are played: robots that are watched, clients, and what is required."""

from __future__ import annotations

import math
import sys
from collections.abc import Callable, Iterator, Mapping
from contextlib import ExitStack, contextmanager
from typing import TYPE_CHECKING, Any, Final, final

from benchmarks.bridges.faults import require
from benchmarks.bridges.processes import Process
from benchmarks.bridges.ros2_processes import Probe, serving
from benchmarks.trials import Failed

if TYPE_CHECKING:
    from controller.bridges.ros2 import GO2ControllerNode

REFUSED: Final = 3
"""Exit code of a server that cannot serve."""
REST_TIME, REST_WAY = 0.5, 0.01
"""A robot rests if it moves by less than this [m] in this time [s]."""
WALKER: Final = """
import sys, time, rclpy
from controller.bridges.ros2 import GO2ControllerNode
rclpy.init()
go2 = GO2ControllerNode(sys.argv[1])
if not go2.walk():
    sys.exit(go2.last_message)
go2.move(linear_x=0.3)
print("walking", flush=True)
time.sleep(120)
"""
RAISER: Final = """
import sys, rclpy
from controller.bridges.ros2 import GO2ControllerNode
rclpy.init()
go2 = GO2ControllerNode(sys.argv[1])
go2.play("high_five", {"hold": 1.0}, lambda share: share > 0.3 and print("raised", flush=True))
"""
FLOODER: Final = """
import sys, time, rclpy
from geometry_msgs.msg import Twist
rclpy.init()
node = rclpy.create_node("flooder")
publisher = node.create_publisher(Twist, f"/{sys.argv[1]}/cmd_vel", 10)
while not publisher.get_subscription_count():
    time.sleep(0.05)
message, sent, began = Twist(), 0, time.monotonic()
message.linear.x = 0.2
while (passed := time.monotonic() - began) < 3.0:
    if sent < 5000.0 * passed:
        publisher.publish(message)
        sent += 1
print(f"rate {sent / passed:.0f}", flush=True)
"""


@final
class Stage:
    """Where the scenarios play: one robot that they share, and others that end with theirs.

    Attributes:
        namespace: of the shared robot; those of the others begin with it.
    """

    def __init__(self, namespace: str) -> None:
        """Start nothing yet; ``rclpy.init()`` must have been called."""
        self.namespace = namespace
        self._shared: tuple[Process, Probe] | None = None
        self._exits = ExitStack()
        self._tilts: list[float] = []

    def play(self, act: Callable[[Stage], None]) -> float:
        """The largest tilt [deg] during a scenario; after a failure the next gets a new robot.

        Raises:
            Failed: if the robot, or somebody who should have been told, did not do as expected.
            BridgeError: if a process did not start, or nobody answered.
        """
        self._tilts.clear()
        if self._shared is not None:
            self._shared[1].largest_tilt = None
        try:
            act(self)
            if self._shared is not None:
                self._note(self._shared[1])
        except BaseException:
            self.close()
            raise
        if not self._tilts:
            raise Failed("no odometry was heard")
        return math.degrees(max(self._tilts))

    def _note(self, probe: Probe) -> None:
        if probe.largest_tilt is not None:
            self._tilts.append(probe.largest_tilt)

    def robot(self) -> tuple[Process, Probe]:
        """The shared robot, standing or walking: its server and a probe."""
        if self._shared is None:
            self._shared = self._exits.enter_context(self.aside())
            require_done(self._shared[1].call("up"))
        return self._shared

    @contextmanager
    def aside(self, suffix: str = "") -> Iterator[tuple[Process, Probe]]:
        """A robot of one's own."""
        namespace = self.namespace + suffix
        with serving(namespace=namespace) as server, self.watching(suffix) as probe:
            yield server, probe

    @contextmanager
    def watching(self, suffix: str) -> Iterator[Probe]:
        """A probe whose tilts count."""
        probe = Probe(self.namespace + suffix)
        try:
            yield probe
            self._note(probe)
        finally:
            probe.close()

    def close(self) -> None:
        """End the shared robot; the next scenario gets a new one."""
        self._shared = None
        self._exits.close()


# --- clients --------------------------------------------------------------------------------------


def script(code: str, namespace: str) -> Process:
    """A client in a process of its own; without priority, since a flood never sleeps."""
    return Process([sys.executable, "-c", code, namespace], has_priority=False)


@contextmanager
def quiet_client(namespace: str) -> Iterator[GO2ControllerNode]:
    """A client in this process; its complaints are expected, and not shown."""
    from controller.bridges.ros2 import imports as ros
    from controller.bridges.ros2.client import GO2ControllerNode

    client = GO2ControllerNode(namespace, node_name=f"client_of_{namespace}")
    client.get_logger().set_level(ros.LoggingSeverity.FATAL)
    try:
        yield client
    finally:
        client.destroy_node()


# --- what is required: each raises Failed ---------------------------------------------------------


def require_done(answer: Any) -> None:
    """That an order was carried out."""
    require(answer.success, f"an order was not carried out: {answer.message}")


def require_said(text: str, said: str) -> None:
    """That ``text`` is part of what was said."""
    require(text in said, f"{text!r} was not said, but: {said}")


def require_mode(probe: Probe, mode: str) -> None:
    """That the robot is standing, walking, ..."""
    found = probe.statistics()["mode"]
    require(found == mode, f"the robot is {found}, not {mode}")


def require_rest(probe: Probe) -> None:
    """That the robot does not move along."""
    start = probe.place()
    probe.let_pass(REST_TIME)
    way = probe.place().way_from(start)
    require(way < REST_WAY, f"it still walks: {way:.3f} m in {REST_TIME} s")


def require_more(count: str, before: Mapping[str, Any], after: Mapping[str, Any]) -> None:
    """That more velocity commands count as followed, not finite, ..."""
    require(after["cmd_vel"][count] > before["cmd_vel"][count], f"no command counts as {count}")


def require_refused(server: Process, said: str, namespace: str) -> None:
    """That a server has ended because its namespace is served, and has said so."""
    require(server.code == REFUSED, f"the second server's exit code is {server.code}: {said}")
    require_said(f"/{namespace} is already served", said)
    require_said("--namespace", said)
    require("Traceback" not in said, said)
