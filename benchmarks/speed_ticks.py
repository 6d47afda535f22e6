"""What whole control ticks cost, 2 ms of physics included: by mode, at worst, in memory.

A tick that is late, or ten times longer than the others, may be ours or the machine's; where a bare
loop beside it, whose work allocates nothing, has as many of them, it is the machine's.
"""

import hashlib
import time
import tracemalloc
from collections.abc import Callable, Iterator
from contextlib import closing, contextmanager
from functools import partial

import numpy as np

from benchmarks.speed_solves import recorded_ticks, slowness, timed
from benchmarks.study import TrialResult
from controller.go2_controller import GO2Controller
from controller.pacing import Pacer
from controller.sweeps.trials import Trial, TrialFailed
from go2_wbc.planning.height_map import HeightMap, fuse
from go2_wbc.plant import MujocoPlant
from go2_wbc.plant.base import Scan
from go2_wbc.plant.terrain import Stairs, Terrain

PERIOD = 2000.0  # Robot time [us] of a tick
TROT_TIME = 100  # Time [us] that a tick of the trot may take
FACTORS = {"stand": 15, "trot": 18, "high five": 15, "bow": 15, "sit": 15, "lie down": 15}
"""Real-time factor to be reached in each mode."""
COMMAND_TIME = 60.0  #: Robot time [s] of random velocity commands, a new one each second
FASTEST = (1.0, 0.4, 1.5)
"""Ahead and sideways [m/s], turning [rad/s]: the greatest of these commands."""
ESTIMATED_TIME = 10.0  # Robot time [s] of the trot on sensors
SIGHT_TIME = 10.0  # Robot time [s] of the stairs
REAL_TIME = 60.0  # Time [s] of the trot at the wall clock's pace
REPEATS = 3  # How often the same walk is done
TRACED_TICKS = 500  # Ticks whose memory is traced
CALIBRATION_CALLS = 200  # Calls by which a piece of bare work is measured
GIVEN_UP = 1.0  #: Lag [s] from which on the pace is given up: never in a run that means anything


TICKS = {
    "scale: PlaCo's tick on two feet": (("slowness", "of 43 us", ""),),
    **{
        f"whole tick, 2 ms of physics: {mode}": (
            (f"{mode}.median", "median", "us"),
            (f"{mode}.p99", "99 of 100", "us"),
            (f"{mode}.scaled", "median, scaled", f"<= {TROT_TIME} us" if mode == "trot" else "us"),
            (f"{mode}.factor", "real-time factor, scaled", f">= {factor}"),
        )
        for mode, factor in FACTORS.items()
    },
}
COMMANDS = {
    "60 s of random velocity commands": (
        ("median", "tick, median", "us"),
        ("p99", "99 of 100, by median", ""),
        ("worst", "worst by median", "<= 5"),
        ("least", "worst of the least of three runs", ""),
        ("bare", "of a bare loop beside it", ""),
        ("peak", "allocated in a tick", "kB"),
    )
}
ESTIMATED = {
    "whole tick on sensors, forces by the MPC: trot 1 m/s": (
        ("median", "median", "us"),
        ("p99", "99 of 100, by median", ""),
        ("worst", "worst by median", ""),
        ("least", "worst of the least of three runs", "<= 10"),
        ("factor", "real-time factor, scaled", ">= 10"),
    )
}
SIGHT = {
    "by lidar up 6 stairs of 16 cm, 0.3 m/s, on sensors": (
        ("median", "tick, median", "us"),
        ("more", "than blind on level ground, scaled", "<= 25 us"),
        ("fused", "a scan fused, scaled", "<= 300 us"),
        ("worst", "worst tick without its ray casting", "us"),
        ("late", "ticks over their 2 ms", "<= 0"),
    )
}
REALTIME = {
    "500 Hz at the wall clock's pace, 60 s of trot": (
        ("missed", "ticks that ended late", "<= 0.1 %"),
        ("bare", "a bare loop after it, late", "%"),
        ("ticks", "ticks", ""),
        ("load", "processor time", "%"),
    )
}


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


def measure_ticks(trial: Trial, found: TrialResult) -> None:
    """From the end of one tick to the end of the next, everything included."""
    slow = slowness(recorded_ticks(trial)[2])
    found.values["slowness"] = slow
    with timed_robot(trial.plant()) as (go2, ends):
        for mode in FACTORS:
            act = _prepared(go2, mode)
            ends.clear()
            _require(go2, act() is not False)
            spent = np.diff(ends) / 1e3
            median = float(np.median(spent))
            found.values |= {
                f"{mode}.median": median,
                f"{mode}.p99": float(np.quantile(spent, 0.99)),
                f"{mode}.scaled": median / slow,
                f"{mode}.factor": PERIOD / float(spent.mean()) * slow,
            }
            if mode == "trot":
                go2.stop()


def _prepared(go2: GO2Controller, mode: str) -> Callable[[], object]:
    """What is measured in ``mode``; what it needs before is done."""
    if mode == "trot":
        go2.walk()
        go2.move(0.5)
        return partial(go2.wait, 4.0)
    if mode in ("high five", "bow"):
        go2.stand()
    return partial(go2.play, "bow") if mode == "bow" else getattr(go2, mode.replace(" ", "_"))


def measure_estimated(trial: Trial, found: TrialResult) -> None:
    """Ticks of a trot on its own sensors; the worst is told as in ``measure_commands``."""
    slow = slowness(recorded_ticks(trial)[2])
    plants = (MujocoPlant(sensors="imu", seed=trial.seed) for _ in range(REPEATS))
    walks = np.array([_trotted(plant, 1.0, 1.0, ESTIMATED_TIME) for plant in plants])
    found.values = _tail(walks[0], walks.min(axis=0))
    found.values["factor"] = PERIOD / float(walks[0].mean()) * slow


class _Scanning(MujocoPlant):
    """Notes its scans, and the processor time [us] of each call for one."""

    def __init__(self, seed: int, terrain: Terrain | None = None) -> None:
        """``terrain``: of a robot that sees it; else it is blind."""
        super().__init__(sensors="imu", seed=seed, terrain=terrain, lidar=terrain is not None)
        self.scans, self.casting = list[Scan](), list[float]()

    def scan(self) -> Scan | None:
        begun = time.thread_time_ns()
        found = super().scan()
        self.casting.append((time.thread_time_ns() - begun) / 1e3)
        self.scans += [found] if found else []
        return found


def measure_sight(trial: Trial, found: TrialResult) -> None:
    """Ticks by sight up stairs beside blind ones; casting rays is the simulation's own work."""
    slow = slowness(recorded_ticks(trial)[2])
    blind, _ = _climbed(_Scanning(trial.seed))
    spent, scans = _climbed(_Scanning(trial.seed, Stairs(0.16, 6, 0.31)))
    take = partial(fuse, HeightMap(), p_world_base=np.zeros(3), R_world_base=np.eye(3))
    fused = [
        timed(partial(take, p_base_points=scan.p_base_points, deviation=scan.deviation), 1)
        for scan in scans
    ]
    found.values = {
        "median": float(np.median(spent)),
        "more": float(np.median(spent) - np.median(blind)) / slow,
        "fused": float(np.median(fused)) / slow,
        "worst": float(spent.max()),
        "late": float(np.sum(spent > PERIOD)),
    }


def _climbed(plant: _Scanning) -> tuple[np.ndarray, list[Scan]]:
    """Time [us] of each tick less its ray casting, and the scans."""
    spent = _trotted(plant, 0.3, 0.0, SIGHT_TIME)
    return spent - plant.casting[-len(spent) :], plant.scans


def _tail(spent: np.ndarray, least: np.ndarray) -> dict[str, float]:
    """Median, and how far the longest ticks of the first run, and of the least, are above it."""
    median = float(np.median(spent))
    return {
        "median": median,
        "p99": float(np.quantile(spent, 0.99)) / median,
        "worst": float(spent.max()) / median,
        "least": float(least.max() / np.median(least)),
    }


def _trotted(plant: MujocoPlant, speed: float, lead: float, time: float) -> np.ndarray:
    """Time [us] of each tick of a trot at ``speed`` [m/s], ``lead`` [s] after the command."""
    with timed_robot(plant) as (go2, ends):
        _require(go2, go2.walk())
        go2.move(speed)
        go2.wait(lead)
        ends.clear()
        go2.wait(time)
        _require(go2)
        return np.diff(ends) / 1e3


def measure_commands(trial: Trial, found: TrialResult) -> None:
    """The worst tick of a walk with a new command each second, and the memory that ticks take.

    The same walk is done several times: the least that each of its ticks took is what the code
    needs, more is what the machine adds now and then.
    """
    walks = [_walked(trial) for _ in range(REPEATS)]
    spent, bare, peak = walks[0]
    ticks = min(len(walk[0]) for walk in walks)
    found.values = _tail(spent, np.min([walk[0][:ticks] for walk in walks], axis=0))
    found.values["bare"] = float(bare.max()) / float(np.median(bare))
    found.values["peak"] = peak / 1e3


def _walked(trial: Trial) -> tuple[np.ndarray, np.ndarray, float]:
    """Time [us] of each tick and of as many pieces of bare work, second by second in turn.

    And what ``_peak`` says. What happens between two commands belongs to no tick.
    """
    plant, random = trial.plant(), np.random.default_rng(trial.seed)
    spent, bare = [], []
    with timed_robot(plant) as (go2, ends):
        go2.walk()
        for _ in range(round(COMMAND_TIME)):
            ahead, aside, turn = random.uniform(-1.0, 1.0, 3) * FASTEST
            go2.move(float(ahead), float(turn), linear_y=float(aside))
            ends.clear()
            go2.wait(1.0)
            _require(go2)
            spent.append(np.diff(ends) / 1e3)
            bare.append(timed(bare_work(float(np.median(spent[-1]))), len(spent[-1])))
        return np.concatenate(spent), np.concatenate(bare), _peak(plant, go2)


def _peak(plant: MujocoPlant, go2: GO2Controller) -> float:
    """Bytes that a tick allocates at most at a time."""
    peaks = list[int]()
    go2.wait(TRACED_TICKS * plant.control_period)
    tracemalloc.start()
    try:
        for _ in range(TRACED_TICKS // 10):
            tracemalloc.reset_peak()
            held = tracemalloc.get_traced_memory()[0]
            go2.wait(plant.control_period)
            peaks.append(tracemalloc.get_traced_memory()[1] - held)
    finally:
        tracemalloc.stop()
    return float(np.median(peaks))


def measure_realtime(trial: Trial, found: TrialResult) -> None:
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
    found.values = {
        "bare": share_late(bare_work(1e6 * used / ticks), plant.control_period),
        "missed": 100.0 * missed / ticks,
        "ticks": ticks,
        "load": 100.0 * used / REAL_TIME,
    }


def bare_work(duration: float) -> Callable[[], object]:
    """Hashes as many bytes as take ``duration`` [us], the median, and allocates nothing."""
    sample = bytes(4096)
    durations = timed(partial(hashlib.sha256, sample), CALIBRATION_CALLS)
    size = max(1, round(len(sample) * duration / float(np.median(durations))))
    return partial(hashlib.sha256, bytes(size))


def share_late(work: Callable[[], object], period: float) -> float:
    """Share [%] of calls, one in each ``period`` [s], that were not done when the next was due."""
    pacer = Pacer(period, GIVEN_UP)
    count = round(REAL_TIME / period)
    for _ in range(count):
        work()
        pacer.wait()
    return 100.0 * pacer.missed / count
