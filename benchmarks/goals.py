"""Goals: walking a metre and turning a quarter, measured from before the call to after it."""

from __future__ import annotations

import math

from benchmarks.study import Measurement, Metric, Study
from controller.sweeps.trials import Trial, TrialFailed, TrialRobot
from go2_wbc.robot.rotations import wrap_angle, yaw_rotation
from go2_wbc.robot.state import RobotState

DISTANCE = 1.0
"""m"""
ANGLE = math.pi / 2

_DRIVE, _TURN = "move_forward(1.0)", "turn_left(pi/2)"
METRICS = (
    Metric("goal.miss", _DRIVE, "distance from the goal", "mm", 20.0),
    Metric("goal.heading", _DRIVE, "heading error", "deg", 1.0),
    Metric("goal.turn", _TURN, "angle error", "deg", 1.5),
    Metric("goal.drift", _TURN, "base moved by", "mm", None),
)


def measure(trial: Trial) -> Measurement:
    """Stand, walk one metre, turn a quarter to the left.

    - distance from the goal: of the base, in the plane, from the point one metre ahead of where it
      was, along its heading then;
    - heading and angle errors: of the base's yaw, against before the call.
    """
    values: dict[str, float] = {}
    with TrialRobot(trial) as robot:
        try:
            robot.require(robot.go2.stand())
            start = robot.plant.truth()
            robot.require(robot.go2.move_forward(DISTANCE))
            there = robot.plant.truth()
            x, y, turned = way_between(start, there)
            values["goal.miss"] = 1000.0 * math.hypot(x - DISTANCE, y)
            values["goal.heading"] = math.degrees(abs(turned))
            robot.require(robot.go2.turn_left(ANGLE))
            x, y, turned = way_between(there, robot.plant.truth())
            values["goal.turn"] = math.degrees(abs(wrap_angle(turned - ANGLE)))
            values["goal.drift"] = 1000.0 * math.hypot(x, y)
        except TrialFailed as failed:
            return Measurement(values, reason=str(failed))
    return Measurement(values)


def way_between(before: RobotState, after: RobotState) -> tuple[float, float, float]:
    """How far the base has come ahead and to the left [m], and how far it has turned [rad]."""
    yaw = float(before.rpy[2])
    x, y, _ = yaw_rotation(yaw).T @ (after.p_world_base - before.p_world_base)
    return float(x), float(y), wrap_angle(float(after.rpy[2]) - yaw)


STUDY = Study("goals", METRICS, measure)
