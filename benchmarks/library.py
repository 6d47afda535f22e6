"""Every motion of the library, played over seeds: does it stay up, on its feet, and on its plan?"""

from __future__ import annotations

from functools import cache

from benchmarks.study import Direction, Measurement, Metric, Study
from controller.motion_measurement import measure_motion
from controller.sweeps.trials import Trial, TrialRobot
from go2_wbc.reference import MotionPlan
from go2_wbc.robot.model import RobotModel
from motions import compile_timeline, load_motion, motion_names

_ITEM = "every motion of the library"
DONE = Metric("library.done", _ITEM, "share of motions done", "", 1.0, Direction.AT_LEAST)
SLIP = Metric("library.slip", _ITEM, "slip of feet that stay", "mm", 5.0)
LANDED_SLIP = Metric("library.landed_slip", _ITEM, "slip of feet that step", "mm", None)
TORQUE = Metric("library.torque", _ITEM, "peak torque / limit", "", 1.0)
SPEED = Metric("library.speed", _ITEM, "peak joint speed / limit", "", 1.0)
TRACKING = Metric("library.tracking", _ITEM, "CoM off its plan, worst", "mm", None)
METRICS = (DONE, SLIP, LANDED_SLIP, TORQUE, SPEED, TRACKING)


def measure(trial: Trial) -> Measurement:
    """Play the motions one after the other on one robot; a new robot after a failure.

    - done: ``play`` said True and the robot is upright for MuJoCo;
    - slip: largest distance that a standing foot's material slid at its contact point, from 0.1 s
      after a touchdown to 0.1 s before a lift-off; of motions whose feet stay where they are, and
      of those that step or jump: on little friction a foot that lands fast slides for longer.
    """
    model = RobotModel()
    values = {metric.name: 0.0 for metric in METRICS}
    lost: dict[str, str] = {}
    remaining = list(motion_names())
    while remaining:
        with TrialRobot(trial) as robot:
            robot.require(robot.go2.stand())
            while remaining:
                name = remaining.pop(0)
                plan = plan_of(name)
                run = measure_motion(robot.go2, robot.truth, plan, model)
                for metric, value in (
                    (SLIP if plan.footsteps is None else LANDED_SLIP, 1000.0 * run.slip),
                    (TORQUE, run.torque),
                    (SPEED, run.speed),
                    (TRACKING, 1000.0 * run.tracking),
                ):
                    values[metric.name] = max(values[metric.name], value)
                if not run.ok:
                    lost[name] = run.fall or run.reason
                    break
    values[DONE.name] = 1.0 - len(lost) / len(motion_names())
    reason = "; ".join(f"{name}: {why}" for name, why in lost.items())
    return Measurement(values, {DONE.name: reason} if lost else {})


@cache
def plan_of(name: str) -> MotionPlan:
    """The motion, compiled once for all trials of a process: it depends on nothing of theirs."""
    return compile_timeline(load_motion(name), RobotModel())


STUDY = Study("library", METRICS, measure)
