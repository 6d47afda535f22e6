"""What counts as having gone wrong, by each definition."""

import math
from dataclasses import replace
from pathlib import Path

import pytest

from benchmarks.validation_set import physics
from benchmarks.validation_set.physics import (
    BORDER,
    LENIENT,
    NEAR,
    PLAYS,
    STOPS,
    STRICT,
    borders_of,
    play,
    read_borders,
    verdicts_of,
    write_borders,
)
from benchmarks.validation_set.questions import FAMILIES, Question, draw_name, draws, questions
from controller.motion_measurement import FELL, UNPLANNED, MotionMeasurement
from go2_wbc.errors import ConfigError
from go2_wbc.motion_plan import MotionPlan
from go2_wbc.robot.model import RobotModel
from motions import Timeline, compile_timeline
from motions.plan.compiled_plan import Problem

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
    stopped=0.0,
    touched=0.0,
    trunk_off=0.004,
    turned_off=0.01,
    paw_off=0.005,
    landed_off=0.003,
)


@pytest.fixture(scope="module")
def plan() -> MotionPlan:
    return compile_timeline(Timeline().body(z=-0.03, over=0.8).home(over=0.8), RobotModel())


def test_what_goes_wrong_counts_by_the_definitions_that_look_at_it(plan: MotionPlan) -> None:
    found = verdicts_of(CLEAN, plan)
    assert found == dict.fromkeys((STRICT, STOPS, LENIENT, FELL), ())
    found = verdicts_of(replace(CLEAN, stopped=0.3, joint_distance=-0.001), plan)
    assert (found[STRICT], found[STOPS]) == ((), ("on a stop 300 ms",))
    found = verdicts_of(replace(CLEAN, fall="fell at t=3.20 s"), plan)
    assert set(found.values()) == {("fell",)}
    unplanned = replace(plan, problems=(Problem("dynamic plan", "trunk", 0.0),))  # type: ignore[type-var]
    assert verdicts_of(CLEAN, unplanned)[STRICT] == (UNPLANNED,)


@pytest.mark.parametrize(
    ("run", "strict", "lenient"),
    [
        (replace(CLEAN, said=False), "not done", ""),
        (replace(CLEAN, slip=0.012), "slip 12 mm", "slip 12 mm"),
        (replace(CLEAN, trunk_off=0.031), "trunk 31 mm off", ""),
        (replace(CLEAN, turned_off=math.radians(8.2)), "trunk 8.2 deg off", ""),
        (replace(CLEAN, paw_off=0.033), "paw 33 mm off", ""),
        (replace(CLEAN, landed_off=0.017), "landed 17 mm beside", ""),
        (replace(CLEAN, touched=0.02), "touch 20 ms", "touch 20 ms"),
        (replace(CLEAN, saturated=0.02), "saturated 20 ms", "saturated 20 ms"),
        (replace(CLEAN, joint_distance=-0.03), "joint 0.030 rad past", "joint 0.030 rad past"),
        (replace(CLEAN, joint_distance=-0.01), "", "joint 0.010 rad past"),
        (replace(CLEAN, feet_off=0.06), "", "60 mm off"),
        (replace(CLEAN, speed=1.1), "", "joint at 110 % speed"),
    ],
)
def test_what_physics_shows_is_said_in_words(
    plan: MotionPlan, run: MotionMeasurement, strict: str, lenient: str
) -> None:
    found = verdicts_of(run, plan)
    assert found[STRICT] == ((strict,) if strict else ())
    assert found[LENIENT] == ((lenient,) if lenient else ())
    assert not found[FELL]


def test_a_place_out_of_reach_counts_although_the_leg_follows_its_plan() -> None:
    line = Timeline(name="too high").foot("FR", x=0.1, z=1.0, over=1.5).home(over=1.5)
    (harm,) = verdicts_of(CLEAN, compile_timeline(line, RobotModel()))[STRICT]
    assert harm.startswith("paw")


@pytest.mark.parametrize(("name", "is_done"), [("crouch", True), ("two_feet_at_once", False)])
def test_physics_decides(name: str, is_done: bool) -> None:
    family, model = FAMILIES[name], RobotModel()
    question = Question(family, 0, family.low if is_done else family.high)
    made = question.plan(model)
    assert bool(verdicts_of(play(made, model, 0), made)[STRICT]) is not is_done


def test_a_joint_that_physics_holds_at_its_stop_is_seen() -> None:
    question, model = Question(FAMILIES["nose_up"], 0, 2.0), RobotModel()
    plan = question.plan(model)
    found = verdicts_of(play(plan, model, 0), plan)
    assert any(why.startswith("on a stop") for why in found[STOPS])
    assert set(found[STOPS]) > set(found[STRICT])


def test_a_border_is_found_between_what_is_done_and_what_fails(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    asked: list[float] = []

    def is_done(question: Question) -> bool:
        asked.append(question.amplitude)
        return question.amplitude < 0.83

    monkeypatch.setattr(physics, "is_done", is_done)
    found = borders_of([0]).run(0)
    assert found.values[BORDER] == pytest.approx(0.83, rel=NEAR - 1.0)
    assert found.values[PLAYS] == len(asked)


@pytest.mark.parametrize(("answer", "word"), [(True, "highest"), (False, "lowest")])
def test_no_border_is_made_up_where_physics_does_not_change_its_mind(
    monkeypatch: pytest.MonkeyPatch, answer: bool, word: str
) -> None:
    monkeypatch.setattr(physics, "is_done", lambda _question: answer)
    found = borders_of([0]).run(0)
    assert BORDER not in found.values
    assert word in found.reason


def test_a_border_is_searched_for_its_own_draw_from_amplitude_1(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    asked: list[Question] = []

    def is_done(question: Question) -> bool:
        asked.append(question)
        return question.amplitude < 0.5

    monkeypatch.setattr(physics, "is_done", is_done)
    row = next(row for row, (_, number) in enumerate(draws()) if number == 1)
    borders_of([row]).run(0)
    assert {(q.family, q.draw) for q in asked} == {draws()[row]}
    assert asked[0].amplitude == 1.0
    assert min(q.amplitude for q in asked) >= draws()[row][0].low


KEPT: dict[str, float | None] = {"crouch 0": 1.25, "rise 0": None}


def test_borders_are_those_of_the_exam_as_they_were_written_and_a_damaged_file_is_told(
    tmp_path: Path,
) -> None:
    file = tmp_path / "borders.json"
    write_borders(KEPT, file)
    assert read_borders(file) == KEPT
    assert len(file.read_text().splitlines()) == 2 + len(KEPT), "one entry a line"
    file.write_text("{")
    with pytest.raises(ConfigError, match="--borders"):
        read_borders(file)
    with pytest.raises(ConfigError, match="cannot be read"):
        read_borders(tmp_path / "none.json")
    kept = read_borders()
    assert set(kept) <= {draw_name(family, number) for family, number in draws()}
    for question in questions(kept):
        assert question.amplitude > 0.0
