"""``python -m benchmarks speed``: what things cost in processor time.

Ratios come from interleaved measurements (A B A B ...) of the same states in one process, so that
what else the machine does falls on all alike. Bars in microseconds are meant for one machine, by
the time that PlaCo takes on it, and are scaled to the one that measures. Wants an idle machine all
the same.
"""

from __future__ import annotations

import os
import resource
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Mapping
from functools import partial
from statistics import median

import numpy as np

from benchmarks import speed_solves, speed_ticks
from benchmarks.command import Benchmark
from benchmarks.store import ROOT
from benchmarks.study import Measurement, Metric, Study
from controller.sweeps.trials import Trial, TrialFailed
from go2_wbc.motion_plan import MotionPlan
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
PROCESSES = 5
"""Fresh processes of a trial; the median counts."""
ROBOT = "from controller import GO2Controller; go2 = GO2Controller()"
STAND = f"{ROBOT}; raise SystemExit(not go2.stand())"
DEMO = "from controller.cli.main import main; raise SystemExit(main(['demo', '--no-media']))"
LIBRARIES = "import numpy, pinocchio, mujoco, numba"
STARTS: dict[str, tuple[str, str, float | None]] = {
    "robot": ("`from controller import GO2Controller; GO2Controller()`", ROBOT, 0.7),
    "stand": ("the same, and `stand()`", STAND, 1.5),
    "libraries": (f"`{LIBRARIES}`: what a robot imports", LIBRARIES, None),
    "demo": ("`go2-wbc demo --no-media`, to its end", DEMO, 5.0),
}
"""What is started: its name, its code, and the processor time [s] that it may take."""
_NO_BYTECODE = "PYTHONDONTWRITEBYTECODE"
"""Kept from the processes: a user's Python compiles a module once, not at every start."""
START_METRICS = tuple(
    metric
    for name, (item, _, most) in STARTS.items()
    for metric in (
        Metric(f"startup.{name}.cpu", item, "processor time", "s", most),
        Metric(f"startup.{name}.wall", item, "time by the clock", "s", None),
    )
)


# --- checking a motion ----------------------------------------------------------------------------


def lively_motion(seconds: float) -> Timeline:
    """Trunk, feet and balance in turn, over and over for about that long."""
    unit = Timeline().body(pitch=0.1, z=-0.02, over=0.5).body(roll=0.05, over=0.5)
    for foot in ("FR", "FL"):
        unit = unit.foot(foot, z=0.06, over=0.5).down(foot, over=0.5)
    unit = unit.home(over=1.0)
    return unit.repeat(max(round(seconds / unit.end), 1))


def measure_checks(_trial: Trial) -> Measurement:
    """Median of compiling and checking a motion of the library, a short and a long one."""
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


# --- how long a user waits: for a robot, for it to stand, for the demo's table --------------------


def measure_startup(_trial: Trial) -> Measurement:
    """Each start a few times in turn; the first of all, which may compile, does not count."""
    spent: dict[str, list[tuple[float, float]]] = {name: [] for name in STARTS}
    started(ROBOT)
    for _ in range(PROCESSES):
        for name, (_, code, _) in STARTS.items():
            spent[name].append(started(code))
    values: dict[str, float] = {}
    for name, times in spent.items():
        cpu, wall = (median(column) for column in zip(*times, strict=True))
        values |= {f"startup.{name}.cpu": cpu, f"startup.{name}.wall": wall}
    return Measurement(values)


def started(code: str) -> tuple[float, float]:
    """Processor time and time by the clock [s] of a process that runs ``code``.

    Raises:
        TrialFailed: if it fails.
    """
    environment = {name: value for name, value in os.environ.items() if name != _NO_BYTECODE}
    environment["PYTHONPATH"] = str(ROOT)
    with tempfile.TemporaryDirectory() as folder:
        before, start = _children_time(), time.perf_counter()
        command = [sys.executable, "-c", code]
        done = subprocess.run(
            command, env=environment, cwd=folder, capture_output=True, text=True, check=False
        )
        wall = time.perf_counter() - start
    if done.returncode:
        raise TrialFailed(f"`{code}` failed: {(done.stderr.splitlines() or [''])[-1]}")
    return _children_time() - before, wall


def _children_time() -> float:
    used = resource.getrusage(resource.RUSAGE_CHILDREN)
    return used.ru_utime + used.ru_stime


STUDIES = (
    Study("solves", speed_solves.METRICS, speed_solves.measure_solves),
    Study("ticks", speed_ticks.TICK_METRICS, speed_ticks.measure_ticks),
    Study("estimated", speed_ticks.ESTIMATED_METRICS, speed_ticks.measure_estimated),
    Study("parts", speed_ticks.PART_METRICS, speed_ticks.measure_parts),
    Study("commands", speed_ticks.COMMAND_METRICS, speed_ticks.measure_commands),
    Study("checks", CHECK_METRICS, measure_checks),
    Study("startup", START_METRICS, measure_startup),
    Study("realtime", speed_ticks.REALTIME_METRICS, speed_ticks.measure_realtime),
)
BENCHMARK = Benchmark(
    "speed",
    "Processor time of the whole-body QP beside PlaCo's on the same states in turn,\n"
    "of whole ticks with 2 ms of physics, of checking a motion, of starts; and ticks\n"
    "late at the pace of the wall clock. Wants an idle machine.",
    STUDIES,
    takes="ten minutes",
    examples=(
        "solves ticks --runs 5",
        "--json --out speed.json",
    ),
    runs=3,
)
register, run = BENCHMARK.register, BENCHMARK.run
