"""The class without any robot: two methods are patched, the rest is tested."""

from __future__ import annotations

from collections.abc import Iterator
from unittest.mock import MagicMock, patch

import pytest
import rclpy
from go2_high_five.controller import GO2Controller


@pytest.fixture
def robot() -> Iterator[GO2Controller]:
    rclpy.init()
    with patch("go2_high_five.controller.GO2Controller._wait_for_service", return_value=True):
        node = GO2Controller("robot1")
    yield node
    node.destroy_node()
    rclpy.shutdown()


@pytest.mark.parametrize(("method", "command"), [("sit", "sit"), ("stand", "up"), ("walk", "walk")])
@patch("go2_high_five.controller.GO2Controller._call_behavior")
def test_a_behaviour_sends_its_command(
    call: MagicMock, robot: GO2Controller, method: str, command: str
) -> None:
    call.return_value = True
    assert getattr(robot, method)() is True
    call.assert_called_once_with(command)


@patch("go2_high_five.controller.GO2Controller._call_behavior", lambda _self, _command: False)
def test_a_failure_is_handed_on(robot: GO2Controller) -> None:
    assert robot.stand() is False


def test_move_publishes_the_velocity_and_stop_zero(robot: GO2Controller) -> None:
    with patch.object(robot, "_cmd_vel_pub") as publisher:
        robot.move(linear_x=0.2, angular_z=-0.1)
        sent = publisher.publish.call_args.args[0]
        assert (sent.linear.x, sent.angular.z) == (0.2, -0.1)
        robot.stop()
        sent = publisher.publish.call_args.args[0]
        assert (sent.linear.x, sent.angular.z) == (0.0, 0.0)
