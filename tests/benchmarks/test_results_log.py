"""An interrupted run goes on where it ended; what does not fit is refused."""

from __future__ import annotations

import json
import math
from pathlib import Path

import pytest

from benchmarks import results_log
from benchmarks.__main__ import main
from benchmarks.results_log import ResultsLog, settings_header
from benchmarks.scenario import Measurement
from controller.cli.common import ExitCode
from controller.sweeps.trials import Trial
from go2_wbc.errors import ConfigError
from tests.benchmarks.conftest import Only
from tests.benchmarks.support import fake, measure_well

FIRST = Measurement({"a": 0.1 + 0.2, "b": math.inf}, {"b": "it fell"}, "said no")
SECOND = Measurement({"a": math.nan})


class Interrupted:
    """Measures well, and stops like Ctrl-C before a seed; notes which seeds it was asked for."""

    def __init__(self, before: int) -> None:
        self.before, self.seeds = before, list[int]()

    def __call__(self, trial: Trial) -> Measurement:
        if trial.seed == self.before:
            raise KeyboardInterrupt
        self.seeds.append(trial.seed)
        return measure_well(trial)


@pytest.fixture
def file(tmp_path: Path) -> Path:
    """Two results of a run that has ended."""
    file = tmp_path / "results.jsonl"
    log = ResultsLog(file, resume=False)
    log.append("trot", 0, FIRST)
    log.append("trot", 7, SECOND)
    return file


def test_an_interrupted_run_goes_on_with_what_is_left(
    only: Only, capsys: pytest.CaptureFixture[str], results_folder: Path
) -> None:
    whole, first, second = Interrupted(99), Interrupted(2), Interrupted(99)
    only(fake(whole))
    assert main(["behaviour", "--seeds", "4", "--json"]) == ExitCode.OK
    expected = capsys.readouterr().out
    only(fake(first))
    assert main(["behaviour", "--seeds", "4", "--json"]) == ExitCode.INTERRUPTED
    only(fake(second))
    capsys.readouterr()
    assert main(["behaviour", "--seeds", "4", "--json", "--resume"]) == ExitCode.OK
    told = capsys.readouterr()
    assert (first.seeds, second.seeds) == ([0, 1], [2, 3])
    assert told.out == expected
    assert "2 finished trials are taken from" in told.err
    assert "3/4 fake, seed 2: ok" in told.err
    assert [path.name for path in results_folder.iterdir()] == ["behaviour.jsonl"]


def test_more_seeds_than_before_only_add_to_it(only: Only) -> None:
    later = Interrupted(99)
    only(fake())
    main(["behaviour", "--seeds", "2"])
    only(fake(later))
    assert main(["behaviour", "--seeds", "5", "--resume"]) == ExitCode.OK
    assert later.seeds == [2, 3, 4]


def test_without_resume_everything_is_measured_again(only: Only) -> None:
    again = Interrupted(99)
    only(fake())
    main(["behaviour", "--seeds", "2"])
    only(fake(again))
    main(["behaviour", "--seeds", "2"])
    assert again.seeds == [0, 1]


def test_results_come_back_to_the_last_digit(file: Path) -> None:
    log = ResultsLog(file, resume=True)
    assert set(log.finished) == {("trot", 0), ("trot", 7)}
    assert log.finished["trot", 0] == FIRST
    assert math.isnan(log.finished["trot", 7].values["a"])


def test_the_first_line_says_what_the_results_depend_on(file: Path) -> None:
    header = json.loads(file.read_text().splitlines()[0])
    assert header == settings_header()
    assert set(header) == {"version", "python", "libraries", "settings", "code"}


@pytest.mark.parametrize("cut", [1, 5, 30])
def test_a_damaged_last_line_is_ignored_and_replaced(file: Path, cut: int) -> None:
    file.write_bytes(file.read_bytes()[:-cut])
    log = ResultsLog(file, resume=True)
    assert set(log.finished) == {("trot", 0)}
    assert "its damaged last line is ignored" in log.remark
    log.append("trot", 7, SECOND)
    again = ResultsLog(file, resume=True)
    assert set(again.finished) == {("trot", 0), ("trot", 7)}
    assert "is ignored" not in again.remark


@pytest.mark.parametrize("line", [1, 2])
def test_damage_before_the_last_line_is_refused(file: Path, line: int) -> None:
    lines = file.read_text().splitlines(keepends=True)
    lines[line] = lines[line][:20] + "\n"
    file.write_text("".join([*lines, lines[0]]) if line == 2 else "".join(lines))
    with pytest.raises(ConfigError, match=r"line .* is damaged.*without --resume"):
        ResultsLog(file, resume=True)


@pytest.mark.parametrize("text", ["", "\n", "[]\n", "half a head"])
def test_a_file_without_its_first_line_is_refused(file: Path, text: str) -> None:
    file.write_text(text)
    with pytest.raises(ConfigError, match="without --resume"):
        ResultsLog(file, resume=True)


@pytest.mark.parametrize("name", ["version", "python", "settings", "code"])
def test_results_under_other_settings_are_refused_with_what_differs(
    file: Path, name: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    other = {**settings_header(), name: "another"}
    monkeypatch.setattr(results_log, "settings_header", lambda: other)
    with pytest.raises(ConfigError, match=rf"other settings \({name} .*now another\)"):
        ResultsLog(file, resume=True)


def test_other_settings_are_a_usage_error_that_keeps_the_results(
    only: Only, capsys: pytest.CaptureFixture[str], results_folder: Path
) -> None:
    only(fake())
    main(["behaviour", "--seeds", "1"])
    file = results_folder / "behaviour.jsonl"
    old = file.read_text().replace('"python": "', '"python": "2.')
    file.write_text(old)
    assert main(["behaviour", "--seeds", "1", "--resume"]) == ExitCode.USAGE
    assert "holds results under other settings (python 2." in capsys.readouterr().err
    assert file.read_text() == old


def test_a_changed_line_of_code_changes_the_settings(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "controller").mkdir()
    file = tmp_path / "controller" / "gain.py"
    monkeypatch.setattr(results_log, "ROOT", tmp_path)
    codes = []
    for text in ("GAIN = 1.0", "GAIN = 2.0", "GAIN = 1.0"):
        file.write_text(text)
        codes.append(settings_header()["code"])
    assert codes[0] == codes[2] != codes[1]
