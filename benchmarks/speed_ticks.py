"""What whole control ticks cost, 2 ms of physics included: by mode and part, at worst, in memory.

A tick that is late, or ten times longer than the others, may be ours or the machine's; where a bare
loop beside it, whose work allocates nothing, has as many of them, it is the machine's.
"""

from __future__ import annotations

import gc
import hashlib
import sys
import time
import tracemalloc
from collections.abc import Callable, Iterator
from contextlib import closing, contextmanager
from functools import partial
from typing import Any

import numpy as np
from jaxtyping import Float

from benchmarks.speed_solves import recorded_ticks, slowness
from benchmarks.study import Direction, Measurement, Metric
from controller.assembly import build_pilot
from controller.go2_controller import GO2Controller
from controller.modes import Aborted
from controller.pacing import Pacer
from controller.sweeps.trials import Trial, TrialFailed
from go2_wbc.config import Config
from go2_wbc.planning.command import VelocityCommand
from go2_wbc.plant import MujocoPlant

PERIOD = 2000.0
"""Robot time [us] of a tick."""
MODES = ("stand", "trot", "high five", "bow", "sit", "lie down")
TROT_TIME = 100.0
"""Time [us] that a tick of the trot may take."""
FACTORS = dict.fromkeys(MODES, 15.0) | {"trot": 18.0}
"""Real-time factor to be reached in each mode."""
COMMAND_TIME = 60.0
"""Robot time [s] of random velocity commands, a new one each second."""
FASTEST = (1.0, 0.4, 1.5)
"""Ahead and sideways [m/s], turning [rad/s]: the greatest of these commands."""
ESTIMATED_TIME, PARTS_TIME = 10.0, 4.0
"""Robot time [s] of the trot on sensors, and of the one whose parts are timed."""
REAL_TIME = 60.0
"""Time [s] of the trot at the wall clock's pace."""
REPEATS = 3
"""How often the same walk is done."""
TRACED_TICKS = 500
"""Ticks whose memory is traced."""
CALIBRATION_CALLS = 200
"""Calls by which a piece of bare work is measured."""
GIVEN_UP = 1.0
"""Lag [s] from which on the pace is given up: never in a run that means anything."""
PARTS = {
    "read": "read the plant",
    "snapshot": "dynamics of the state",
    "update": "planner",
    "solve": "QP",
    "write": "write, with 2 ms of physics",
    "record": "telemetry",
}
"""Methods of a tick, and what they do."""

_ITEM, _LEAST = "whole tick, 2 ms of physics: {}", Direction.AT_LEAST


def _tick_metrics(mode: str) -> tuple[Metric, ...]:
    item, most = _ITEM.format(mode), TROT_TIME if mode == "trot" else None
    return (
        Metric(f"tick.{mode}.median", item, "median", "us", None),
        Metric(f"tick.{mode}.p99", item, "99 of 100", "us", None),
        Metric(f"tick.{mode}.scaled", item, "median, scaled", "us", most),
        Metric(f"tick.{mode}.factor", item, "real-time factor, scaled", "", FACTORS[mode], _LEAST),
    )


TICK_METRICS = (
    Metric("tick.slowness", "scale: PlaCo's tick on two feet", "of 43 us", "", None),
    *(metric for mode in MODES for metric in _tick_metrics(mode)),
)
_COMMANDS = "60 s of random velocity commands"
COMMAND_METRICS = (
    Metric("commands.median", _COMMANDS, "tick, median", "us", None),
    Metric("commands.p99", _COMMANDS, "99 of 100, by median", "", None),
    Metric("commands.worst", _COMMANDS, "worst by median", "", 5.0),
    Metric("commands.least", _COMMANDS, "worst of the least of three runs", "", None),
    Metric("commands.bare", _COMMANDS, "of a bare loop beside it", "", None),
    Metric("commands.collections", _COMMANDS, "garbage collections", "", None),
    Metric("commands.peak", _COMMANDS, "allocated in a tick", "kB", None),
    Metric("commands.kept", _COMMANDS, "blocks kept of a tick", "", None),
)
_ESTIMATED = "whole tick on sensors, forces by the MPC: trot 1 m/s"
ESTIMATED_METRICS = (
    Metric("estimated.median", _ESTIMATED, "median", "us", None),
    Metric("estimated.p99", _ESTIMATED, "99 of 100, by median", "", None),
    Metric("estimated.worst", _ESTIMATED, "worst by median", "", None),
    Metric("estimated.least", _ESTIMATED, "worst of the least of three runs", "", 10.0),
    Metric("estimated.factor", _ESTIMATED, "real-time factor, scaled", "", 10.0, _LEAST),
)
_PARTS = "parts of a tick, trot at 0.5 m/s"
PART_METRICS = (
    *(Metric(f"part.{name}", _PARTS, what, "us", None) for name, what in PARTS.items()),
    Metric("part.rest", _PARTS, "the rest: checks, glue", "us", None),
)
_REALTIME = "500 Hz at the wall clock's pace, 60 s of trot"
REALTIME_METRICS = (
    Metric("realtime.missed", _REALTIME, "ticks that ended late", "%", 0.1),
    Metric("realtime.bare", _REALTIME, "a bare loop after it, late", "%", None),
    Metric("realtime.ticks", _REALTIME, "ticks", "", None),
    Metric("realtime.load", _REALTIME, "processor time", "%", None),
)


@contextmanager
def timed_robot(plant: MujocoPlant) -> Iterator[tuple[GO2Controller, list[int]]]:
    """A robot, and the thread time [ns] at the end of each of its ticks."""
    ends: list[int] = []
    with (
        closing(plant),
        GO2Controller(plant=plant, after_tick=lambda: ends.append(time.thread_time_ns())) as go2,
    ):
        yield go2, ends


def _require(go2: GO2Controller, ok: bool | None = None) -> None:
    """Raise ``TrialFailed`` unless a call, or the last one, was done."""
    if not (go2.last_outcome.ok if ok is None else ok):
        raise TrialFailed(go2.last_outcome.reason)


def measure_ticks(trial: Trial) -> Measurement:
    """From the end of one tick to the end of the next, everything included."""
    slow = slowness(recorded_ticks(trial)[2])
    values = {"tick.slowness": slow}
    with timed_robot(trial.plant()) as (go2, ends):
        for mode in MODES:
            act = _prepared(go2, mode)
            ends.clear()
            _require(go2, act() is not False)
            spent = np.diff(ends) / 1e3
            median = float(np.median(spent))
            values |= {
                f"tick.{mode}.median": median,
                f"tick.{mode}.p99": float(np.quantile(spent, 0.99)),
                f"tick.{mode}.scaled": median / slow,
                f"tick.{mode}.factor": PERIOD / float(spent.mean()) * slow,
            }
            if mode == "trot":
                go2.stop()
    return Measurement(values)


def _prepared(go2: GO2Controller, mode: str) -> Callable[[], object]:
    """What is measured in ``mode``; what it needs before is done."""
    if mode == "trot":
        go2.walk()
        go2.move(0.5)
        return partial(go2.wait, 4.0)
    if mode in ("high five", "bow"):
        go2.stand()
    return partial(go2.play, "bow") if mode == "bow" else getattr(go2, mode.replace(" ", "_"))


def measure_estimated(trial: Trial) -> Measurement:
    """Ticks of a trot on its own sensors.

    The worst tick is told as in ``measure_commands``.
    """
    slow = slowness(recorded_ticks(trial)[2])
    walks = np.array([_estimated(trial) for _ in range(REPEATS)])
    values = _tail("estimated", walks[0], walks.min(axis=0))
    return Measurement(values | {"estimated.factor": PERIOD / float(walks[0].mean()) * slow})


def _tail(name: str, spent: np.ndarray, least: np.ndarray) -> dict[str, float]:
    """Median, and how far the longest ticks of the first run, and of the least, are above it."""
    median = float(np.median(spent))
    return {
        f"{name}.median": median,
        f"{name}.p99": float(np.quantile(spent, 0.99)) / median,
        f"{name}.worst": float(spent.max()) / median,
        f"{name}.least": float(least.max() / np.median(least)),
    }


def _estimated(trial: Trial) -> np.ndarray:
    """Time [us] of each tick; a fresh robot, the same each time."""
    plant = MujocoPlant(sensors="imu", seed=trial.seed)
    with timed_robot(plant) as (go2, ends):
        _require(go2, go2.walk())
        go2.move(1.0)
        go2.wait(1.0)
        ends.clear()
        go2.wait(ESTIMATED_TIME)
        _require(go2)
        return np.diff(ends) / 1e3


def measure_commands(trial: Trial) -> Measurement:
    """The worst tick of a walk with a new command each second, and the memory that ticks take.

    The same walk is done several times: the least that each of its ticks took is what the code
    needs, more is what the machine adds now and then.
    """
    collections: list[str] = []
    walks = [_walked(trial, collections) for _ in range(REPEATS)]
    spent, bare, (peak, kept) = walks[0]
    ticks = min(len(walk[0]) for walk in walks)
    values = _tail("commands", spent, np.min([walk[0][:ticks] for walk in walks], axis=0))
    return Measurement(
        {
            **values,
            "commands.bare": float(bare.max()) / float(np.median(bare)),
            "commands.collections": float(len(collections)),
            "commands.peak": peak / 1e3,
            "commands.kept": kept,
        }
    )


def _walked(
    trial: Trial, collections: list[str]
) -> tuple[np.ndarray, np.ndarray, tuple[float, float]]:
    """Time [us] of ticks and of bare work, and what ``_memory`` says; a fresh robot."""

    def note(phase: str, info: dict[str, int]) -> None:
        if phase == "start":
            collections.append(str(info["generation"]))

    plant, random = trial.plant(), np.random.default_rng(trial.seed)
    with timed_robot(plant) as (go2, ends):
        go2.walk()
        gc.callbacks.append(note)
        spent, bare = _walk(go2, random, ends)
        gc.callbacks.remove(note)
        return spent, bare, _memory(plant, go2, ends)


def _walk(
    go2: GO2Controller, random: np.random.Generator, ends: list[int]
) -> tuple[np.ndarray, np.ndarray]:
    """Time [us] of each tick, and of as many pieces of bare work, second by second in turn.

    What happens between two commands belongs to no tick.
    """
    spent, bare = [], []
    for _ in range(round(COMMAND_TIME)):
        ahead, aside, turn = random.uniform(-1.0, 1.0, 3) * FASTEST
        go2.move(float(ahead), float(turn), linear_y=float(aside))
        ends.clear()
        go2.wait(1.0)
        _require(go2)
        spent.append(np.diff(ends) / 1e3)
        bare.append(timed(bare_work(float(np.median(spent[-1]))), len(spent[-1])))
    return np.concatenate(spent), np.concatenate(bare)


def _memory(plant: MujocoPlant, go2: GO2Controller, ends: list[int]) -> tuple[float, float]:
    """Bytes that a tick allocates at most at a time, and blocks that it leaves, on the average.

    The former by ``tracemalloc``, the latter by ``sys.getallocatedblocks``.
    """
    go2.wait(0.1)
    before = sys.getallocatedblocks()
    go2.wait(TRACED_TICKS * plant.control_period)
    ends.clear()  # ours, not the robot's
    kept = (sys.getallocatedblocks() - before) / TRACED_TICKS
    peaks = list[int]()
    tracemalloc.start()
    try:
        for _ in range(TRACED_TICKS // 10):
            tracemalloc.reset_peak()
            held = tracemalloc.get_traced_memory()[0]
            go2.wait(plant.control_period)
            peaks.append(tracemalloc.get_traced_memory()[1] - held)
    finally:
        tracemalloc.stop()
    return float(np.median(peaks)), kept


def measure_parts(trial: Trial) -> Measurement:
    """Median of each part of a tick of the trot, and of what a tick takes beyond them."""
    with closing(trial.plant()) as plant, closing(build_pilot(plant, Config())) as pilot:
        loop = pilot.runner.loop
        try:
            pilot.stand()
            pilot.walk("trot")
            pilot.set_command(VelocityCommand(0.5))
            pilot.wait(1.0)
            owners = (plant, loop.model, loop.behaviour, loop.wbc, plant, loop.telemetry, loop)
            spent: dict[str, list[float]] = {name: [] for name in (*PARTS, "tick")}
            owner: Any
            for name, owner in zip(spent, owners, strict=True):
                setattr(owner, name, partial(_note_time, getattr(owner, name), spent[name]))
            pilot.wait(PARTS_TIME)
        except Aborted as aborted:
            raise TrialFailed(str(aborted)) from aborted
    medians = {name: float(np.median(times)) if times else 0.0 for name, times in spent.items()}
    whole = medians.pop("tick")
    values = {f"part.{name}": value for name, value in medians.items()}
    return Measurement(values | {"part.rest": whole - sum(medians.values())})


def _note_time(
    function: Callable[..., object], spent: list[float], *args: object, **options: object
) -> object:
    start = time.thread_time_ns()
    try:
        return function(*args, **options)
    finally:
        spent.append((time.thread_time_ns() - start) / 1e3)


def measure_realtime(trial: Trial) -> Measurement:
    """Trot for a minute at the wall clock's pace; ticks that were not done when the next was due.

    Wants a core of its own.
    """
    with closing(trial.plant()) as plant, GO2Controller(plant=plant, realtime=True) as go2:
        _require(go2, go2.walk())
        go2.move(0.5)
        start, used = go2.state.time, time.process_time()
        missed = go2.telemetry.missed_deadlines
        time.sleep(REAL_TIME)
        ticks = (go2.state.time - start) / plant.control_period
        missed = go2.telemetry.missed_deadlines - missed
        used = time.process_time() - used
        _require(go2, go2.stand())
    return Measurement(
        {
            "realtime.bare": share_late(bare_work(1e6 * used / ticks), plant.control_period),
            "realtime.missed": 100.0 * missed / ticks,
            "realtime.ticks": ticks,
            "realtime.load": 100.0 * used / REAL_TIME,
        }
    )


# --- a bare loop ----------------------------------------------------------------------------------


def bare_work(duration: float) -> Callable[[], object]:
    """Hashes as many bytes as take ``duration`` [us], the median, and allocates nothing."""
    sample = bytes(4096)
    durations = timed(partial(hashlib.sha256, sample), CALIBRATION_CALLS)
    size = max(1, round(len(sample) * duration / float(np.median(durations))))
    return partial(hashlib.sha256, bytes(size))


def timed(work: Callable[[], object], times: int) -> Float[np.ndarray, " n"]:
    """Processor time [us] from the end of each call to the end of the next."""
    ends = [time.thread_time_ns()]
    for _ in range(times):
        work()
        ends.append(time.thread_time_ns())
    return np.diff(ends) / 1e3


def share_late(work: Callable[[], object], period: float) -> float:
    """Share [%] of calls, one in each ``period`` [s], that were not done when the next was due."""
    pacer = Pacer(period, GIVEN_UP)
    count = round(REAL_TIME / period)
    for _ in range(count):
        work()
        pacer.wait()
    return 100.0 * pacer.missed / count
