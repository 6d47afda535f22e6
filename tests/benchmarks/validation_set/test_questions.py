"""The exam's motions: every family writes, at any amplitude, and the halves stay apart."""

from dataclasses import replace

import pytest

from benchmarks.validation_set.drawing import TEST, TRAIN, Draw, Family
from benchmarks.validation_set.questions import (
    BORDER,
    BORDER_SHARE,
    EASY,
    FAMILIES,
    IMPOSSIBLE,
    STRATA,
    LateStart,
    Question,
    draw_name,
    draws,
    dynamic_questions,
    questions,
)
from go2_wbc.robot.model import RobotModel
from motions import compile_timeline

LEAST, LEAST_DYNAMIC = 600, 100
FLIP = 1.0


def all_borders() -> dict[str, float | None]:
    return {draw_name(family, number): FLIP for family, number in draws()}


@pytest.mark.parametrize("family", FAMILIES.values(), ids=lambda family: family.name)
def test_a_family_writes_a_motion_of_every_draw_from_easy_to_impossible(family: Family) -> None:
    for number in range(family.draws):
        for amplitude in (family.low, 1.0, family.high):
            assert Question(family, number, amplitude).line.end > 0.0


@pytest.mark.parametrize("family", FAMILIES.values(), ids=lambda family: family.name)
def test_the_same_draw_is_the_same_motion_and_another_amplitude_another_one(family: Family) -> None:
    assert Question(family, 0, 1.0).line == Question(family, 0, 1.0).line
    same_name = replace(Question(family, 0, 0.8).line, name="")
    assert same_name != replace(Question(family, 0, 1.0).line, name="")


def test_an_amplitude_scales_what_is_drawn_and_draws_nothing_else() -> None:
    family = FAMILIES["lean_aside"]
    small, large = (Question(family, 1, s).line for s in (0.5, 1.0))
    values = [[getattr(key, "value", 0.0) for key in line.keys] for line in (small, large)]
    assert max(map(abs, values[1])) == pytest.approx(2.0 * max(map(abs, values[0])))
    assert [key.start for key in small.keys] == [key.start for key in large.keys]


def test_families_are_many_and_lie_in_halves_that_no_other_one_changes() -> None:
    asked = questions(all_borders())
    assert len(asked) >= LEAST
    for stratum in STRATA:
        assert sum(q.stratum == stratum for q in asked) >= 0.31 * len(asked)
    assert sum(q.family.is_dynamic for q in asked) >= LEAST_DYNAMIC
    assert len({q.name for q in asked}) == len(asked)
    for is_dynamic in (False, True):
        halves = [f.half for f in FAMILIES.values() if f.is_dynamic is is_dynamic]
        assert set(halves) == {TRAIN, TEST}
        assert min(halves.count(TRAIN), halves.count(TEST)) >= len(halves) / 3
    halves = {name: family.half for name, family in FAMILIES.items()}
    assert (halves["crouch"], halves["lean_aside"]) == (TEST, TEST)
    assert (halves["roll_and_back"], halves["jump_up"]) == (TRAIN, TRAIN)


def test_strata_lie_around_the_amplitude_at_which_physics_changes_its_mind() -> None:
    low, high = BORDER_SHARE
    for question in questions(all_borders()):
        if question.stratum == BORDER:
            assert low - 1e-4 <= abs(question.amplitude - FLIP) <= high + 1e-4
        elif question.stratum == EASY:
            assert question.amplitude <= max(0.7, question.family.low)
        else:
            assert question.stratum == IMPOSSIBLE
            assert question.amplitude >= min(1.6, question.family.high)


def test_dynamic_motions_are_asked_by_themselves_and_of_each_family_alike() -> None:
    borders = all_borders() | {"spin 0": None}
    asked, own = dynamic_questions(borders), questions(borders)
    assert all(question.family.is_dynamic for question in asked)
    assert {q.name for q in own if q.family.is_dynamic} <= {q.name for q in asked}
    assert len({question.name for question in asked}) == len(asked)
    assert sum(question.family.half == TEST for question in asked) >= LEAST_DYNAMIC
    more = [q.stratum for q in asked if q.family.name == "pounce_farther" and q.draw >= 110]
    assert sorted(more) == [BORDER, BORDER, EASY, IMPOSSIBLE]
    assert not [q for q in asked if q.family.name == "spin" and q.stratum == BORDER]


def test_a_draw_without_a_border_gives_no_motion_there() -> None:
    family, number = draws()[0]
    found = questions({draw_name(family, number): None})
    assert {question.stratum for question in found} == {EASY, IMPOSSIBLE}


def test_a_late_entry_begins_where_the_robot_is_not() -> None:
    model, question = RobotModel(), Question(FAMILIES["late_entry"], 0, 1.0)
    plan, whole = question.plan(model), compile_timeline(question.line, model)
    assert isinstance(plan, LateStart)
    late = question.family.late
    assert plan.duration == pytest.approx(whole.duration - late)
    assert plan.at(0.0).body.p_world == pytest.approx(whole.at(late).body.p_world)


def test_the_numbers_of_a_draw_depend_on_family_and_number_only() -> None:
    first = [Draw("a", 0).between(0.0, 1.0) for _ in range(2)]
    assert first[0] == first[1]
    assert len({first[0], Draw("a", 1).between(0.0, 1.0), Draw("b", 0).between(0.0, 1.0)}) == 3
