"""An interrupted run goes on where it ended; what does not fit is refused."""

import json
import math
import re
from dataclasses import replace
from functools import partial
from pathlib import Path

import pytest

from benchmarks import command
from benchmarks.__main__ import main
from benchmarks.study import Study, TrialResult
from controller.cli.common import ExitCode
from controller.sweeps.run import read_sweep
from controller.sweeps.targets import digest
from controller.sweeps.trials import Trial, TrialFailed
from tests.benchmarks.conftest import Only
from tests.benchmarks.support import fake, measure_well

TROT = Study("trot", {"": (("a", "", ""), ("b", "", ""))}, measure_well, prefix="")
FIRST = TrialResult({"a": 0.1 + 0.2, "b": math.inf}, {"b": "it fell"}, "said no", {"a": "x"})
SECOND = TrialResult({"a": math.nan, "b": -0.0}, notes={"a": "no plan"})

FILE = f"{digest(b'fake')}.sqlite"


class Interrupted:
    """Measures well, and stops like Ctrl-C before a seed; notes which seeds it was asked for."""

    def __init__(self, before: int) -> None:
        self.before, self.seeds = before, list[int]()

    def __call__(self, trial: Trial, found: TrialResult) -> None:
        if trial.seed == self.before:
            raise KeyboardInterrupt
        self.seeds.append(trial.seed)
        measure_well(trial, found)


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
    assert "2 finished trials are kept" in told.err
    assert "3/4 fake, seed 2: ok" in told.err
    assert list(results_folder.rglob("*.sqlite")) == [results_folder / "behaviour" / FILE]


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
    only: Only, results_folder: Path
) -> None:
    for found in (FIRST, SECOND):
        only(replace(TROT, measure=partial(give, found)))
        main(["behaviour", "--seeds", "1"])
        kept = read_sweep(results_folder / "behaviour" / f"{digest(b'trot')}.sqlite")
        (row,) = kept.rows
        assert (row["study"], row["trial"]) == ("trot", 0)
        assert repr(TrialResult(**json.loads(str(row["result"])))) == repr(found)
    about = {"what", "version", "python", "libraries", "benchmarks", "studies", "code"}
    assert (set(kept.about), kept.about["studies"]) == (about, "trot")


def give(given: TrialResult, _trial: Trial, found: TrialResult) -> None:
    found.values, found.failures, found.notes = given.values, given.failures, given.notes
    if given.reason:
        raise TrialFailed(given.reason)


def test_trials_of_other_code_are_refused_with_what_differs(
    only: Only, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    only(fake())
    main(["behaviour", "--seeds", "1"])
    monkeypatch.setattr(command, "code_digest", lambda *_: "another")
    capsys.readouterr()
    assert main(["behaviour", "--seeds", "2", "--resume"]) == ExitCode.USAGE
    assert re.search("benchmarks .*now another.*without --resume", capsys.readouterr().err)


@pytest.mark.parametrize("words", [["--resume"], []])
def test_a_file_of_something_else_is_neither_read_nor_removed(
    only: Only, results_folder: Path, words: list[str], capsys: pytest.CaptureFixture[str]
) -> None:
    only(fake())
    file = results_folder / "behaviour" / FILE
    file.parent.mkdir(parents=True)
    file.write_text("notes")
    assert main(["behaviour", *words]) == ExitCode.USAGE
    assert "no database" in capsys.readouterr().err
    assert file.read_text() == "notes"
