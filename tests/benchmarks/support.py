"""Scenarios that give known values, for the tests of the machinery around them."""

import os
from collections.abc import Callable

from benchmarks.study import Metric, Study, TrialResult
from controller.sweeps.trials import Trial, TrialFailed
from go2_wbc.errors import PlantError

Measure = Callable[[Trial, TrialResult], None]

TABLE = {
    "fake item": (
        ("speed", "speed", ">= 1 m/s"),
        ("error", "error", "<= 2 %"),
        ("note", "note", "mm"),
    )
}


def measure_well(trial: Trial, found: TrialResult) -> None:
    found.values = {"speed": 1.5 + trial.seed, "error": 1.0, "note": 99.0}


def measure_badly(_trial: Trial, found: TrialResult) -> None:
    found.values = {"speed": 0.5, "error": 1.0, "note": 0.0}


def fall_on_seed_1(trial: Trial, found: TrialResult) -> None:
    if trial.seed == 1:
        raise TrialFailed("fell at t=3.20 s: roll 71 deg")
    measure_well(trial, found)


def break_the_plant(_trial: Trial, _found: TrialResult) -> None:
    raise PlantError("physics failed")


def have_a_bug(_trial: Trial, _found: TrialResult) -> None:
    raise ZeroDivisionError("a bug")


def die_on_seed_1(trial: Trial, found: TrialResult) -> None:
    if trial.seed == 1:
        os._exit(9)
    measure_well(trial, found)


def fake(measure: Measure = measure_well, factor: int = 1) -> Study:
    return Study("fake", TABLE, measure, seed_factor=factor)


SPEED, ERROR, NOTE = fake().metrics


def measured(*values: float, metric: Metric = SPEED) -> dict[int, TrialResult]:
    return {seed: TrialResult({metric.name: value}) for seed, value in enumerate(values)}
