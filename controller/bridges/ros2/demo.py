"""The demo over ROS 2: the same steps as the embedded one, each measured on odometry."""

from __future__ import annotations

import math
import time
from collections.abc import Callable
from dataclasses import dataclass

from controller.bridges.ros2 import imports as ros
from controller.bridges.ros2.client import GO2ControllerNode
from controller.checks import HEIGHT_TOLERANCE
from controller.demo.report import Measurement as Figure
from controller.demo.report import StepResult
from controller.demo.steps import FORWARD_SPEED, FORWARD_TIME, HOLD_TIME, STOP_TIME, TURN_ANGLE
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


@dataclass(frozen=True, slots=True)
class RosStep:
    """One step: what is done, and what odometry must show of it (before, after)."""

    name: str
    label: str
    act: Callable[[GO2ControllerNode], bool]
    measure: Measure


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


def _walk_forward(go2: GO2ControllerNode) -> bool:
    go2.move(linear_x=FORWARD_SPEED)
    return _let_pass(go2, FORWARD_TIME)


def _stop(go2: GO2ControllerNode) -> bool:
    go2.stop()
    return _let_pass(go2, STOP_TIME)


def _let_pass(go2: GO2ControllerNode, seconds: float) -> bool:
    """Let this much of the robot's time pass."""
    state = start = go2.state()
    while start is not None and state is not None and state.time - start.time < seconds:
        state = go2.state()
    return state is not None


STEPS: tuple[RosStep, ...] = (
    RosStep("stand", "stand up", lambda go2: go2.stand(), _height(STAND_HEIGHT)),
    RosStep("sit", "sit", lambda go2: go2.sit(), _height(float(SIT_POSE[2]))),
    RosStep("walk", "walking mode", lambda go2: go2.walk(), _height(STAND_HEIGHT)),
    RosStep("forward", "forward 0.2 m/s, 2 s", _walk_forward, _way),
    RosStep("stop", "stop", _stop, _rest),
    RosStep("turn", "turn left 90 deg", lambda go2: go2.turn_left(TURN_ANGLE), _turned),
    RosStep(
        "high_five", "high five", lambda go2: go2.high_five(hold=HOLD_TIME), _height(STAND_HEIGHT)
    ),
    RosStep("sit_again", "sit", lambda go2: go2.sit(), _height(float(SIT_POSE[2]))),
)
"""Stand, sit, walk, forward, stop, turn, high five, sit."""


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
    for step in STEPS:
        results.append(_run_step(go2, step))
        on_step(results[-1])
    return tuple(results)


def _run_step(go2: GO2ControllerNode, step: RosStep) -> StepResult:
    before, wall = go2.state(), time.monotonic()
    done = before is not None and step.act(go2)
    after = go2.state()
    if before is None or after is None:
        reason, start, duration = f"no odometry of /{go2.namespace}", 0.0, time.monotonic() - wall
        return StepResult(step.name, step.label, False, reason, start, duration)
    figures = step.measure(before, after)
    missed = "; ".join(str(figure) for figure in figures if not figure.is_met)
    reason = missed if done else go2.last_message
    duration = after.time - before.time
    return StepResult(
        step.name,
        step.label,
        done and not missed,
        reason or "done",
        before.time,
        duration,
        figures,
    )
