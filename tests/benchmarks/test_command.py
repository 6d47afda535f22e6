"""``python -m benchmarks``: what is run, what is printed and written, which exit code."""

import json
import subprocess
import sys
from contextlib import closing
from pathlib import Path

import numpy as np
import pytest

from benchmarks.__main__ import COMMANDS, GONE, main
from benchmarks.behaviour import STUDIES
from benchmarks.report import WIDTH
from benchmarks.study import IDEAL, IMU, Study, TrialResult, chosen_studies
from controller.cli.common import ExitCode
from controller.cli.main import Command
from controller.sweeps.trials import Trial
from go2_wbc.errors import CommandError
from tests.benchmarks.conftest import Only
from tests.benchmarks.support import (
    Measure,
    fake,
    fall_on_seed_1,
    have_a_bug,
    measure_badly,
    measure_well,
)

ROOT = Path(__file__).resolve().parents[2]


def test_it_runs_from_the_root_of_a_checkout() -> None:
    command = [sys.executable, "-m", "benchmarks", "--list"]
    done = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, check=True)
    names = [line.split()[0] for line in done.stdout.splitlines()]
    assert names == [command.name for command in COMMANDS]


@pytest.mark.parametrize("command", COMMANDS, ids=lambda command: command.name)
def test_every_benchmark_has_a_help_with_examples(
    command: Command, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("COLUMNS", str(WIDTH))
    assert main([command.name, "--help"]) == ExitCode.OK
    out = capsys.readouterr().out
    assert out.startswith(f"usage: python -m benchmarks {command.name}")
    assert "examples:" in out
    assert max(map(len, out.splitlines())) <= WIDTH


def test_what_is_gone_is_told_with_its_place(capsys: pytest.CaptureFixture[str]) -> None:
    for name, place in GONE.items():
        assert main([name, "--quick"]) == ExitCode.USAGE
        assert place in capsys.readouterr().err


@pytest.mark.parametrize("argv", [[], ["gallop"], ["behaviour", "--nonsense"], ["--nonsense"]])
def test_wrong_usage_exits_with_2(argv: list[str], capsys: pytest.CaptureFixture[str]) -> None:
    assert main(argv) == ExitCode.USAGE
    assert "usage: python -m benchmarks" in capsys.readouterr().err


@pytest.mark.parametrize(
    ("measure", "code"),
    [
        (measure_well, ExitCode.OK),
        (measure_badly, ExitCode.FAILED),
        (fall_on_seed_1, ExitCode.FAILED),
        (have_a_bug, ExitCode.RUNTIME),
    ],
)
def test_the_exit_code_says_whether_every_metric_passes(
    only: Only, capsys: pytest.CaptureFixture[str], measure: Measure, code: ExitCode
) -> None:
    only(fake(measure))
    assert main(["behaviour", "--seeds", "2"]) == code
    assert ("rows pass" in capsys.readouterr().out) == (code != ExitCode.RUNTIME)


def test_every_result_is_told_with_what_has_failed(
    only: Only, capsys: pytest.CaptureFixture[str]
) -> None:
    only(fake(fall_on_seed_1))
    main(["behaviour", "--seeds", "2"])
    told = capsys.readouterr().err.splitlines()
    assert told == ["1/2 fake, seed 0: ok", "2/2 fake, seed 1: fell at t=3.20 s: roll 71 deg"]


def test_json_goes_to_stdout_and_to_the_file_alike(
    only: Only, capsys: pytest.CaptureFixture[str], tmp_path: Path
) -> None:
    only(fake())
    file = tmp_path / "out" / "results.json"
    file.parent.mkdir()
    file.write_text("old")
    assert main(["behaviour", "--quick", "--json", "--out", str(file)]) == ExitCode.OK
    printed = json.loads(capsys.readouterr().out)
    assert printed == json.loads(file.read_text())
    assert printed["rows"][0]["n"] == 3
    assert list(file.parent.iterdir()) == [file]


def test_an_interrupt_leaves_the_old_report(only: Only, tmp_path: Path) -> None:
    def interrupt(_trial: Trial, _found: TrialResult) -> None:
        raise KeyboardInterrupt

    only(fake(interrupt))
    file = tmp_path / "results.json"
    file.write_text("old")
    assert main(["behaviour", "--out", str(file)]) == ExitCode.INTERRUPTED
    assert file.read_text() == "old"


def test_a_file_that_cannot_be_written_is_told_before_anything_runs(
    only: Only, capsys: pytest.CaptureFixture[str], tmp_path: Path
) -> None:
    only(fake(have_a_bug))
    in_the_way = tmp_path / "file"
    in_the_way.write_text("")
    for out, reason in ((in_the_way / "results.json", "choose a folder"), (tmp_path, "no suffix")):
        assert main(["behaviour", "--out", str(out)]) == ExitCode.USAGE
        assert reason in capsys.readouterr().err


def test_what_is_listed_has_its_threshold_and_what_is_unknown_is_told_what_is_valid(
    capsys: pytest.CaptureFixture[str],
) -> None:
    assert main(["behaviour", "--list"]) == ExitCode.OK
    out = capsys.readouterr().out
    assert all(scenario.name in out.splitlines() for scenario in STUDIES)
    assert "<= 20 mm" in out
    assert max(map(len, out.splitlines())) <= WIDTH
    with pytest.raises(CommandError, match=r"unknown scenario 'gallop'.*goals.*high-five"):
        chosen_studies(STUDIES, ["gallop"])
    assert main(["behaviour", "--rows", "gallop"]) == ExitCode.USAGE


def test_a_trial_on_sensors_is_the_same_trial_with_another_plant() -> None:
    asked: list[Trial] = []
    study = Study("fake", {}, lambda trial, _: asked.append(trial))
    assert study.on(IDEAL) is study
    on_imu, sensed = study.on(IMU), study.sensed("any")
    assert len({study.name, on_imu.name, sensed.name}) == 3  # results are kept under these
    for one in (study, on_imu, sensed):
        one.run(7)
    assert asked == [Trial(7), Trial(7, sensors=IMU), Trial(7, sensors=IMU)]
    with closing(Trial(3).plant()) as ideal, closing(Trial(3, sensors=IMU).plant()) as plant:
        np.testing.assert_array_equal(ideal.truth().q, plant.truth().q)
        assert plant.read().time == plant.truth().time
        assert not np.array_equal(plant.read().q, plant.truth().q)


@pytest.mark.parametrize("words", ["border", "envelopes", "probability --motions 4"])
def test_a_folder_that_cannot_be_made_is_told(
    words: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    (tmp_path / "file").write_text("", encoding="utf-8")
    rows = str(tmp_path / "file" / "in" / "rows.sqlite")
    assert main([*words.split(), "--rows", rows]) == ExitCode.USAGE
    assert "choose a folder" in capsys.readouterr().err
