"""Every motion of the library, played over seeds: does it stay up, on its feet, and on its plan?"""

from __future__ import annotations

from benchmarks.motion_runs import run_motion
from benchmarks.rows import Direction, Family, Measurement, Row
from benchmarks.trials import Failed, Subject, Trial
from go2_wbc.robot.model import RobotModel
from motions import compile_timeline, load_motion, motion_names

_ITEM = "every motion of the library"
DONE = Row("library.done", _ITEM, "share of motions done", "", 1.0, Direction.AT_LEAST)
SLIP = Row("library.slip", _ITEM, "support slip, worst motion", "mm", 5.0)
TORQUE = Row("library.torque", _ITEM, "peak torque / limit", "", 1.0)
SPEED = Row("library.speed", _ITEM, "peak joint speed / limit", "", 1.0)
TRACKING = Row("library.tracking", _ITEM, "CoM off its plan, worst", "mm", None)
ROWS = (DONE, SLIP, TORQUE, SPEED, TRACKING)


def measure(trial: Trial) -> Measurement:
    """Play the motions one after the other on one robot; a new robot after a failure.

    - done: ``play`` said True and the robot is upright for MuJoCo;
    - slip: largest distance that a standing foot's material slid at its contact point, from 0.1 s
      after a touchdown to 0.1 s before a lift-off.
    """
    model = RobotModel()
    values = {row.name: 0.0 for row in ROWS}
    lost: dict[str, str] = {}
    remaining = list(motion_names())
    while remaining:
        with Subject(trial) as robot:
            try:
                robot.require(robot.go2.stand())
                while remaining:
                    name = remaining.pop(0)
                    run = run_motion(robot, compile_timeline(load_motion(name), model), model)
                    for row, value in (
                        (SLIP, 1000.0 * run.slip),
                        (TORQUE, run.torque),
                        (SPEED, run.speed),
                        (TRACKING, 1000.0 * run.tracking),
                    ):
                        values[row.name] = max(values[row.name], value)
                    if run.fall is not None or not run.said:
                        lost[name] = run.fall or run.reason
                        break
            except Failed as failed:
                return Measurement({}, reason=str(failed))
    values[DONE.name] = 1.0 - len(lost) / len(motion_names())
    reason = "; ".join(f"{name}: {why}" for name, why in lost.items())
    return Measurement(values, {DONE.name: reason} if lost else {})


FAMILY = Family("library", ROWS, measure)
