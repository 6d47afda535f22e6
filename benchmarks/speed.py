"""``python -m benchmarks speed``: what things cost in processor time.

Ratios come from interleaved measurements (A B A B ...) of the same states in one process, so that
what else the machine does falls on all alike. Bars in microseconds are meant for one machine, by
the time that PlaCo takes on it, and are scaled to the one that measures. Wants an idle machine all
the same.
"""

import os
import resource
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable
from contextlib import closing
from functools import partial
from pathlib import Path
from statistics import median

import numpy as np
from jaxtyping import Float32

from benchmarks import speed_solves, speed_ticks
from benchmarks.command import ROOT, Benchmark
from benchmarks.robots import checker
from benchmarks.speed_solves import timed
from benchmarks.study import Study, TrialResult
from controller.learning import ENVIRONMENTS, Go2Env, Go2VectorEnv, read_dataset, record
from controller.observation import ACTIONS, RATE
from controller.sweeps.trials import Trial, TrialFailed
from motions import Timeline, compile_timeline, load_motion

ROUNDS = 9  #: Times that every motion is compiled and checked, in turn with the others
LIBRARY = "tap_dance"
"""The motion of the library that costs most to compile: it raises a foot every other second."""
LENGTHS = (10, 40)
"""Lengths [s] of the generated motions; that the work grows as they do, a test says by counting."""
CHECK_BAR = 60.0  #: Greatest cost [ms] of checking 10 s of motion, with its probability
CHECKS = {
    f"10 s of motion: {motion}": (
        (f"check.{motion}", "check", f"<= {CHECK_BAR:g} ms"),
        (f"compile.{motion}", "compile", "ms"),
    )
    for motion in (LIBRARY, *(f"{seconds} s" for seconds in LENGTHS))
}
PROCESSES = 5  # Fresh processes of a trial; the median counts
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
STARTED = {
    item: (
        (f"{name}.cpu", "processor time", "s" if most is None else f"<= {most:g} s"),
        (f"{name}.wall", "time by the clock", "s"),
    )
    for name, (item, _, most) in STARTS.items()
}

STEPS = 1000  #: Of each measurement
IN_TURN = 5  #: One, two and many environments in turn
MANY = 8
SPREAD = 0.3  #: Of the random actions: the robot stumbles about and rarely falls
LEARNING = {
    "one environment, 50 actions a second, processor time": tuple(
        (f"{name}.{kind}", f"{name}, {kind}: times real time", bar)
        for name in ENVIRONMENTS
        for kind, bar in zip(ACTIONS, (">= 20", ">="), strict=True)
    ),
    "environments together, on two cores": (
        ("two", "two, times one, by the clock", ">= 1.8"),
        ("many", f"{MANY}, times one, by the clock", ">="),
    ),
}
MINUTES = 10.0
DATASET = {
    f"data set of {MINUTES:g} minutes of the trot, on two cores": (
        ("time", "time by the clock", "<= 60 s"),
        ("rows", "rows", ">= 30000"),
    )
}


def lively_motion(seconds: float) -> Timeline:
    """Trunk, feet and balance in turn, over and over for about that long."""
    unit = Timeline().body(pitch=0.1, z=-0.02, over=0.5).body(roll=0.05, over=0.5)
    for foot in ("FR", "FL"):
        unit = unit.foot(foot, z=0.06, over=0.5).down(foot, over=0.5)
    unit = unit.home(over=1.0)
    return unit.repeat(max(round(seconds / unit.end), 1))


def measure_checks(_trial: Trial, found: TrialResult) -> None:
    """Median of compiling and checking a motion of the library, a short and a long one."""
    lines = {LIBRARY: load_motion(LIBRARY)}
    lines |= {f"{seconds} s": lively_motion(seconds) for seconds in LENGTHS}
    acts: dict[str, tuple[float, Callable[[], object]]] = {}
    for name, line in lines.items():
        plan = compile_timeline(line, checker().model)
        checker().check(plan)  # what is prepared once for a robot is not counted
        check = partial(lambda plan: checker().check(plan).probability, plan)
        acts[f"check.{name}"] = line.end, check
        acts[f"compile.{name}"] = line.end, partial(compile_timeline, line, checker().model)
    rounds = [{n: timed(act, 1)[0] / end for n, (end, act) in acts.items()} for _ in range(ROUNDS)]
    found.values = {n: float(np.median([spent[n] for spent in rounds])) / 100.0 for n in acts}


def measure_startup(_trial: Trial, found: TrialResult) -> None:
    """Each start a few times in turn; the first of all, which may compile, does not count."""
    spent: dict[str, list[tuple[float, float]]] = {name: [] for name in STARTS}
    started(ROBOT)
    for _ in range(PROCESSES):
        for name, (_, code, _) in STARTS.items():
            spent[name].append(started(code))
    for name, times in spent.items():
        cpu, wall = (median(column) for column in zip(*times, strict=True))
        found.values |= {f"{name}.cpu": cpu, f"{name}.wall": wall}


def started(code: str) -> tuple[float, float]:
    """Processor time and time by the clock [s] of a process that runs ``code``.

    Raises:
        TrialFailed: if it fails.
    """
    environment = {**os.environ, "PYTHONPATH": str(ROOT)}
    environment.pop("PYTHONDONTWRITEBYTECODE", None)  # a user's Python compiles a module once
    command = [sys.executable, "-c", code]
    with tempfile.TemporaryDirectory() as folder:
        before, start = _children_time(), time.perf_counter()
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


def measure_environments(_trial: Trial, found: TrialResult) -> None:
    """Random actions; what a reset after a fall takes is in it."""
    actions = np.random.default_rng(0).uniform(-SPREAD, SPREAD, (STEPS, MANY, 12))
    actions = actions.astype(np.float32)
    for name, task in ENVIRONMENTS.items():
        for kind in ACTIONS:
            with closing(Go2Env(task, kind)) as environment:
                _spent(environment, actions[:50], time.process_time)
                spent = _spent(environment, actions, time.process_time)
                found.values[f"{name}.{kind}"] = STEPS / RATE / spent
    together = [closing(Go2VectorEnv(count, workers=2)) for count in (2, MANY)]
    with closing(Go2Env()) as one, together[0] as two, together[1] as many:
        ratios = [
            [_spent(one, actions) * envs.num_envs / _spent(envs, actions) for envs in (two, many)]
            for _ in range(IN_TURN)
        ]
    found.values |= dict(zip(("two", "many"), np.median(ratios, axis=0).tolist(), strict=True))


def _spent(
    environment: Go2Env | Go2VectorEnv,
    actions: Float32[np.ndarray, "n k 12"],
    clock: Callable[[], float] = time.perf_counter,
) -> float:
    """Time [s] that all steps take."""
    is_one = isinstance(environment, Go2Env)
    environment.reset(seed=0)
    start = clock()
    for action in actions:
        if is_one:
            _, _, has_fallen, is_late, _ = environment.step(action[0])
            if has_fallen or is_late:
                environment.reset()
        else:
            environment.step(action[: environment.num_envs])
    return clock() - start


def measure_dataset(_trial: Trial, found: TrialResult) -> None:
    """Ten minutes of robot time; starting the processes is in it."""
    with tempfile.TemporaryDirectory() as folder:
        start = time.perf_counter()
        path = record(Path(folder, "trot.parquet"), minutes=MINUTES, workers=2)
        found.values["time"] = time.perf_counter() - start
        rows = read_dataset(path)
    if rows["fell"].any():
        raise TrialFailed(f"the expert fell in {len(set(rows['seed'][rows['fell']]))} episodes")
    found.values["rows"] = float(len(rows))


STUDIES = (
    Study("solves", speed_solves.TABLE, speed_solves.measure_solves, "solve"),
    Study("ticks", speed_ticks.TICKS, speed_ticks.measure_ticks, "tick"),
    Study("estimated", speed_ticks.ESTIMATED, speed_ticks.measure_estimated),
    Study("commands", speed_ticks.COMMANDS, speed_ticks.measure_commands),
    Study("sight", speed_ticks.SIGHT, speed_ticks.measure_sight),
    Study("checks", CHECKS, measure_checks, ""),
    Study("startup", STARTED, measure_startup),
    Study("environments", LEARNING, measure_environments),
    Study("dataset", DATASET, measure_dataset),
    Study("realtime", speed_ticks.REALTIME, speed_ticks.measure_realtime),
)
run = Benchmark(
    "speed",
    "Processor time of the whole-body QP beside PlaCo's on the same states in turn,\n"
    "of whole ticks with 2 ms of physics, of checking a motion, of starts, of\n"
    "environments and data sets for learners (extra [learning]); and ticks\n"
    "late at the pace of the wall clock. Wants an idle machine.",
    STUDIES,
    takes="ten minutes",
    examples=("solves ticks --runs 5", "--json --out speed.json"),
    runs=3,
).run
