"""Standing up from lying, and standing against pushes without a step."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np

from benchmarks.pushes import PUSH_TIME, directions_of, force_of, measure_impulses, push_metrics
from benchmarks.study import Measurement, Metric, Study
from controller.modes import Mode
from controller.sweeps.trials import Trial, TrialFailed, TrialRobot
from go2_wbc.robot.model import RobotModel
from motions.postures import STAND_HEIGHT

RECOVERY_TIME = 3.0
"""Time [s] after a push within which the robot must stand again."""
HEIGHT_TOLERANCE = 0.02
TILT_TOLERANCE = math.radians(6.0)
LOAD = 5.0
"""Force [N] on a foot that counts as loaded; a standing foot carries about 40 N."""

_RISE = "lying -> standing"
_PUSH = "standing, push 0.1 s without a step"
STAND_METRICS = (
    Metric("stand.time", _RISE, "time", "s", 3.0),
    Metric("stand.torque", _RISE, "peak torque / limit", "", 0.4),
    Metric("stand.height", _RISE, "final CoM height off", "mm", 5.0),
    Metric("stand.tilt", _RISE, "final tilt", "deg", None),
)
PUSHED = push_metrics("stand.push", _PUSH, lateral=14.0, forward=18.0)
MOVED = Metric("stand.push_moved", _PUSH, "a foot moved, to threshold", "mm", None)


def standing_failure(robot: TrialRobot) -> str | None:
    """What is missing for standing in truth, or None.

    Standing is: CoM within 20 mm of its height, tilt below 6 deg, every foot loaded.
    """
    state, height = robot.plant.truth(), float(robot.truth.p_world_com[2])
    if abs(height - STAND_HEIGHT) > HEIGHT_TOLERANCE:
        return f"CoM at {height:.3f} m instead of {STAND_HEIGHT:.2f} m"
    if state.tilt > TILT_TOLERANCE:
        return f"tilt {math.degrees(state.tilt):.1f} deg"
    least = float(state.foot_forces.min())
    return f"a foot carries {least:.1f} N only" if least < LOAD else None


def measure_stand(trial: Trial) -> Measurement:
    """Stand up from lying.

    - time: from the call of ``stand()`` to its return, in plant time;
    - peak torque: largest |tau| / limit of any joint on the way;
    - final CoM height off: |height of MuJoCo's CoM over the floor - 0.29 m| when ``stand()``
      returns.
    """
    with TrialRobot(trial) as robot:
        start = robot.plant.time
        robot.require(robot.go2.stand())
        recorded = robot.truth.recording()
        values = {
            "stand.time": robot.plant.time - start,
            "stand.torque": float(recorded.torque_shares(RobotModel()).max()),
            "stand.height": 1000.0 * abs(float(recorded.p_world_com[-1, 2]) - STAND_HEIGHT),
            "stand.tilt": math.degrees(robot.plant.truth().tilt),
        }
        failure = standing_failure(robot)
    return Measurement(values, {} if failure is None else {"stand.height": failure})


def measure_pushes(trial: Trial) -> Measurement:
    """Largest impulse on the base, in the worst of a metric's directions, that is survived.

    Survived is: 3 s later the robot stands (see ``standing_failure``), and never left standing
    mode, in which no foot is ever swung. A pushed robot may rock onto two feet, and the other two
    come down elsewhere: ``MOVED`` says how far, for impulses up to the thresholds.
    """
    trial = replace(trial, has_nominal_friction=True)
    moved = [0.0]

    def failure_of(impulse: float, direction: str) -> str | None:
        with TrialRobot(trial) as robot:
            try:
                robot.require(robot.go2.stand())
                feet = robot.plant.p_world_feet
                robot.push(force_of(impulse, direction), PUSH_TIME)
                robot.wait(RECOVERY_TIME)
            except TrialFailed as failed:
                return str(failed)
            steps = (robot.plant.p_world_feet - feet)[:, :2]
            if impulse <= max(m.threshold or 0.0 for m in PUSHED if direction in directions_of(m)):
                moved.append(float(np.linalg.norm(steps, axis=1).max()))
            if robot.go2.mode is not Mode.STANDING:
                return f"the robot is {robot.go2.mode.value}"
            return standing_failure(robot)

    found = measure_impulses(PUSHED, failure_of)
    return Measurement({**found.values, MOVED.name: 1000.0 * max(moved)}, found.failures)


STAND = Study("stand", STAND_METRICS, measure_stand)
PUSHES = Study("stand-pushes", (*PUSHED, MOVED), measure_pushes)
