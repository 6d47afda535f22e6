"""Where the time of a tick goes while the robot trots."""

from __future__ import annotations

import time
from collections.abc import Callable
from contextlib import closing
from functools import partial
from typing import Any

import numpy as np

from benchmarks.scenario import Measurement, Metric
from controller.assembly import build_pilot
from controller.procedures import Aborted
from controller.sweeps.trials import Trial, TrialFailed
from go2_wbc.config import Config
from go2_wbc.planning.command import VelocityCommand

DURATION = 4.0
"""Robot time [s] of the trot."""
PARTS = {
    "read": "read the plant",
    "snapshot": "dynamics of the state",
    "update": "planner",
    "solve": "QP",
    "write": "write, with 2 ms of physics",
    "record": "telemetry",
}
"""Methods of a tick, and what they do."""

_ITEM = "parts of a tick, trot at 0.5 m/s"
METRICS = (
    *(Metric(f"part.{name}", _ITEM, what, "us", None) for name, what in PARTS.items()),
    Metric("part.rest", _ITEM, "the rest: checks, glue", "us", None),
)


def measure_parts(trial: Trial) -> Measurement:
    """Median of each part, and of what a tick takes beyond them."""
    with closing(trial.plant()) as plant, closing(build_pilot(plant, Config())) as robot:
        pilot, loop = robot.pilot, robot.runner.loop
        try:
            pilot.stand()
            pilot.walk("trot")
            pilot.set_command(VelocityCommand(0.5))
            pilot.wait(1.0)
            owners: dict[str, Any] = {
                "read": plant,
                "snapshot": loop.model,
                "update": loop.behaviour,
                "solve": loop.wbc,
                "write": plant,
                "record": loop.telemetry,
                "tick": loop,
            }
            spent: dict[str, list[float]] = {name: [] for name in owners}
            for name, owner in owners.items():
                setattr(owner, name, partial(_timed, getattr(owner, name), spent[name]))
            pilot.wait(DURATION)
        except Aborted as aborted:
            raise TrialFailed(str(aborted)) from aborted
    medians = {name: float(np.median(times)) if times else 0.0 for name, times in spent.items()}
    whole = medians.pop("tick")
    values = {f"part.{name}": value for name, value in medians.items()}
    return Measurement(values | {"part.rest": whole - sum(medians.values())})


def _timed(
    function: Callable[..., object], spent: list[float], *args: object, **options: object
) -> object:
    start = time.thread_time_ns()
    try:
        return function(*args, **options)
    finally:
        spent.append((time.thread_time_ns() - start) / 1e3)
