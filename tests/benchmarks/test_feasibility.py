"""The benchmark of the feasibility check: its motions, its reading of physics, its matrix."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path

import pytest

from benchmarks import feasibility
from benchmarks.__main__ import main
from benchmarks.feasibility import CLEAR_MOTIONS, ConfusionMatrix, render, what_went_wrong
from benchmarks.generated_motions import BROKEN, GOOD, NEAR, generated_motion, near_limit_motion
from benchmarks.runner import run_trial
from benchmarks.scenario import Measurement
from benchmarks.trials import Trial
from controller.cli.common import ExitCode
from controller.go2_controller import GO2Controller
from controller.motion_measurement import MotionMeasurement
from go2_wbc.robot.model import RobotModel
from motions import Timeline, compile_timeline

COUNT = 160
CLEAN = MotionMeasurement(
    fall=None,
    said=True,
    reason="done",
    slip=0.001,
    torque=0.4,
    speed=0.2,
    saturated=0.0,
    tracking=0.004,
    ends_off=0.002,
    feet_off=0.003,
    joint_distance=0.2,
    touched=0.0,
)


@pytest.fixture(scope="module")
def model() -> RobotModel:
    return RobotModel()


def test_there_are_as_many_good_motions_as_broken_ones_of_every_kind() -> None:
    made = [generated_motion(seed) for seed in range(COUNT)]
    kinds = [one.kind for one in made]
    assert [kind in BROKEN for kind in kinds].count(True) == COUNT / 2
    assert set(kinds) == {*GOOD, *BROKEN}
    assert {kinds.count(kind) for kind in kinds} == {COUNT // (len(GOOD) + len(BROKEN))}


def test_a_seed_gives_the_same_motion_every_time_and_another_seed_another_one() -> None:
    assert generated_motion(7) == generated_motion(7)
    assert generated_motion(7).line.keys != generated_motion(7 + 2 * len(BROKEN)).line.keys


def test_near_the_limits_there_are_motions_of_every_kind() -> None:
    assert {near_limit_motion(seed).kind for seed in range(len(NEAR))} == set(NEAR)


def test_a_wrong_entry_begins_where_the_robot_is_not(model: RobotModel) -> None:
    seed = 1 + 2 * list(BROKEN).index("wrong entry")
    made = generated_motion(seed)
    plan, whole = made.plan(model), compile_timeline(made.line, model)
    assert plan.duration == pytest.approx(whole.duration - made.start)
    assert plan.at(0.0).body.p_world == pytest.approx(whole.at(made.start).body.p_world)


def test_nothing_is_held_against_a_clean_run(model: RobotModel) -> None:
    assert what_went_wrong(CLEAN, generated_motion(0).plan(model)) == []


@pytest.mark.parametrize(
    ("run", "word"),
    [
        (replace(CLEAN, fall="fell at t=3.20 s"), "fell"),
        (replace(CLEAN, slip=0.012), "slipped 12 mm"),
        (replace(CLEAN, saturated=0.02), "saturated for 20 ms"),
        (replace(CLEAN, joint_distance=-0.05), "0.050 rad beyond"),
        (replace(CLEAN, speed=1.1), "110 % of its speed"),
        (replace(CLEAN, tracking=0.06), "6 cm off"),
        (replace(CLEAN, ends_off=0.07), "7 cm off"),
        (replace(CLEAN, feet_off=0.08), "8 cm off"),
        (replace(CLEAN, touched=0.1), "touched itself"),
    ],
)
def test_what_physics_shows_is_said_in_words(
    model: RobotModel, run: MotionMeasurement, word: str
) -> None:
    (harm,) = what_went_wrong(run, generated_motion(0).plan(model))
    assert word in harm


def test_a_place_out_of_reach_counts_although_the_leg_follows_its_plan(model: RobotModel) -> None:
    line = Timeline(name="too high").foot("FR", x=0.1, z=1.0, over=1.5).home(over=1.5)
    (harm,) = what_went_wrong(CLEAN, compile_timeline(line, model))
    assert "cm off what was written" in harm


def result(refused: float, failed: float) -> Measurement:
    return Measurement(
        {"feasibility.refused": refused, "feasibility.failed": failed},
        {"feasibility.failed": "fell"} if failed else {},
    )


NONE = ConfusionMatrix((), {})


def matrix(*pairs: tuple[float, float]) -> ConfusionMatrix:
    measured = {seed: result(*pair) for seed, pair in enumerate(pairs)}
    return ConfusionMatrix.of(measured, generated_motion)


def test_precision_and_recall_are_shares_of_the_refused_and_of_the_failed() -> None:
    found = matrix((1, 1), (1, 1), (1, 1), (1, 0), (0, 1), (0, 1), (0, 0))
    assert found.precision == pytest.approx(3 / 4)
    assert found.recall == pytest.approx(3 / 5)
    assert [case.seed for case in found.wrong] == [3, 4, 5]
    assert not found.ok
    assert "precision 0.750, recall 0.600" in render(found, NONE)
    assert max(map(len, render(found, NONE).splitlines())) <= 80


def test_all_right_is_ok_and_a_lost_run_is_not() -> None:
    assert matrix((1, 1), (0, 0)).ok
    trials = {0: result(1, 1), 1: Measurement({}, reason="fell")}
    lost = ConfusionMatrix.of(trials, generated_motion)
    assert not lost.ok
    assert "seed 1: no result, fell" in render(lost, NONE)


def fake(trial: Trial) -> Measurement:
    return result(float(trial.seed % 2), float(trial.seed % 2))


def test_the_command_reports_and_writes_the_matrix(
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
    tmp_path: Path,
    results_folder: Path,
) -> None:
    for name in ("CLEAR_MOTIONS", "NEAR_LIMITS"):
        monkeypatch.setattr(feasibility, name, replace(getattr(feasibility, name), measure=fake))
    file = tmp_path / "matrix.json"
    arguments = ["feasibility", "--motions", "6", "--near", "4", "--jobs", "1", "--json"]
    assert main([*arguments, "--out", str(file)]) == ExitCode.OK
    printed = json.loads(capsys.readouterr().out)
    assert printed == json.loads(file.read_text())
    assert printed["matrix"] == {
        "refused_failed": 3,
        "refused_done": 0,
        "accepted_failed": 0,
        "accepted_done": 3,
    }
    assert len(printed["near_limits"]["cases"]) == 4
    capsys.readouterr()
    assert main([*arguments, "--resume"]) == ExitCode.OK
    again = capsys.readouterr()
    assert json.loads(again.out) == printed
    assert "10 finished trials are taken" in again.err


def test_a_robot_that_does_not_get_ready_is_a_lost_run_and_not_a_bug(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr(GO2Controller, "stand", lambda _go2: False)
    measured = run_trial(CLEAR_MOTIONS.measure, 0)
    assert (measured.values, measured.reason) == ({}, "lying, nothing asked yet")


@pytest.mark.slow
@pytest.mark.parametrize("seed", range(0, 2 * len(BROKEN), 3))
def test_the_check_foresees_what_physics_does(seed: int) -> None:
    measured, is_broken = CLEAR_MOTIONS.measure(Trial(seed)), generated_motion(seed).kind in BROKEN
    assert measured.values["feasibility.failed"] == float(is_broken)
    assert measured.values["feasibility.refused"] == float(is_broken)
