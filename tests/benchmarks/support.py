"""Scenarios that give known values, for the tests of the machinery around them."""

from __future__ import annotations

import os
from collections.abc import Callable

from benchmarks.study import Direction, Measurement, Metric, Study
from controller.sweeps.trials import Trial
from go2_wbc.errors import PlantError

SPEED = Metric("fake.speed", "fake item", "speed", "m/s", 1.0, Direction.AT_LEAST)
ERROR = Metric("fake.error", "fake item", "error", "%", 2.0)
NOTE = Metric("fake.note", "fake item", "note", "mm", None)


def measure_well(trial: Trial) -> Measurement:
    return Measurement({"fake.speed": 1.5 + trial.seed, "fake.error": 1.0, "fake.note": 99.0})


def measure_badly(trial: Trial) -> Measurement:
    return Measurement({"fake.speed": 0.5, "fake.error": 1.0, "fake.note": 0.0})


def fall_on_seed_1(trial: Trial) -> Measurement:
    if trial.seed == 1:
        return Measurement({}, reason="fell at t=3.20 s: roll 71 deg")
    return measure_well(trial)


def break_the_plant(trial: Trial) -> Measurement:
    raise PlantError("physics failed")


def have_a_bug(trial: Trial) -> Measurement:
    raise ZeroDivisionError("a bug")


def die_on_seed_1(trial: Trial) -> Measurement:
    if trial.seed == 1:
        os._exit(9)
    return measure_well(trial)


def fake(measure: Callable[[Trial], Measurement] = measure_well, factor: int = 1) -> Study:
    return Study("fake", (SPEED, ERROR, NOTE), measure, factor)


def measured(*values: float, metric: str = "fake.speed") -> dict[int, Measurement]:
    return {seed: Measurement({metric: value}) for seed, value in enumerate(values)}
