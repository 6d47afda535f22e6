"""An interrupted run goes on where it ended; what does not fit is refused."""

import math
from dataclasses import replace
from pathlib import Path

import pytest

from benchmarks.__main__ import main
from benchmarks.store import file_of, opened, settings_header
from benchmarks.study import Study, TrialResult
from controller.cli.common import ExitCode
from controller.sweeps.run import read_sweep
from controller.sweeps.trials import Trial
from go2_wbc.errors import ConfigError
from tests.benchmarks.conftest import Only
from tests.benchmarks.support import fake, measure_well

TROT = Study("trot", {"": (("a", "", ""), ("b", "", ""))}, measure_well, prefix="")
FIRST = TrialResult({"a": 0.1 + 0.2, "b": math.inf}, {"b": "it fell"}, "said no", {"a": "x"})
SECOND = TrialResult({"a": math.nan, "b": -0.0}, notes={"a": "no plan"})


class Interrupted:
    """Measures well, and stops like Ctrl-C before a seed; notes which seeds it was asked for."""

    def __init__(self, before: int) -> None:
        self.before, self.seeds = before, list[int]()

    def __call__(self, trial: Trial, found: TrialResult) -> None:
        if trial.seed == self.before:
            raise KeyboardInterrupt
        self.seeds.append(trial.seed)
        measure_well(trial, found)


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    """Two trials of a run that has ended."""
    with opened(tmp_path, [TROT], resume=False) as store:
        store.add(TROT, 0, FIRST)
        store.add(TROT, 7, SECOND)
    return tmp_path


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
    assert [path.name for path in results_folder.rglob("*.sqlite")] == ["fake.sqlite"]


@pytest.mark.parametrize(("words", "seeds"), [(("5", "--resume"), [2, 3, 4]), (("2",), [0, 1])])
def test_more_seeds_only_add_to_what_is_there_and_without_resume_all_is_measured_again(
    only: Only, words: tuple[str, ...], seeds: list[int]
) -> None:
    later = Interrupted(99)
    only(fake())
    main(["behaviour", "--seeds", "2"])
    only(fake(later))
    assert main(["behaviour", "--seeds", *words]) == ExitCode.OK
    assert later.seeds == seeds


def test_trials_come_back_to_the_last_bit_as_rows_that_say_what_they_depend_on(
    folder: Path,
) -> None:
    with opened(folder, [TROT], resume=True) as store:
        found = store.finished
    assert set(found) == {("trot", 0), ("trot", 7)}
    assert found["trot", 0] == FIRST
    assert found["trot", 7] == replace(SECOND, values={"b": 0.0}), "nan is no value"
    assert math.copysign(1.0, found["trot", 7].values["b"]) == -1.0
    kept = read_sweep(file_of(folder, TROT))
    assert kept.about == {"what": "trot", **settings_header()}
    assert set(kept.about) == {"what", "version", "python", "libraries", "settings", "code"}
    assert kept.rows[0]["a"] == 0.1 + 0.2


@pytest.mark.parametrize("name", ["version", "python", "settings", "code"])
def test_trials_under_other_settings_are_refused_with_what_differs(
    folder: Path, name: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    other = {**settings_header(), name: "another"}
    monkeypatch.setattr("benchmarks.store.settings_header", lambda: other)
    with (
        pytest.raises(ConfigError, match=rf"{name} .*now another.*without --resume"),
        opened(folder, [TROT], resume=True),
    ):
        pass


def test_a_file_of_something_else_is_neither_read_nor_removed(tmp_path: Path) -> None:
    file_of(tmp_path, TROT).write_text("notes")
    for resume in (True, False):
        with (
            pytest.raises(ConfigError, match="no database"),
            opened(tmp_path, [TROT], resume=resume),
        ):
            pass
    assert file_of(tmp_path, TROT).read_text() == "notes"


def test_a_changed_line_of_code_changes_the_settings(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "controller").mkdir()
    file = tmp_path / "controller" / "gain.py"
    monkeypatch.setattr("benchmarks.store.ROOT", tmp_path)
    codes = []
    for text in ("GAIN = 1.0", "GAIN = 2.0", "GAIN = 1.0"):
        file.write_text(text)
        codes.append(settings_header()["code"])
    assert codes[0] == codes[2] != codes[1]
