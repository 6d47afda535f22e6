"""What checking and compiling a motion costs, in processor time of one thread."""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping
from functools import partial

import numpy as np

from benchmarks.scenario import Measurement, Metric
from controller.sweeps.trials import Trial
from go2_wbc.reference import MotionPlan
from go2_wbc.robot.model import RobotModel
from motions import FeasibilityChecker, Timeline, compile_timeline, load_motion

ROUNDS = 9
"""Times that every motion is compiled and checked, in turn with the others."""
LIBRARY = "tap_dance"
"""The motion of the library that costs most to compile: it raises a foot every other second."""
LENGTHS = (10, 40)
"""Lengths [s] of the generated motions; that the work grows as they do, a test says by counting."""
CHECK_BAR = 60.0
"""Greatest cost [ms] of checking 10 s of motion, with its probability."""

_MOTIONS = (LIBRARY, *(f"{seconds} s" for seconds in LENGTHS))
CHECK_METRICS = tuple(
    metric
    for motion in _MOTIONS
    for metric in (
        Metric(f"check.{motion}", f"10 s of motion: {motion}", "check", "ms", CHECK_BAR),
        Metric(f"compile.{motion}", f"10 s of motion: {motion}", "compile", "ms", None),
    )
)


def lively_motion(seconds: float) -> Timeline:
    """Trunk, feet and balance in turn, over and over for about that long."""
    unit = Timeline().body(pitch=0.1, z=-0.02, over=0.5).body(roll=0.05, over=0.5)
    for foot in ("FR", "FL"):
        unit = unit.foot(foot, z=0.06, over=0.5).down(foot, over=0.5)
    unit = unit.home(over=1.0)
    return unit.repeat(max(round(seconds / unit.end), 1))


def measure_checks(trial: Trial) -> Measurement:
    """Median of compiling and checking a motion of the library, a short and a long one."""
    del trial  # nothing is drawn
    model = RobotModel()
    checker = FeasibilityChecker(model)
    lines = [load_motion(LIBRARY), *(lively_motion(seconds) for seconds in LENGTHS)]
    motions = dict(zip(_MOTIONS, lines, strict=True))
    acts: dict[str, Callable[[], object]] = {}
    durations: dict[str, float] = {}
    for name, line in motions.items():
        plan = compile_timeline(line, model)
        checker.check(plan)  # what is prepared once for a robot is not counted
        acts[f"check.{name}"] = partial(_chance, checker, plan)
        acts[f"compile.{name}"] = partial(compile_timeline, line, model)
        durations[f"check.{name}"] = durations[f"compile.{name}"] = line.end
    return Measurement(_medians(acts, durations))


def _chance(checker: FeasibilityChecker, plan: MotionPlan) -> float:
    """Check a plan, and say how likely it is done."""
    return checker.check(plan).probability


def _medians(
    acts: Mapping[str, Callable[[], object]], durations: Mapping[str, float]
) -> dict[str, float]:
    """Median cost [ms] of each act for 10 s of motion."""
    spent: dict[str, list[float]] = {name: [] for name in acts}
    for _ in range(ROUNDS):
        for name, act in acts.items():
            start = time.thread_time_ns()
            act()
            spent[name].append((time.thread_time_ns() - start) / 1e6)
    return {name: float(np.median(s)) * 10.0 / durations[name] for name, s in spent.items()}
