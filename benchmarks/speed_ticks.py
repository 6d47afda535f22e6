"""What whole control ticks cost, 2 ms of physics included: by mode, at worst, and in memory."""

from __future__ import annotations

import gc
import sys
import time
import tracemalloc
from collections.abc import Callable
from contextlib import closing

import numpy as np

from benchmarks.scenario import Direction, Measurement, Metric
from benchmarks.speed_bare import BareWork, timed
from benchmarks.speed_solves import recorded_ticks, slowness
from controller.go2_controller import GO2Controller
from controller.sweeps.trials import Trial, TrialFailed
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
ESTIMATED_TIME = 10.0
"""Robot time [s] of the trot on sensors."""
REPEATS = 3
"""How often the same walk is done."""
TRACED_TICKS = 500
"""Ticks whose memory is traced."""

_ITEM = "whole tick, 2 ms of physics: {}"
_SCALED = "as on a machine where PlaCo's takes 43 us"


def _tick_metrics(mode: str) -> tuple[Metric, ...]:
    item, least = _ITEM.format(mode), Direction.AT_LEAST
    most = TROT_TIME if mode == "trot" else None
    return (
        Metric(f"tick.{mode}.median", item, "median", "us", None),
        Metric(f"tick.{mode}.p99", item, "99 of 100", "us", None),
        Metric(f"tick.{mode}.scaled", item, "median, scaled", "us", most),
        Metric(f"tick.{mode}.factor", item, "real-time factor, scaled", "", FACTORS[mode], least),
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
    Metric(
        "estimated.factor",
        _ESTIMATED,
        "real-time factor, scaled",
        "",
        10.0,
        Direction.AT_LEAST,
    ),
)


def measure_ticks(trial: Trial) -> Measurement:
    """From the end of one tick to the end of the next, everything included."""
    slow = slowness(recorded_ticks(trial)[2])
    values = {"tick.slowness": slow}
    ends: list[int] = []
    with (
        closing(trial.plant()) as plant,
        GO2Controller(plant=plant, after_tick=lambda: ends.append(time.thread_time_ns())) as go2,
    ):
        for mode in MODES:
            act = _prepared(go2, mode)
            ends.clear()
            if act() is False:
                raise TrialFailed(go2.last_outcome.reason)
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
        return lambda: go2.wait(4.0)
    if mode in ("high five", "bow"):
        go2.stand()
    acts: dict[str, Callable[[], object]] = {
        "stand": go2.stand,
        "high five": go2.high_five,
        "bow": lambda: go2.play("bow"),
        "sit": go2.sit,
        "lie down": go2.lie_down,
    }
    return acts[mode]


def measure_estimated(trial: Trial) -> Measurement:
    """Ticks of a trot on its own sensors.

    The worst tick is told as in ``measure_commands``.
    """
    slow = slowness(recorded_ticks(trial)[2])
    walks = np.array([_estimated(trial) for _ in range(REPEATS)])
    spent, least = walks[0], walks.min(axis=0)
    median = float(np.median(spent))
    return Measurement(
        {
            "estimated.median": median,
            "estimated.p99": float(np.quantile(spent, 0.99)) / median,
            "estimated.worst": float(spent.max()) / median,
            "estimated.least": float(least.max() / np.median(least)),
            "estimated.factor": PERIOD / float(spent.mean()) * slow,
        }
    )


def _estimated(trial: Trial) -> np.ndarray:
    """Time [us] of each tick; a fresh robot, the same each time."""
    ends: list[int] = []
    with (
        closing(MujocoPlant(sensors="imu", seed=trial.seed)) as plant,
        GO2Controller(plant=plant, after_tick=lambda: ends.append(time.thread_time_ns())) as go2,
    ):
        if not go2.walk():
            raise TrialFailed(go2.last_outcome.reason)
        go2.move(1.0)
        go2.wait(1.0)
        ends.clear()
        go2.wait(ESTIMATED_TIME)
        if not go2.last_outcome.ok:
            raise TrialFailed(go2.last_outcome.reason)
        return np.diff(ends) / 1e3


def measure_commands(trial: Trial) -> Measurement:
    """The worst tick of a walk with a new command each second, and the memory that ticks take.

    The same walk is done several times: the least that each of its ticks took is what the code
    needs, more is what the machine adds now and then.
    """
    collections: list[str] = []
    walks = [_walked(trial, collections) for _ in range(REPEATS)]
    spent, bare, (peak, kept) = walks[0]
    median = float(np.median(spent))
    ticks = min(len(walk[0]) for walk in walks)
    least = np.min([walk[0][:ticks] for walk in walks], axis=0)
    return Measurement(
        {
            "commands.median": median,
            "commands.p99": float(np.quantile(spent, 0.99)) / median,
            "commands.worst": float(spent.max()) / median,
            "commands.least": float(least.max()) / float(np.median(least)),
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
    ends: list[int] = []

    def note(phase: str, info: dict[str, int]) -> None:
        if phase == "start":
            collections.append(str(info["generation"]))

    plant, random = trial.plant(), np.random.default_rng(trial.seed)
    with (
        closing(plant),
        GO2Controller(plant=plant, after_tick=lambda: ends.append(time.thread_time_ns())) as go2,
    ):
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
        if not go2.last_outcome.ok:
            raise TrialFailed(go2.last_outcome.reason)
        spent.append(np.diff(ends) / 1e3)
        work = BareWork(float(np.median(spent[-1])))
        bare.append(timed(work, len(spent[-1])))
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
