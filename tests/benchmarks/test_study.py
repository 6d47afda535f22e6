"""Every trial is run once, in whatever process, and one that dies costs no other its result."""

import re
from dataclasses import replace
from pathlib import Path

import pytest

from benchmarks.command import measure_all
from benchmarks.report import summarise
from benchmarks.study import Results, Study, TrialResult
from controller.sweeps.trials import Trial, TrialFailed
from tests.benchmarks.support import (
    TABLE,
    Measure,
    break_the_plant,
    die_on_seed_1,
    fake,
    have_a_bug,
    measure_badly,
)


def results_of(*studies: Study, seeds: int) -> Results:
    return {study.name: {seed: study.run(seed) for seed in range(seeds)} for study in studies}


def fall(_trial: Trial, found: TrialResult) -> None:
    found.values["speed"] = 2.0
    raise TrialFailed("fell at t=1.00 s")


@pytest.mark.parametrize(
    ("measure", "reason"),
    [(break_the_plant, "PlantError: physics failed"), (fall, "fell at t=1.00 s")],
)
def test_a_robot_that_fails_is_a_failed_trial_with_what_was_found_until_then(
    measure: Measure, reason: str
) -> None:
    results = results_of(fake(measure), seeds=1)
    report = summarise([fake()], results)
    assert report.rows[1].failures == {0: reason}
    assert not report.ok
    assert results["fake"][0].values == ({"fake.speed": 2.0} if measure is fall else {})


@pytest.mark.parametrize(("measure", "done"), [(measure_badly, 1.0), (fall, 0.0)])
def test_a_trial_is_done_that_comes_to_its_end(measure: Measure, done: float) -> None:
    result = replace(fake(measure), done="done").run(0)
    assert result.values["fake.done"] == done
    assert ("fake.done" in result.failures) is not bool(done)


def test_a_bug_is_raised_and_not_counted() -> None:
    with pytest.raises(ZeroDivisionError):
        results_of(fake(have_a_bug), seeds=1)


def test_every_seed_is_run_once_in_processes_as_one_after_the_other(results_folder: Path) -> None:
    more = Study("more", TABLE, measure_badly, seed_factor=2)
    results = measure_all("any", [fake(), more], 2, jobs=2, resume=False)
    assert {name: list(trials) for name, trials in results.items()} == {
        "fake": [0, 1],
        "more": [0, 1, 2, 3],
    }
    assert results["fake"] == results_of(fake(), seeds=2)["fake"]


def test_studies_share_the_processes_seed_by_seed(
    results_folder: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    more = Study("more", TABLE, measure_badly, seed_factor=2)
    measure_all("any", [fake(), more], 2, jobs=1, resume=False)
    told = re.findall(r"(\d/\d) (\w+), seed (\d): ok", capsys.readouterr().err)
    assert [f"{name} {seed}" for _, name, seed in told] == [
        *("fake 0", "more 0", "more 1", "fake 1", "more 2", "more 3")
    ]
    assert told[-1][0] == "6/6"


def test_a_process_that_dies_fails_its_own_trial_only(
    results_folder: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    results = measure_all("any", [fake(die_on_seed_1)], 4, jobs=2, resume=False)["fake"]
    reasons = {seed: trial.reason for seed, trial in results.items()}
    assert "its process died 2 times" in reasons.pop(1)
    assert reasons == dict.fromkeys((0, 2, 3), "")
    assert "fake, seed 1: its process died 2 times" in capsys.readouterr().err


def test_a_bug_in_a_process_ends_the_run_with_its_traceback(results_folder: Path) -> None:
    with pytest.raises(RuntimeError, match=r"ZeroDivisionError: a bug[\s\S]*in have_a_bug"):
        measure_all("any", [fake(have_a_bug)], 2, jobs=1, resume=False)
