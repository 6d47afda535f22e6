"""The bench counts honestly: means, worst seeds, falls, exit codes."""

from __future__ import annotations

import json
import math
import os
from collections.abc import Callable
from pathlib import Path

import pytest

from benchmarks import families as registry
from benchmarks.families import FAMILIES, find_families
from benchmarks.report import WIDTH, bar_text, render, summarise, summarise_row
from benchmarks.rows import Direction, Family, Measurement, Row
from benchmarks.runner import run_families
from benchmarks.trials import Trial
from controller.cli import main as cli
from controller.cli.common import ExitCode
from go2_wbc.errors import CommandError, PlantError

SPEED = Row("fake.speed", "fake item", "speed", "m/s", 1.0, Direction.AT_LEAST)
ERROR = Row("fake.error", "fake item", "error", "%", 2.0)
NOTE = Row("fake.note", "fake item", "note", "mm", None)
NEEDED = {
    *("name", "item", "quantity", "unit", "bar", "direction", "n", "mean", "worst"),
    *("worst_seed", "falls", "passed", "values", "failures"),
}
"""Keys of a row in the JSON that programs rely on."""


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


def fake(measure: Callable[[Trial], Measurement] = measure_well, factor: int = 1) -> Family:
    return Family("fake", (SPEED, ERROR, NOTE), measure, factor)


def measured(*values: float, row: str = "fake.speed") -> dict[int, Measurement]:
    return {seed: Measurement({row: value}) for seed, value in enumerate(values)}


# --- arithmetic of a row ------------------------------------------------------------------------


def test_mean_and_worst_of_a_row_that_wants_much() -> None:
    result = summarise_row(SPEED, measured(3.0, 0.5, 1.0))
    assert (result.n, result.mean, result.worst, result.worst_seed) == (3, 1.5, 0.5, 1)
    assert result.passed  # the bar is for the mean


def test_mean_and_worst_of_a_row_that_wants_little() -> None:
    result = summarise_row(ERROR, measured(3.0, 0.5, 4.0, row="fake.error"))
    assert (result.mean, result.worst, result.worst_seed) == (2.5, 4.0, 2)
    assert result.passed is False


@pytest.mark.parametrize(("row", "mean"), [(SPEED, 1.0), (ERROR, 2.0)])
def test_a_mean_on_the_bar_passes(row: Row, mean: float) -> None:
    assert summarise_row(row, measured(mean, row=row.name)).passed


def test_a_fall_is_never_a_pass_however_good_the_other_seeds() -> None:
    trials = {0: Measurement({"fake.speed": 100.0}), 7: Measurement({}, reason="fell")}
    result = summarise_row(SPEED, trials)
    assert result.passed is False
    assert (result.falls, result.failures) == (1, {7: "fell"})
    assert (result.n, result.mean, result.worst, result.worst_seed) == (2, 100.0, None, 7)


def test_a_failure_with_a_good_value_is_no_pass_either() -> None:
    trials = {0: Measurement({"fake.speed": 100.0}, {"fake.speed": "said False"})}
    result = summarise_row(SPEED, trials)
    assert result.passed is False
    assert (result.falls, result.worst) == (1, 100.0)


def test_a_nan_is_a_failure() -> None:
    result = summarise_row(SPEED, measured(2.0, math.nan))
    assert result.passed is False
    assert (result.mean, result.worst_seed, set(result.failures)) == (2.0, 1, {1})


def test_a_row_without_any_seed_does_not_pass() -> None:
    assert summarise_row(SPEED, {}).passed is False


def test_a_row_without_a_bar_is_not_judged() -> None:
    result = summarise_row(NOTE, measured(5.0, row="fake.note"))
    assert result.passed is None
    assert summarise(
        [Family("fake", (NOTE,), measure_well)], {"fake": {0: measure_well(Trial(0))}}
    ).ok


# --- report -------------------------------------------------------------------------------------


def test_the_table_fits_80_columns_and_names_the_fallen_seed() -> None:
    long_reason = "fell at t=3.20 s: " + "roll 71 deg, pitch -3 deg, " * 20
    trials = {s: Measurement({}, reason=long_reason) for s in range(9)}
    widest = {s: Measurement({row: -1.23456e-123}) for s in range(999) for row in ("fake.speed",)}
    for results in (trials, widest, measured(1.0)):
        text = render(summarise([fake()], {"fake": results}))
        assert max(map(len, text.splitlines())) <= WIDTH
    assert "seed 2: fell at t=3.20 s" in render(summarise([fake()], {"fake": trials}))


def test_every_real_row_fits_the_table_and_has_its_own_name() -> None:
    rows = [row for family in FAMILIES for row in family.rows]
    assert len({row.name for row in rows}) == len(rows)
    assert [row.quantity for row in rows if len(row.quantity) > 28] == []
    assert [row.item for row in rows if len(row.item) > WIDTH] == []
    assert [bar_text(row) for row in rows if len(bar_text(row)) > 15] == []
    results = {f.name: {0: Measurement({r.name: -1.2e-12 for r in f.rows})} for f in FAMILIES}
    text = render(summarise(FAMILIES, results))
    assert max(map(len, text.splitlines())) <= WIDTH


def test_the_json_has_every_key_and_no_nan() -> None:
    results = {"fake": {0: measure_well(Trial(0)), 1: Measurement({"fake.speed": math.inf})}}
    value = summarise([fake()], results).as_dict()
    text = json.dumps(value, allow_nan=False)
    rows = json.loads(text)["rows"]
    assert all(set(row) == NEEDED for row in rows)
    assert [row["name"] for row in rows] == ["fake.speed", "fake.error", "fake.note"]
    assert value["passed"] is False


# --- runner -------------------------------------------------------------------------------------


def test_an_error_of_the_project_is_a_failed_trial_with_its_reason() -> None:
    results = run_families([fake(break_the_plant)], seeds=1, jobs=0)
    report = summarise([fake()], results)
    assert report.rows[0].failures == {0: "PlantError: physics failed"}
    assert not report.ok


def test_a_bug_is_raised_and_not_counted() -> None:
    with pytest.raises(ZeroDivisionError):
        run_families([fake(have_a_bug)], seeds=1, jobs=0)


def test_every_seed_of_every_family_is_run_once_and_told() -> None:
    told: list[tuple[int, int]] = []
    families = [fake(), Family("more", (SPEED,), measure_badly, seed_factor=2)]
    results = run_families(families, 2, 0, lambda p: told.append((p.done, p.count)))
    assert {name: sorted(trials) for name, trials in results.items()} == {
        "fake": [0, 1],
        "more": [0, 1, 2, 3],
    }
    assert told == [(done, 6) for done in range(1, 7)]


def test_processes_give_the_same_as_one_after_the_other() -> None:
    in_turn = run_families([fake()], seeds=3, jobs=0)
    assert run_families([fake()], seeds=3, jobs=2) == in_turn


def test_a_process_that_dies_fails_its_own_trial_only() -> None:
    results = run_families([fake(die_on_seed_1)], seeds=4, jobs=2)["fake"]
    assert {seed: trial.reason for seed, trial in results.items()} == {
        **dict.fromkeys((0, 2, 3), ""),
        1: "its process died twice",
    }


# --- command line -------------------------------------------------------------------------------


@pytest.fixture
def only(monkeypatch: pytest.MonkeyPatch) -> Callable[[Family], None]:
    """Makes a family the only one, and runs it in this process."""

    def install(family: Family) -> None:
        monkeypatch.setattr(registry, "FAMILIES", (family,))
        monkeypatch.setattr(
            "benchmarks.runner._in_processes",
            lambda tasks, _jobs: ((f, s, f.measure(Trial(s))) for f, s in tasks),
        )

    return install


@pytest.mark.parametrize(
    ("measure", "code"),
    [
        (measure_well, ExitCode.OK),
        (measure_badly, ExitCode.FAILED),
        (fall_on_seed_1, ExitCode.FAILED),
    ],
)
def test_the_exit_code_says_whether_every_row_passes(
    only: Callable[[Family], None],
    capsys: pytest.CaptureFixture[str],
    measure: Callable[[Trial], Measurement],
    code: ExitCode,
) -> None:
    only(fake(measure))
    assert cli.main(["bench", "behaviour", "--seeds", "2"]) == code
    assert "rows pass" in capsys.readouterr().out


def test_json_goes_to_stdout_and_to_the_file_alike(
    only: Callable[[Family], None], capsys: pytest.CaptureFixture[str], tmp_path: Path
) -> None:
    only(fake())
    file = tmp_path / "bench.json"
    file.write_text("old")
    assert cli.main(["bench", "behaviour", "--quick", "--json", "--out", str(file)]) == ExitCode.OK
    printed = json.loads(capsys.readouterr().out)
    assert printed == json.loads(file.read_text())
    assert printed["rows"][0]["n"] == 3
    assert list(tmp_path.iterdir()) == [file]


def test_an_interrupt_leaves_the_old_results(
    only: Callable[[Family], None], tmp_path: Path
) -> None:
    def interrupt(trial: Trial) -> Measurement:
        raise KeyboardInterrupt

    only(fake(interrupt))
    file = tmp_path / "bench.json"
    file.write_text("old")
    assert cli.main(["bench", "behaviour", "--out", str(file)]) == ExitCode.INTERRUPTED
    assert file.read_text() == "old"


def test_a_file_that_cannot_be_written_is_told_before_anything_runs(
    only: Callable[[Family], None], capsys: pytest.CaptureFixture[str], tmp_path: Path
) -> None:
    only(fake(have_a_bug))
    in_the_way = tmp_path / "file"
    in_the_way.write_text("")
    for out, reason in ((in_the_way / "bench.json", "choose a folder"), (tmp_path, "no suffix")):
        assert cli.main(["bench", "behaviour", "--out", str(out)]) == ExitCode.USAGE
        assert reason in capsys.readouterr().err


def test_list_names_every_family_and_bar(capsys: pytest.CaptureFixture[str]) -> None:
    assert cli.main(["bench", "behaviour", "--list"]) == ExitCode.OK
    out = capsys.readouterr().out
    assert all(family.name in out.splitlines() for family in FAMILIES)
    assert "<= 0.025 m/s" in out
    assert max(map(len, out.splitlines())) <= WIDTH


def test_an_unknown_row_is_a_usage_error_that_lists_the_valid_ones() -> None:
    with pytest.raises(CommandError, match=r"unknown row 'gallop'.*high-five.*trot"):
        find_families(["gallop"])
    assert cli.main(["bench", "behaviour", "--rows", "gallop"]) == ExitCode.USAGE
