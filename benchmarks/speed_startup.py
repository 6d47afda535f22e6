"""How long a user waits: for a robot, for it to stand, for the demo's table. In fresh processes."""

from __future__ import annotations

import os
import resource
import subprocess
import sys
import tempfile
import time
from pathlib import Path
from statistics import median

from benchmarks.scenario import Measurement, Metric
from controller.sweeps.trials import Trial, TrialFailed

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

METRICS = tuple(
    metric
    for name, (item, _, most) in STARTS.items()
    for metric in (
        Metric(f"startup.{name}.cpu", item, "processor time", "s", most),
        Metric(f"startup.{name}.wall", item, "time by the clock", "s", None),
    )
)


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
    root = Path(__file__).resolve().parent.parent
    environment = {name: value for name, value in os.environ.items() if name != _NO_BYTECODE}
    environment["PYTHONPATH"] = str(root)
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
