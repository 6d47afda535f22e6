"""Pushes of a robot that stands or trots, and how large an impulse it survives."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import replace

import numpy as np

from benchmarks.robots import PUSH_TIME, force_of, standing_failure
from benchmarks.study import Metric, Rows, Study, TrialResult
from controller.modes import Mode
from controller.sweeps.studies import set_off
from controller.sweeps.trials import Trial, TrialFailed, TrialRobot
from go2_wbc.contacts import GAITS
from go2_wbc.planning.command import VelocityCommand

IMPULSE_STEP = 2.0  # N s between the impulses that are tried
STANDS_AFTER, TROTS_AFTER = 3.0, 2.0
"""Time [s] after a push within which the robot must stand, or trot, again."""
START_TIME = 1.5  # Time [s] from the command to trot to the first push
PHASES = 8
"""Instants of the stride, evenly spread, at which the trotting robot is pushed."""
PUSHED_SPEED, SPEED_TOLERANCE = 0.5, 0.15
"""Speed [m/s], and error of its mean over the last two strides that counts as trotting again."""
DIRECTIONS = {
    "push_lateral": ("left", "right"),
    "push_forward": ("forward",),
    "push_backward": ("backward",),
}
"""In which an impulse must be survived, by row."""
FailureOf = Callable[[float, str], str | None]
"""Pushes a robot with an impulse [N s] in a direction; says what went wrong, or None."""


def measure_impulses(rows: Rows, failure_of: FailureOf, found: TrialResult) -> None:
    """Search the largest impulse of every row, from its threshold or the last one on.

    A row below its threshold counts as failed, with what went wrong at the least impulse.
    """
    first = 0.0
    for name, quantity, bar in rows:
        threshold = Metric.of(name, "", quantity, bar).threshold
        first, failures = threshold or first, dict[float, str]()

        def survives(impulse: float, name: str = name, lost: dict[float, str] = failures) -> bool:
            for direction in DIRECTIONS[name]:
                if failure := failure_of(impulse, direction):
                    lost[impulse] = f"{impulse:g} N s {direction}: {failure}"
                    return False
            return True

        largest = found.values[name] = largest_impulse(survives, first)
        if threshold is not None and largest < threshold:
            found.failures[name] = failures[min(failures)]


def largest_impulse(survives: Callable[[float], bool], first: float) -> float:
    """The largest impulse [N s] that is survived, beginning at ``first``.

    From a survived first impulse it goes one step up, and what lies beyond is not looked for; from
    one that is not, down until one is. Zero if none is.
    """
    impulse = first
    while impulse > 0.0 and not survives(impulse):
        impulse -= IMPULSE_STEP
    if impulse == first and survives(first + IMPULSE_STEP):
        return first + IMPULSE_STEP
    return max(impulse, 0.0)


STANDING = (
    ("push_lateral", "lateral impulse", ">= 14 N s"),
    ("push_forward", "forward impulse", ">= 18 N s"),
    ("push_backward", "backward impulse", ">= N s"),
)
TO_THRESHOLD = {"left": 14.0, "right": 14.0, "forward": 18.0}
MOVED = ("push_moved", "a foot moved, to threshold", "mm")
TROTTING = (
    ("push_lateral", "lateral impulse", ">= 18 N s"),
    ("push_forward", "forward impulse", ">= 24 N s"),
    ("push_backward", "backward impulse", ">= N s"),
)


def measure_standing(trial: Trial, found: TrialResult) -> None:
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
                robot.wait(STANDS_AFTER)
            except TrialFailed as failed:
                return str(failed)
            steps = (robot.plant.p_world_feet - feet)[:, :2]
            if impulse <= TO_THRESHOLD.get(direction, 0.0):
                moved.append(float(np.linalg.norm(steps, axis=1).max()))
            if robot.go2.mode is not Mode.STANDING:
                return f"the robot is {robot.go2.mode.value}"
            return standing_failure(robot)

    measure_impulses(STANDING, failure_of, found)
    found.values[MOVED[0]] = 1000.0 * max(moved)


def measure_trotting(trial: Trial, found: TrialResult) -> None:
    """Largest impulse on the base that is survived at every phase, in a metric's directions.

    The phases are eight instants of the stride, evenly spread. Survived is: 2 s later the robot is
    upright, and its mean velocity over the last two strides is within 0.15 m/s of the command.
    """
    trial = replace(trial, has_nominal_friction=True)
    trotting: list[TrialRobot] = []  # one for many pushes; after a failure a new one

    def failure_of(impulse: float, direction: str) -> str | None:
        lost: list[str] = []
        for phase in range(PHASES):
            try:
                if not trotting:
                    trotting.append(TrialRobot(trial))
                    set_off(trotting[0], "trot", VelocityCommand(PUSHED_SPEED))
                    trotting[0].wait(START_TIME)
                _push(trotting[0], force_of(impulse, direction), phase)
            except TrialFailed as failed:
                trotting.pop().close()
                lost.append(f"phase {phase}: {failed}")
        return "; ".join(lost) or None

    try:
        measure_impulses(TROTTING, failure_of, found)
    finally:
        for robot in trotting:
            robot.close()


def _push(robot: TrialRobot, force: np.ndarray, phase: int) -> None:
    period = GAITS["trot"].period
    # The gait's clock started with the command, when the truth was cleared.
    elapsed = robot.plant.time - robot.truth.start
    phase_time = phase * period / PHASES
    target = phase_time + math.ceil((elapsed - phase_time) / period) * period
    robot.wait(max(target - elapsed, 0.0))
    robot.push(force, PUSH_TIME)
    robot.wait(TROTS_AFTER)
    strides = robot.truth.recording(since=robot.plant.time - 2.0 * period)
    speed = float(strides.com_velocity[:, 0].mean())
    if abs(speed - PUSHED_SPEED) > SPEED_TOLERANCE:
        raise TrialFailed(f"walks at {speed:.2f} m/s two seconds after the push")


STAND_PUSHES = Study(
    "stand-pushes",
    {"standing, push 0.1 s without a step": (*STANDING, MOVED)},
    measure_standing,
    "stand",
)
TROT_PUSHES = Study(
    "trot-pushes", {"trot 0.5 m/s, push 0.1 s, 8 phases": TROTTING}, measure_trotting, "trot"
)
