"""The whole demo: does it work on every seed, and does every True hold in the simulator?"""

from __future__ import annotations

import math
import time
from collections.abc import Callable

import numpy as np

from benchmarks.high_fives import highest_window
from benchmarks.postures import standing_fault
from benchmarks.rows import Direction, Family, Measurement, Row
from benchmarks.trials import Failed, Subject, Trial
from controller.demo.run import DemoProgress, run_demo
from go2_wbc.legs import LEGS, Leg
from go2_wbc.robot.rotations import wrap_angle, yaw_rotation
from go2_wbc.robot.state import RobotState

SIT_PITCH = math.radians(-25.0)
"""Pitch of the trunk of a sitting robot: at least this much nose up."""
SIT_REAR_HEIGHT = 0.16
"""Height [m] below which the rear end of the trunk is down; it is at 0.29 m when standing."""
REAR_END = -0.1934
"""m; the rear hips in the base frame, by the URDF."""
FORWARD_WAY = (0.30, 0.44)
"""Way [m] of two seconds at 0.2 m/s, from rest."""
FORWARD_ASIDE = 0.05
STOP_SPEED = 0.05
"""m/s"""
TURN = (math.pi / 2, math.radians(2.0))
PAW_HEIGHT, PAW_TIME = 0.60, 1.9
"""Height [m] that the paw keeps, and for how long [s]: the hold without its edges."""
PAW_SUPPORT = 5.0
"""N on every other foot meanwhile."""

_ITEM = "whole demo sequence"
ROWS = (
    Row("demo.done", _ITEM, "share of seeds done", "", 1.0, Direction.AT_LEAST),
    Row("demo.untrue", _ITEM, "True not borne out", "", 0.0),
    Row("demo.pace", "whole run headless", "real-time factor, CPU", "", 2.5, Direction.AT_LEAST),
)


def measure(trial: Trial) -> Measurement:
    """Run the demo and check every step that it calls done against the simulator.

    - share of seeds done: 1 for a trial in which every step was done, 0 for any other;
    - True not borne out: steps called done for which this module's own criteria, on MuJoCo's
      state, are not met;
    - real-time factor: robot time over processor time of the process, from building the plant to
      closing it, imports and the truth excluded.
    """
    cpu_start = time.process_time()
    with Subject(trial) as robot:
        judge = Judge(robot)
        report = run_demo(robot.go2, judge)
        robot_time, watching = robot.plant.time, robot.truth.cpu_time
    cpu_time = time.process_time() - cpu_start - watching
    values = {
        "demo.done": float(report.ok),
        "demo.untrue": float(len(judge.untrue)),
        "demo.pace": robot_time / cpu_time,
    }
    failures = {}
    if not report.ok:
        undone = [f"{step.name}: {step.reason}" for step in report.steps if not step.ok]
        failures["demo.done"] = "; ".join(undone)
    if judge.untrue:
        failures["demo.untrue"] = "; ".join(judge.untrue)
    return Measurement(values, failures)


class Judge:
    """Looks at the robot when a step begins and ends, and at the track in between.

    Attributes:
        untrue: steps that were called done although they were not, with the reason.
    """

    def __init__(self, robot: Subject) -> None:
        """Judge ``robot``'s demo."""
        self._robot = robot
        self._before = robot.plant.read()
        self.untrue: list[str] = []

    def __call__(self, progress: DemoProgress) -> None:
        """Take note of a step's begin, or judge its end."""
        if progress.result is None:
            self._before = self._robot.plant.read()
            self._robot.truth.clear()
            return
        name = progress.result.name
        if progress.result.ok:
            fault = self._robot.truth.fall() if "sit" not in name else None
            fault = fault or FAULTS[name](self._robot, self._before)
            if fault is not None:
                self.untrue.append(f"{name}: {fault}")


def _stand_fault(robot: Subject, _before: RobotState) -> str | None:
    return standing_fault(robot)


def _sit_fault(robot: Subject, _before: RobotState) -> str | None:
    state = robot.plant.read()
    pitch, rear = float(state.rpy[1]), _rear_height(state)
    if pitch > SIT_PITCH:
        return f"pitch {math.degrees(pitch):.0f} deg"
    return f"rear end at {rear:.2f} m" if rear > SIT_REAR_HEIGHT else None


def _rear_height(state: RobotState) -> float:
    return float(state.q[2] + REAR_END * state.R_world_base[2, 0])


def _forward_fault(robot: Subject, before: RobotState) -> str | None:
    way = robot.plant.read().p_world_base - before.p_world_base
    ahead, left, _ = yaw_rotation(float(before.rpy[2])).T @ way
    if not FORWARD_WAY[0] <= ahead <= FORWARD_WAY[1] or abs(left) > FORWARD_ASIDE:
        return f"went {ahead:.3f} m ahead and {left:.3f} m aside"
    return None


def _stop_fault(robot: Subject, _before: RobotState) -> str | None:
    last = robot.truth.track().com_velocity[-1]
    speed = float(np.linalg.norm(last[:2]))
    return f"moves at {speed:.2f} m/s" if speed > STOP_SPEED else standing_fault(robot)


def _turn_fault(robot: Subject, before: RobotState) -> str | None:
    asked, tolerance = TURN
    turned = wrap_angle(float(robot.plant.read().rpy[2] - before.rpy[2]))
    if abs(wrap_angle(turned - asked)) > tolerance:
        return f"turned {math.degrees(turned):.1f} deg"
    return None


def _high_five_fault(robot: Subject, _before: RobotState) -> str | None:
    track, leg = robot.truth.track(), Leg.FR
    ticks = round(PAW_TIME / robot.plant.control_period)
    try:
        held = track.part(highest_window(track.p_world_feet[:, leg, 2], ticks))
    except Failed as failed:
        return str(failed)
    height = float(held.p_world_feet[:, leg, 2].min())
    if height < PAW_HEIGHT:
        return f"paw held at {height:.3f} m"
    load = float(held.foot_forces[:, [other for other in LEGS if other is not leg]].min())
    if load < PAW_SUPPORT:
        return f"a supporting foot carried {load:.1f} N only"
    return standing_fault(robot)


FAULTS: dict[str, Callable[[Subject, RobotState], str | None]] = {
    "stand": _stand_fault,
    "sit": _sit_fault,
    "walk": _stand_fault,
    "forward": _forward_fault,
    "stop": _stop_fault,
    "turn": _turn_fault,
    "high_five": _high_five_fault,
    "sit_again": _sit_fault,
}
"""What is missing for a step to be true, by the step's name; every step must have one."""


FAMILY = Family("sequence", ROWS, measure, seed_factor=5)
