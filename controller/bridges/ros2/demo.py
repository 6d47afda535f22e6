"""The demo over ROS 2: the same steps as the embedded one, each measured on odometry."""

from __future__ import annotations

import math
import time
from collections.abc import Callable, Mapping
from typing import Any

from controller.bridges.ros2 import imports as ros
from controller.bridges.ros2.client import GO2ControllerNode
from controller.checks import HEIGHT_TOLERANCE
from controller.demo.report import Measurement as Figure
from controller.demo.report import StepResult
from controller.demo.steps import DEMO_STEPS, FORWARD_SPEED, FORWARD_TIME, TURN_ANGLE, DemoStep
from controller.navigation import HEADING_TOLERANCE
from go2_wbc.robot.state import RobotState
from motions.postures import SIT_POSE

STAND_HEIGHT = 0.31
"""Height [m] of the base when standing; the CoM is 2 cm lower."""
WAY_TOLERANCE = 0.06
"""Accepted error [m] of the way: commands travel through two processes."""
REST_SPEED = 0.05
"""Speed [m/s] below which the robot rests."""

Measure = Callable[[RobotState, RobotState], tuple[Figure, ...]]
"""Figures from what odometry showed before a step and after it."""


def _height(asked: float) -> Measure:
    def measure(_before: RobotState, after: RobotState) -> tuple[Figure, ...]:
        return (Figure("base height", float(after.q[2]), "m", asked, HEIGHT_TOLERANCE),)

    return measure


def _way(before: RobotState, after: RobotState) -> tuple[Figure, ...]:
    way = math.dist(after.p_world_base[:2].tolist(), before.p_world_base[:2].tolist())
    return (Figure("way", way, "m", FORWARD_SPEED * FORWARD_TIME, WAY_TOLERANCE),)


def _rest(_before: RobotState, after: RobotState) -> tuple[Figure, ...]:
    speed = math.hypot(*after.v[:2].tolist())
    return (Figure("speed at the end", speed, "m/s", 0.0, REST_SPEED),)


def _turned(before: RobotState, after: RobotState) -> tuple[Figure, ...]:
    turned = math.degrees(math.remainder(after.yaw - before.yaw, math.tau))
    tolerance = 2.0 * math.degrees(HEADING_TOLERANCE)
    return (Figure("turned left", turned, "deg", math.degrees(TURN_ANGLE), tolerance),)


_MEASURES: Mapping[str, Measure] = {
    "stand": _height(STAND_HEIGHT),
    "sit": _height(float(SIT_POSE[2])),
    "walk": _height(STAND_HEIGHT),
    "forward": _way,
    "stop": _rest,
    "turn": _turned,
    "high_five": _height(STAND_HEIGHT),
    "sit_again": _height(float(SIT_POSE[2])),
}
"""By the name of a step."""


def run_ros_demo(
    namespace: str = "robot1", on_step: Callable[[StepResult], None] = lambda _result: None
) -> tuple[StepResult, ...]:
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
    go2: GO2ControllerNode, on_step: Callable[[StepResult], None] = lambda _result: None
) -> tuple[StepResult, ...]:
    """Run the steps on a client; the robot's server is asked, odometry is believed."""
    results = []
    for step in DEMO_STEPS:
        results.append(_run_step(go2, step))
        on_step(results[-1])
    return tuple(results)


def _run_step(go2: Any, step: DemoStep) -> StepResult:  # the client has the controller's methods
    before, wall = go2.state(), time.monotonic()
    done = before is not None and step.act(go2) is not False
    after = go2.state()
    if before is None or after is None:
        reason, start, duration = f"no odometry of /{go2.namespace}", 0.0, time.monotonic() - wall
        return StepResult(step.name, step.label, False, reason, start, duration)
    figures = _MEASURES[step.name](before, after)
    missed = "; ".join(str(figure) for figure in figures if not figure.is_met)
    reason = missed if done else go2.last_message
    ok, duration = done and not missed, after.time - before.time
    return StepResult(step.name, step.label, ok, reason or "done", before.time, duration, figures)
