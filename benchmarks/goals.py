"""Goals: walking a metre and turning a quarter, measured from before the call to after it."""

from __future__ import annotations

import math

from benchmarks.rows import Family, Measurement, Row
from benchmarks.trials import Failed, Subject, Trial
from go2_wbc.robot.rotations import wrap_angle, yaw_rotation

DISTANCE = 1.0
"""m"""
ANGLE = math.pi / 2

_DRIVE, _TURN = "move_forward(1.0)", "turn_left(pi/2)"
ROWS = (
    Row("goal.miss", _DRIVE, "distance from the goal", "mm", 20.0),
    Row("goal.heading", _DRIVE, "heading error", "deg", 1.0),
    Row("goal.turn", _TURN, "angle error", "deg", 1.5),
    Row("goal.drift", _TURN, "base moved by", "mm", None),
)


def measure(trial: Trial) -> Measurement:
    """Stand, walk one metre, turn a quarter to the left.

    - distance from the goal: of the base, in the plane, from the point one metre ahead of where it
      was, along its heading then;
    - heading and angle errors: of the base's yaw, against before the call.
    """
    values: dict[str, float] = {}
    with Subject(trial) as robot:
        try:
            robot.require(robot.go2.stand())
            values |= _drive(robot)
            values |= _turn(robot)
        except Failed as failed:
            return Measurement(values, reason=str(failed))
    return Measurement(values)


def _drive(robot: Subject) -> dict[str, float]:
    before = robot.plant.read()
    robot.require(robot.go2.move_forward(DISTANCE))
    after = robot.plant.read()
    yaw = float(before.rpy[2])
    x, y, _ = yaw_rotation(yaw).T @ (after.p_world_base - before.p_world_base)
    return {
        "goal.miss": 1000.0 * math.hypot(x - DISTANCE, y),
        "goal.heading": math.degrees(abs(wrap_angle(float(after.rpy[2]) - yaw))),
    }


def _turn(robot: Subject) -> dict[str, float]:
    before = robot.plant.read()
    robot.require(robot.go2.turn_left(ANGLE))
    after = robot.plant.read()
    turned = wrap_angle(float(after.rpy[2] - before.rpy[2]))
    x, y, _ = after.p_world_base - before.p_world_base
    return {
        "goal.turn": math.degrees(abs(wrap_angle(turned - ANGLE))),
        "goal.drift": 1000.0 * math.hypot(x, y),
    }


FAMILY = Family("goals", ROWS, measure)
