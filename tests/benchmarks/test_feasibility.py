"""The benchmark of the feasibility check: the command, its judgement, its cache of physics."""

import json
from dataclasses import replace
from pathlib import Path

import pytest

from benchmarks import feasibility
from benchmarks.__main__ import main
from benchmarks.feasibility import DYNAMIC, EXAM, OUTCOMES, REFUSED, asked_of, judged, study_of
from benchmarks.study import IDEAL, IMU, TrialResult
from benchmarks.validation_set import physics
from benchmarks.validation_set.drawing import TEST, TRAIN
from benchmarks.validation_set.physics import BORDER, PLAYS, STRICT, Failures
from benchmarks.validation_set.questions import draw_name, draws
from benchmarks.validation_set.scores import Case
from controller.cli.common import ExitCode
from controller.go2_controller import GO2Controller
from controller.sweeps.trials import Trial
from go2_wbc.robot.model import RobotModel

FINE: Failures = dict.fromkeys(OUTCOMES, ())
BAD: Failures = dict.fromkeys(OUTCOMES, ("fell",))
COUNT = 12


def case(refused: bool, failed: bool, stratum: str = "border") -> Case:
    refusal = ("friction",) if refused else ()
    return Case("a 0 1", TEST, stratum, False, refusal, BAD if failed else FINE)


RIGHT = [*(50 * [case(True, True)]), *(50 * [case(False, False)])]


@pytest.mark.parametrize(
    ("cases", "lost", "is_ok", "is_ok_dynamic"),
    [
        (RIGHT, 0, True, True),
        (RIGHT, 1, False, False),
        (RIGHT[:99], 0, True, False),  # too few
        ([*RIGHT, replace(case(True, False), half=TRAIN)], 0, True, True),
        ([*RIGHT, case(True, False)], 0, True, True),
        ([*RIGHT, *(4 * [case(True, False)])], 0, False, False),
        ([*RIGHT, *(4 * [case(False, True)])], 0, False, False),
    ],
)
def test_the_bars_are_those_of_the_test_half_and_no_motion_is_lost(
    cases: list[Case], lost: int, is_ok: bool, is_ok_dynamic: bool
) -> None:
    said_ok, said = judged(cases, len(cases) + lost)
    assert said_ok is is_ok
    assert f"{lost} without a result" in said
    assert judged(cases, len(cases) + lost, DYNAMIC)[0] is is_ok_dynamic


def fake(trial: Trial, found: TrialResult, *_: object, **__: object) -> None:
    reasons = (REFUSED, *OUTCOMES)
    found.values = dict.fromkeys(reasons, float(trial.seed % 2))
    found.notes = dict.fromkeys(reasons, "friction; fell" if trial.seed % 2 else "")


def test_the_command_reports_and_writes_scores_and_no_motion_of_the_test_half(
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
    tmp_path: Path,
    results_folder: Path,
) -> None:
    monkeypatch.setattr(feasibility, "ask", fake)
    file = tmp_path / "scores.json"
    arguments = ["feasibility", "--motions", str(COUNT), "--jobs", "1", "--json"]
    assert main([*arguments, "--out", str(file)]) == ExitCode.OK
    first = capsys.readouterr()
    printed = json.loads(first.out)
    assert printed == json.loads(file.read_text())
    asked = asked_of(EXAM)[:COUNT]
    halves = [question.family.half for question in asked]
    assert printed["scores"]["test strict"]["n"] == halves.count(TEST)
    assert printed["scores"]["train strict"]["n"] == halves.count(TRAIN)
    names = [question.name for question in asked if question.family.half == TEST]
    assert not [name for name in names if name in first.out + first.err]
    assert main([*arguments, "--resume"]) == ExitCode.OK
    again = capsys.readouterr()
    assert json.loads(again.out) == printed
    assert f"{COUNT} finished trials are kept" in again.err


def test_dynamic_motions_of_one_half_are_asked_by_themselves(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str], results_folder: Path
) -> None:
    monkeypatch.setattr(feasibility, "ask", fake)
    arguments = ["feasibility", "--rows", "dynamic", "--half", "test", "--jobs", "1", "--json"]
    main([*arguments, "--motions", str(COUNT)])
    found = json.loads(capsys.readouterr().out)["scores"]
    assert (found["test dynamic"]["n"], found["train strict"]["n"]) == (COUNT, 0)


def test_only_borders_that_are_not_stored_are_bisected(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str], results_folder: Path
) -> None:
    names = [draw_name(*draw) for draw in draws()]
    written: dict[str, float | None] = {}
    monkeypatch.setattr(physics, "measure_border", found_border)
    monkeypatch.setattr(feasibility, "read_borders", lambda: dict.fromkeys(names[3:], 1.5))
    monkeypatch.setattr(feasibility, "write_borders", written.update)
    assert main(["feasibility", "--borders", "--jobs", "1"]) == ExitCode.OK
    assert list(written.items())[:4] == [
        (names[0], 0.25),
        (names[1], None),
        (names[2], 0.25),
        (names[3], 1.5),
    ]
    assert f"{len(names)} of {len(names)} borders, 1 beyond" in capsys.readouterr().out


def found_border(trial: Trial, found: TrialResult, numbers: list[int]) -> None:
    """Every second draw has a border."""
    found.values = {PLAYS: 3.0} if numbers[trial.seed] % 2 else {PLAYS: 3.0, BORDER: 0.25}


def test_a_motion_is_played_with_the_sensors_that_are_asked_for(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    asked: list[str] = []

    def play(_plan: object, _model: RobotModel, _seed: int, sensors: str) -> object:
        asked.append(sensors)
        return object()

    monkeypatch.setattr(feasibility, "play", play)
    monkeypatch.setattr(feasibility, "verdicts_of", lambda _run, _plan: BAD)
    for sensors in (IMU, IDEAL):
        assert study_of(EXAM).on(sensors).run(0).notes[STRICT] == "fell"
    assert asked == [IMU, IDEAL]


def test_a_robot_that_does_not_get_ready_is_a_lost_run_and_not_a_bug(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr(GO2Controller, "stand", lambda _go2: False)
    found = study_of(EXAM).run(0)
    assert (found.values, found.reason) == ({}, "lying, nothing asked yet")
