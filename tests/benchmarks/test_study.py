"""Every trial is run once, in whatever process, and one that dies costs no other its result."""

from __future__ import annotations

import pytest

from benchmarks.command import tasks_of
from benchmarks.report import summarise
from benchmarks.study import Results, Study, TrialResult, run_tasks
from controller.sweeps.trials import Trial, TrialFailed
from tests.benchmarks.support import (
    TABLE,
    break_the_plant,
    die_on_seed_1,
    fake,
    have_a_bug,
    measure_badly,
)


def results_of(*scenarios: Study, seeds: int, jobs: int = 0) -> Results:
    results: Results = {scenario.name: {} for scenario in scenarios}
    for scenario, seed, measurement in run_tasks(tasks_of(scenarios, seeds), jobs):
        assert seed not in results[scenario.name]
        results[scenario.name][seed] = measurement
    return results


def test_an_error_of_the_project_is_a_failed_trial_with_its_reason() -> None:
    results = results_of(fake(break_the_plant), seeds=1)
    report = summarise([fake()], results)
    assert report.rows[0].failures == {0: "PlantError: physics failed"}
    assert not report.ok


def fall(_trial: Trial, _found: TrialResult) -> None:
    raise TrialFailed("fell at t=1.00 s")


def test_a_robot_that_fails_is_a_failed_trial_in_its_own_words() -> None:
    assert results_of(fake(fall), seeds=1)["fake"][0].reason == "fell at t=1.00 s"


def test_a_bug_is_raised_and_not_counted() -> None:
    with pytest.raises(ZeroDivisionError):
        results_of(fake(have_a_bug), seeds=1)


def test_every_seed_of_every_scenario_is_run_once() -> None:
    more = Study("more", TABLE, measure_badly, seed_factor=2)
    results = results_of(fake(), more, seeds=2)
    assert {name: sorted(trials) for name, trials in results.items()} == {
        "fake": [0, 1],
        "more": [0, 1, 2, 3],
    }


def test_processes_give_the_same_as_one_after_the_other() -> None:
    assert results_of(fake(), seeds=3, jobs=2) == results_of(fake(), seeds=3)


def test_a_process_that_dies_fails_its_own_trial_only() -> None:
    results = results_of(fake(die_on_seed_1), seeds=4, jobs=2)["fake"]
    assert {seed: trial.reason for seed, trial in results.items()} == {
        **dict.fromkeys((0, 2, 3), ""),
        1: "its process died twice",
    }
