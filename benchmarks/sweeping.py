"""``python -m benchmarks sweeps``: what a second worker brings, memory, the time of a certificate.

A second worker is held to two processes without any of this: on a machine whose processors share
their caches two are not twice as fast as one, whatever hands out the work.
"""

from __future__ import annotations

import os
import resource
import subprocess
import sys
import tempfile
import time
from collections.abc import Mapping, Sequence
from functools import cache
from pathlib import Path
from statistics import fmean

from benchmarks.command import Benchmark
from benchmarks.store import ROOT
from benchmarks.study import Study, TrialResult
from controller.sweeps.certify import RUNS, certify
from controller.sweeps.motion_study import MotionStudy, archive_of
from controller.sweeps.run import sweep
from controller.sweeps.trials import Trial
from go2_wbc.robot.model import RobotModel
from go2_wbc.world import DOUBTFUL
from motions import compile_timeline, load_motion

MOTION, CERTIFIED = "nod", "high_five"
SEEDS = 60
"""Runs of each process whose pace is measured."""
LONG, SETTLED, MEAN_OF = 1000, 100, 100
"""Runs of one worker; after how many of them, and over how many, its memory is looked at."""
_THREADS = ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS")
SCALING = {
    "two workers against one": (("share", "rate / two bare processes", ">= 0.9"),),
    "one worker": (("one", "runs a second", ">= 1/s"),),
    "two workers": (("two", "runs a second", ">= 1/s"),),
}
MEMORY = {
    "a worker over 1,000 runs": (
        ("growth", "memory at the end / before", "<= 1.05"),
        ("memory", "memory at the end", "MB"),
    )
}
CERTIFY = {
    "200 runs of the high five": (
        ("certify", "time, two workers", "<= 120 s"),
        ("done", "share done", ">="),
    )
}


def trial(seed: int) -> dict[str, object]:
    """One run of a motion, and the memory [MB] of this process after it."""
    return {"done": _study()(seed)["done"], "memory": _memory()}


@cache
def _study() -> MotionStudy:
    return MotionStudy(archive_of(compile_timeline(load_motion(MOTION), RobotModel())), DOUBTFUL)


def _memory() -> float:
    """Resident memory [MB] of this process; at most so far where the system does not say more."""
    try:
        pages = int(Path("/proc/self/statm").read_text().split()[1])
    except OSError:
        return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024.0
    return pages * os.sysconf("SC_PAGE_SIZE") / 1e6


def measure_scaling(_trial: Trial, found: TrialResult) -> None:
    """Runs a second of one and two workers, and of one and two bare processes, in turn."""
    swept = {workers: _pace_swept(workers) for workers in (1, 2)}
    bare = {count: _pace_bare(count) for count in (1, 2)}
    share = (swept[2] / swept[1]) / (bare[2] / bare[1])
    found.values = {"share": share, "one": swept[1], "two": swept[2]}


def _pace_swept(workers: int) -> float:
    with tempfile.TemporaryDirectory() as folder:
        start = time.perf_counter()
        sweep(trial, workers * SEEDS, workers=workers, out=Path(folder, "rows.sqlite"))
        return workers * SEEDS / (time.perf_counter() - start)


def _pace_bare(count: int) -> float:
    """Of processes that do nothing but run."""
    code = f"from benchmarks.sweeping import trial\nfor seed in range({SEEDS}): trial(seed)"
    environment = {**os.environ, **dict.fromkeys(_THREADS, "1")}
    start = time.perf_counter()
    started = [
        subprocess.Popen([sys.executable, "-c", code], cwd=ROOT, env=environment)
        for _ in range(count)
    ]
    codes = [process.wait() for process in started]
    if any(codes):
        raise RuntimeError(f"a bare process ended with {codes}")
    return count * SEEDS / (time.perf_counter() - start)


def measure_memory(_trial: Trial, found: TrialResult) -> None:
    """The memory of the one worker of a long sweep, after the first runs and at its end."""
    with tempfile.TemporaryDirectory() as folder:
        rows = sweep(trial, LONG, workers=1, out=Path(folder, "rows.sqlite")).rows
    found.values = growth_of(rows)


def growth_of(rows: Sequence[Mapping[str, object]]) -> dict[str, float]:
    """Memory at the end [MB], and over that after ``SETTLED`` runs; means of ``MEAN_OF``."""
    memory = [float(str(row["memory"])) for row in rows]
    before, after = fmean(memory[SETTLED : SETTLED + MEAN_OF]), fmean(memory[-MEAN_OF:])
    return {"growth": after / before, "memory": after}


def measure_certify(_trial: Trial, found: TrialResult) -> None:
    """All runs of a certificate by two workers, from the call to its return."""
    with tempfile.TemporaryDirectory() as folder:
        start = time.perf_counter()
        found.values["done"] = certify(
            CERTIFIED, RUNS, workers=2, out=Path(folder, "rows.sqlite")
        ).rate
        found.values["certify"] = time.perf_counter() - start


STUDIES = (
    Study("scaling", SCALING, measure_scaling, "sweeps"),
    Study("memory", MEMORY, measure_memory, "sweeps"),
    Study("certify", CERTIFY, measure_certify, "sweeps"),
)

BENCHMARK = Benchmark(
    "sweeps",
    "What a second worker brings, beside two processes without a sweep; memory of\n"
    "a worker over 1,000 runs; time of a certificate. Wants an idle machine.",
    STUDIES,
    takes="ten minutes, two idle processors",
    examples=("memory  may run beside other work", "certify"),
    runs=1,
    jobs=0,
)
register, run = BENCHMARK.register, BENCHMARK.run
