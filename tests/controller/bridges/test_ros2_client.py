"""The client, alone and against a server; and a student's own class."""

import json
import math
import subprocess
import threading
from collections.abc import Callable, Iterator
from typing import Any
from unittest.mock import patch

import pytest

from go2_wbc.errors import BridgeError, CommandError, ConfigError
from tests.controller.bridges.processes import Process, wait_until
from tests.controller.bridges.ros2_graph import needs_ros2
from tests.controller.bridges.ros2_probe import WatchingProbe
from tests.script_server import python

pytestmark = needs_ros2

Done = subprocess.CompletedProcess[str]
CLIENT = "controller.bridges.ros2.client.GO2ControllerNode"


@pytest.fixture
def alone(graph: None) -> Iterator[Any]:
    """A client that does not look for a server."""
    from controller.bridges.ros2 import GO2ControllerNode

    with patch(f"{CLIENT}._wait_for_service", return_value=True):
        node = GO2ControllerNode("nobody")
    yield node
    node.destroy_node()


@pytest.fixture
def go2(server: Process) -> Iterator[Any]:
    from controller.bridges.ros2 import GO2ControllerNode

    node = GO2ControllerNode()
    yield node
    node.destroy_node()


@pytest.mark.parametrize(("method", "command"), [("sit", "sit"), ("stand", "up"), ("walk", "walk")])
@pytest.mark.parametrize("done", [True, False])
def test_a_behaviour_sends_its_command_and_hands_on_the_answer(
    alone: Any, method: str, command: str, *, done: bool
) -> None:
    with patch(f"{CLIENT}._call_behavior", return_value=done) as call:
        assert getattr(alone, method)() is done
    call.assert_called_once_with(command)


def test_move_is_published_at_once_and_repeated_until_stop(alone: Any) -> None:
    with patch.object(alone, "_cmd_vel_pub") as publisher:
        alone.move(linear_x=0.2, angular_z=-0.5, linear_y=0.1)
        publisher.publish.assert_called_once()
        assert wait_until(lambda: publisher.publish.call_count >= 3, 10.0)
        sent = publisher.publish.call_args.args[0]
        assert (sent.linear.x, sent.linear.y, sent.angular.z) == (0.2, 0.1, -0.5)
        alone.stop()
        count = publisher.publish.call_count
        sent = publisher.publish.call_args.args[0]
        assert (sent.linear.x, sent.linear.y, sent.angular.z) == (0.0, 0.0, 0.0)
        alone.move(linear_x=0.1)
        assert wait_until(lambda: publisher.publish.call_count >= count + 4, 10.0)
        speeds = [call.args[0].linear.x for call in publisher.publish.call_args_list[count:]]
        assert set(speeds) == {0.1}  # the first command is repeated no more


def test_wrong_arguments_are_errors_of_ours(alone: Any) -> None:
    from controller.bridges.ros2 import GO2ControllerNode

    for call in (lambda: alone.move(math.nan), lambda: alone.turn_left(math.inf)):
        with pytest.raises(CommandError, match="finite"):
            call()
    with pytest.raises(ConfigError, match="namespace"):
        GO2ControllerNode("not a name")


def test_without_a_server_a_call_ends_in_false_and_says_how_to_start_one(alone: Any) -> None:
    with patch(f"{CLIENT}._wait_for_service", return_value=False):
        assert alone.stand() is False
    assert "go2-wbc ros2 --namespace nobody" in alone.last_message


def test_without_init_the_client_says_what_to_call_first() -> None:
    from controller.bridges.ros2 import GO2ControllerNode

    with (
        patch("controller.bridges.ros2.client.ros.rclpy.ok", return_value=False),
        pytest.raises(BridgeError, match=r"rclpy\.init\(\)"),
    ):
        GO2ControllerNode()


def demo(*options: str) -> Done:
    return python("-m", "controller.cli.main", "demo", "--ros2", *options)


def test_the_demo_runs_over_ros_and_its_figures_come_from_odometry(
    paced: Callable[[Callable[[], Done]], Done],
) -> None:
    done = paced(lambda: demo("--json"))
    assert done.returncode == 0, done.stderr
    report = json.loads(done.stdout[done.stdout.index("{") :])
    assert report["ok"] is True
    steps = {step["name"]: step for step in report["steps"]}
    assert list(steps)[:3] == ["stand", "sit", "walk"]
    assert steps["forward"]["figures"][0]["measured"] == pytest.approx(0.4, abs=0.06)


def test_a_demo_without_a_server_ends_with_the_line_that_starts_one() -> None:
    done = demo("--namespace", "ghost")
    assert done.returncode == 3
    assert "go2-wbc ros2 --namespace ghost" in done.stderr
    assert "Traceback" not in done.stderr


def test_goals_are_closed_on_odometry(go2: Any) -> None:
    assert go2.turn_left(math.pi / 2)
    yaw = go2.state().yaw
    assert go2.turn_right(math.pi / 2)
    assert math.remainder(go2.state().yaw - yaw, math.tau) == pytest.approx(-math.pi / 2, abs=0.06)
    before = go2.state().p_world_base
    assert go2.move_forward(0.4)
    assert math.dist(go2.state().p_world_base[:2], before[:2]) == pytest.approx(0.4, abs=0.04)


def test_a_motion_tells_its_progress_and_can_be_cancelled(go2: Any) -> None:
    seen: list[float] = []

    def watch(share: float) -> None:
        seen.append(share)
        if share > 0.3:
            go2.cancel()

    assert go2.play("push_ups", {"times": 3}, watch) is False
    assert "cancelled" in go2.last_message
    assert max(seen) < 0.9
    assert go2.state().q[2] > 0.27


def test_a_class_from_the_course_runs_unmodified(probe: WatchingProbe) -> None:
    from tests.controller.bridges.student import StudentController

    student = StudentController()
    try:
        done, heights = [student.stand()], [probe.height()]
        done.append(student.sit())
        heights.append(probe.height())
        done.append(student.walk())
        before = probe.place()
        student.move(linear_x=0.2)
        probe.let_pass(1.5)
        student.stop()
        probe.let_pass(0.5)
        way = probe.place().way_from(before)
        done.append(student.sit())
        assert done == [True] * 4
        assert heights == pytest.approx([0.31, 0.235], abs=0.02)
        # It publishes once, and a robot that hears nothing stops after half a second.
        assert way == pytest.approx(0.1, abs=0.03)
    finally:
        student.destroy_node()


def test_somebody_else_may_spin_the_node(go2: Any) -> None:
    from rclpy.executors import SingleThreadedExecutor

    executor = SingleThreadedExecutor()
    executor.add_node(go2)
    is_over = threading.Event()

    def spin() -> None:
        while not is_over.is_set():
            executor.spin_once(timeout_sec=0.1)

    thread = threading.Thread(target=spin, daemon=True)
    thread.start()
    try:
        assert go2.stand()
        assert go2.state() is not None
    finally:
        is_over.set()
        thread.join(5.0)
        executor.shutdown()
