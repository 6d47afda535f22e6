"""The demo over ROS 2: the same steps as the embedded one, each measured on odometry."""

from __future__ import annotations

import math
import time
from collections.abc import Callable, Mapping
from typing import Any

from controller.bridges.ros2 import imports as ros
from controller.bridges.ros2.client import GO2ControllerNode
from controller.demo import steps
from controller.modes import HEIGHT_TOLERANCE
from controller.navigation import HEADING_TOLERANCE
from go2_wbc.robot.description import find_profile
from go2_wbc.robot.state import RobotState

STAND_HEIGHT = 0.31  #: Height [m] of the base when standing; the CoM is 2 cm lower
WAY_TOLERANCE = 0.06  #: Accepted error [m] of the way: commands travel through two processes
TURN_TOLERANCE = 2.0 * math.degrees(HEADING_TOLERANCE)  #: Accepted error [deg] of the turn
REST_SPEED = 0.05  #: Speed [m/s] below which the robot rests


def _height(_before: RobotState, after: RobotState) -> float:
    return float(after.q[2])


def _way(before: RobotState, after: RobotState) -> float:
    return math.dist(after.p_world_base[:2].tolist(), before.p_world_base[:2].tolist())


def _speed(_before: RobotState, after: RobotState) -> float:
    return math.hypot(*after.v[:2].tolist())


def _turned(before: RobotState, after: RobotState) -> float:
    return math.degrees(math.remainder(after.yaw - before.yaw, math.tau))


_STANDING = ("base height", _height, "m", STAND_HEIGHT, HEIGHT_TOLERANCE)
_SITTING = ("base height", _height, "m", find_profile().sit[0], HEIGHT_TOLERANCE)
_FIGURES: Mapping[str, tuple[str, Callable[[RobotState, RobotState], float], str, float, float]] = {
    "stand": _STANDING,
    "sit": _SITTING,
    "walk": _STANDING,
    "forward": ("way", _way, "m", steps.FORWARD_SPEED * steps.FORWARD_TIME, WAY_TOLERANCE),
    "stop": ("speed at the end", _speed, "m/s", 0.0, REST_SPEED),
    "turn": ("turned left", _turned, "deg", math.degrees(steps.TURN_ANGLE), TURN_TOLERANCE),
    "high_five": _STANDING,
    "sit_again": _SITTING,
}
"""By step: the figure's name, how odometry before and after gives it, unit, what is asked, +-."""


def run_ros_demo(
    namespace: str = "robot1", on_step: Callable[[steps.StepResult], None] = lambda _result: None
) -> tuple[steps.StepResult, ...]:
    """Run the demo on the server of ``namespace``.

    Raises:
        MissingDependency: if ROS 2 or the interfaces are not installed.
        BridgeError: if there is no server.
    """
    ros.rclpy.init(args=[], signal_handler_options=ros.SignalHandlerOptions.NO)
    go2 = GO2ControllerNode(namespace, node_name="go2_demo")
    try:
        go2.check_served()
        return run_steps(go2, on_step)
    finally:
        go2.destroy_node()
        ros.rclpy.try_shutdown()


def run_steps(
    go2: GO2ControllerNode, on_step: Callable[[steps.StepResult], None] = lambda _result: None
) -> tuple[steps.StepResult, ...]:
    """Run the steps on a client; the robot's server is asked, odometry is believed."""
    results = []
    for step in steps.DEMO_STEPS:
        results.append(_run_step(go2, step))
        on_step(results[-1])
    return tuple(results)


def _run_step(
    go2: Any, step: steps.DemoStep
) -> steps.StepResult:  # the client has the controller's methods
    before, wall = go2.state(), time.monotonic()
    done = before is not None and step.act(go2) is not False
    after = go2.state()
    if before is None or after is None:
        reason, start, duration = f"no odometry of /{go2.namespace}", 0.0, time.monotonic() - wall
        return steps.StepResult(step.name, step.label, False, reason, start, duration)
    name, seen, unit, asked, tolerance = _FIGURES[step.name]
    figure = steps.Measurement(name, seen(before, after), unit, asked, tolerance)
    reason = go2.last_message if not done else "done" if figure.is_met else str(figure)
    ok, duration = done and figure.is_met, after.time - before.time
    return steps.StepResult(step.name, step.label, ok, reason, before.time, duration, (figure,))
