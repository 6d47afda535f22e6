"""What physics makes of a motion, played in MuJoCo whatever the check says.

And at which amplitude it changes its mind: bisected by playing, and kept in a file.
"""

import json
import math
from collections.abc import Callable, Mapping, Sequence
from functools import partial
from pathlib import Path

from benchmarks.study import Study, TrialResult
from benchmarks.validation_set.questions import Question, draws
from controller.motion_measurement import (
    FELL,
    MOMENT,
    SLIP,
    UNPLANNED,
    MotionMeasurement,
    failures_of,
    measure_motion,
    short_legs,
)
from controller.sweeps.targets import digest
from controller.sweeps.trials import Trial, TrialFailed, TrialRobot
from go2_wbc.errors import ConfigError
from go2_wbc.files import write_atomically
from go2_wbc.motion_plan import MotionPlan
from go2_wbc.plant import MujocoPlant
from go2_wbc.robot.model import RobotModel

FRICTION = 0.5  #: Friction coefficient of the floor: the one that the check counts on
NEAR, NEAR_SOLVED = 1.06, 1.13
"""Ratio of amplitudes, one done and one failed, at which the search ends."""
STEP, STEP_SOLVED = 1.6, 1.25  # Ratio of amplitudes in the search for two that differ
BORDER, PLAYS = "border", "plays"
BORDERS_FILE = Path(__file__).parent / "borders.json"
STRICT, STOPS, LENIENT = "strict", "stops", "lenient"
"""Definitions of what has gone wrong, besides ``FELL``. Strict is what an author sees: not done, or
not as it was written. Stops is the same, or a joint was pressed against its stop: MuJoCo's hold a
joint within 0.02 rad of its limit, so a motion that asks for more often looks done. Lenient are
distances from the plan, with more room, whatever ``play`` says."""
LENIENT_OFF = 0.05  #: Distance [m] that anything may be off what was written, leniently
Failures = Mapping[str, tuple[str, ...]]
"""What went wrong, in words, by each definition; nothing did where it is empty."""


def verdicts_of(run: MotionMeasurement, plan: MotionPlan) -> Failures:
    """Judge what was measured by all definitions."""
    strict = failures_of(run, plan)
    fell = (FELL,) if run.fall is not None else ()
    if UNPLANNED in strict:
        return {STRICT: strict, STOPS: strict, LENIENT: strict, FELL: fell}
    pressed = (f"on a stop {1e3 * run.stopped:.0f} ms",) if run.stopped > MOMENT else ()
    off = max(run.tracking, run.ends_off, run.feet_off, short_legs(plan) - run.feet_off)
    leniently = {
        FELL: bool(fell),
        f"slip {1e3 * run.slip:.0f} mm": run.slip > SLIP,
        f"{1e3 * off:.0f} mm off": off > LENIENT_OFF,
        f"touch {1e3 * run.touched:.0f} ms": run.touched > MOMENT,
        f"saturated {1e3 * run.saturated:.0f} ms": run.saturated > MOMENT,
        f"joint {-run.joint_distance:.3f} rad past": run.joint_distance < 0.0,
        f"joint at {100.0 * run.speed:.0f} % speed": run.speed > 1.0,
    }
    lenient = tuple(what for what, is_so in leniently.items() if is_so)
    return {STRICT: strict, STOPS: (*strict, *pressed), LENIENT: lenient, FELL: fell}


def play(
    plan: MotionPlan, model: RobotModel, seed: int, sensors: str = "ideal"
) -> MotionMeasurement:
    """Play a plan, unchecked, from its entry posture, on a plant of these ``sensors``.

    Raises:
        TrialFailed: if the robot does not get ready.
    """
    with TrialRobot(MujocoPlant(friction=FRICTION, seed=seed, sensors=sensors)) as robot:
        robot.get_ready(plan.entry)
        return measure_motion(robot.go2, robot.truth, plan, model)


def is_done(question: Question) -> bool:
    """Whether physics does a motion, by the strict definition."""
    model = RobotModel()
    plan = question.plan(model)
    return not failures_of(play(plan, model, question.draw), plan)


def measure_border(trial: Trial, found: TrialResult, numbers: Sequence[int]) -> None:
    """The border of the draw that has this place among ``numbers``, or why there is none."""
    family, number = draws()[numbers[trial.seed]]
    step, near = (STEP_SOLVED, NEAR_SOLVED) if family.is_dynamic else (STEP, NEAR)
    found.values[PLAYS] = 0.0

    def is_right(amplitude: float) -> bool:
        found.values[PLAYS] += 1.0
        return is_done(Question(family, number, amplitude))

    found.values[BORDER] = bisected(is_right, family.low, family.high, step, near)


def bisected(
    is_done: Callable[[float], bool], low: float, high: float, step: float, near: float
) -> float:
    """The amplitude from which on it is not done: stepwise from 1, then by bisection.

    Args:
        is_done: asks physics.
        low, high: between which it is looked for.
        step: ratio of the first amplitudes.
        near: ratio of one that is done and one that failed at which the search ends.

    Raises:
        TrialFailed: if physics does not change its mind there.
    """
    done, failed, middle = low, high, 1.0
    is_low_done = is_high_failed = False
    while not (is_low_done and is_high_failed) or failed / done > near:
        if is_done(middle):
            done, is_low_done = middle, True
        else:
            failed, is_high_failed = middle, True
        if is_low_done and is_high_failed:
            middle = math.sqrt(done * failed)
        elif middle in (low, high):
            why = "even the highest amplitude is done" if is_low_done else "the lowest one fails"
            raise TrialFailed(why)
        else:
            middle = min(max(middle * step if is_low_done else middle / step, low), high)
    return math.sqrt(done * failed)


def borders_of(numbers: Sequence[int]) -> Study:
    """The trials that bisect the draws of these numbers."""
    rows = ((BORDER, "amplitude at which physics fails", ""), (PLAYS, "motions played", ""))
    name, measure = digest(repr(numbers).encode()), partial(measure_border, numbers=numbers)
    return Study(f"borders {name}", {"border": rows}, measure, prefix="")


def read_borders(path: Path = BORDERS_FILE) -> dict[str, float | None]:
    """The amplitudes at which physics changes its mind, by draw.

    Raises:
        ConfigError: if the file is missing or damaged.
    """
    try:
        kept = dict(json.loads(path.read_text()))
    except (OSError, ValueError, TypeError) as error:
        raise ConfigError(
            f"{path}: cannot be read: {error}; make it anew with --borders"
        ) from error
    return {name: None if flip is None else float(flip) for name, flip in kept.items()}


def borders_version(path: Path = BORDERS_FILE) -> str:
    """A short hash of the file of borders: with others, the exam asks other questions."""
    return digest(path.read_bytes())[:8] if path.exists() else "none"


def write_borders(borders: Mapping[str, float | None], path: Path = BORDERS_FILE) -> None:
    """Keep borders, one a line."""
    rows = {name: value and round(value, 4) for name, value in borders.items()}
    write_atomically(path, (json.dumps(rows, indent=0) + "\n").encode())
