"""Standing up from lying, and standing against pushes without a step."""

from __future__ import annotations

import math

import numpy as np

from benchmarks.pushes import PUSH_TIME, Heading, force_of, measure_rungs, push_rows
from benchmarks.rows import Family, Measurement, Row
from benchmarks.trials import Failed, Subject, Trial
from controller.modes import Mode
from go2_wbc.robot.model import RobotModel
from motions.postures import STAND_HEIGHT

RECOVERY_TIME = 3.0
"""Time [s] after a push within which the robot must stand again."""
HEIGHT_TOLERANCE = 0.02
TILT_TOLERANCE = math.radians(6.0)
LOAD = 5.0
"""Force [N] on a foot that counts as loaded; a standing foot carries about 40 N."""

_RISE = "lying -> standing"

STAND_ROWS = (
    Row("stand.time", _RISE, "time", "s", 3.0),
    Row("stand.torque", _RISE, "peak torque / limit", "", 0.4),
    Row("stand.height", _RISE, "final CoM height off", "mm", 5.0),
    Row("stand.tilt", _RISE, "final tilt", "deg", None),
)
_PUSH = "standing, push 0.1 s without a step"
PUSH_ROWS = push_rows("stand.push", _PUSH, lateral=14.0, forward=18.0)
MOVED = Row("stand.push_moved", _PUSH, "a foot moved, up to the bar", "mm", None)


def standing_fault(robot: Subject) -> str | None:
    """What the truth finds missing for standing, or None.

    Standing is: CoM within 20 mm of its height, tilt below 6 deg, every foot loaded.
    """
    state, height = robot.plant.read(), float(robot.truth.p_world_com[2])
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
    with Subject(trial) as robot:
        start = robot.plant.time
        try:
            robot.require(robot.go2.stand())
        except Failed as failed:
            return Measurement({}, reason=str(failed))
        track = robot.truth.track()
        values = {
            "stand.time": robot.plant.time - start,
            "stand.torque": float((np.abs(track.tau) / RobotModel().torque_limits).max()),
            "stand.height": 1000.0 * abs(float(track.p_world_com[-1, 2]) - STAND_HEIGHT),
            "stand.tilt": math.degrees(robot.plant.read().tilt),
        }
        fault = standing_fault(robot)
    return Measurement(values, {} if fault is None else {"stand.height": fault})


def measure_pushes(trial: Trial) -> Measurement:
    """Largest impulse on the base, in the worst of the row's directions, that is survived.

    Survived is: 3 s later the robot stands (see ``standing_fault``), and never left standing mode,
    in which no foot is ever swung. A pushed robot may rock onto two feet, and the other two come
    down elsewhere: the last row says how far from where they were, for impulses up to the bars.
    """
    trial = Trial(trial.seed, has_nominal_friction=True)
    moved = [0.0]

    def fault_of(impulse: float, direction: Heading) -> str | None:
        with Subject(trial) as robot:
            try:
                distance, fault = _push_standing(robot, impulse, direction)
            except Failed as failed:
                return str(failed)
        if impulse <= _bar_towards(direction):
            moved.append(distance)
        return fault

    found = measure_rungs(PUSH_ROWS, fault_of)
    return Measurement({**found.values, MOVED.name: 1000.0 * max(moved)}, found.failures)


def _bar_towards(direction: Heading) -> float:
    return max(item.row.bar or 0.0 for item in PUSH_ROWS if direction in item.directions)


def _push_standing(robot: Subject, impulse: float, direction: Heading) -> tuple[float, str | None]:
    """How far [m] a foot moved, and what was wrong in the end, if anything."""
    robot.require(robot.go2.stand())
    feet = robot.plant.p_world_feet
    robot.push(force_of(impulse, direction), PUSH_TIME)
    robot.wait(RECOVERY_TIME)
    distance = float(np.linalg.norm((robot.plant.p_world_feet - feet)[:, :2], axis=1).max())
    if robot.go2.mode is not Mode.STANDING:
        return distance, f"the robot is {robot.go2.mode.value}"
    return distance, standing_fault(robot)


STAND = Family("stand", STAND_ROWS, measure_stand)
PUSHES = Family("stand-pushes", (*(item.row for item in PUSH_ROWS), MOVED), measure_pushes)
