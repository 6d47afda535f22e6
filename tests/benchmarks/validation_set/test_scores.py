"""How often verdicts foretell physics: shares, their intervals, the table."""

from dataclasses import replace

import pytest

from benchmarks.validation_set.drawing import TEST, TRAIN
from benchmarks.validation_set.physics import LENIENT, STOPS, STRICT, Failures
from benchmarks.validation_set.scores import Case, Score, Share, render, scores, wrong_ones
from controller.motion_measurement import FELL, NOT_DONE, UNPLANNED


def strictly(*harm: str) -> Failures:
    return {STRICT: harm, STOPS: harm, LENIENT: (), FELL: ()}


def case(refused: bool, failed: bool, *, half: str = TEST, why: str = "slip 12 mm") -> Case:
    harm = (why,) if failed else ()
    outcome = {**strictly(*harm), FELL: ("fell",) if why == "fell" else ()}
    refusal = ("friction",) if refused else ()
    return Case("name 0 1.0", half, "easy", False, refusal, outcome)


CASES = [
    *(3 * [case(True, True)]),
    case(True, False),
    *(2 * [case(False, True)]),
    *(4 * [case(False, False)]),
]


def test_refusals_and_passes_are_judged_in_both_directions_by_each_definition() -> None:
    score = Score.of(CASES)
    assert [(share.right, share.n) for share in score] == [(3, 4), (3, 5), (4, 6), (4, 5)]
    assert score.least == pytest.approx(0.6)
    assert score.n == len(CASES)
    cases = [case(True, True), case(True, True, why="fell")]
    assert Score.of(cases, STRICT).refused_right == Share(2, 2)
    assert Score.of(cases, LENIENT).refused_right == Share(0, 2)
    assert Score.of(cases, FELL).refused_right == Share(1, 2)


def test_the_interval_is_the_one_of_wilson() -> None:
    # Newcombe, Statistics in Medicine 17 (1998), table I, method 3.
    assert Share(81, 263).interval == pytest.approx((0.2553, 0.3662), abs=1e-4)
    assert Share(15, 148).interval == pytest.approx((0.0624, 0.1605), abs=1e-4)
    assert Share(0, 20).interval == pytest.approx((0.0, 0.1611), abs=1e-4)
    assert Share(0, 0).interval == (0.0, 1.0)


def test_the_table_has_both_halves_what_has_no_plan_and_what_play_noticed() -> None:
    cases = [*CASES, *(case(True, True, half=TRAIN) for _ in range(100))]
    table = render(cases)
    assert max(map(len, table.splitlines())) <= 80
    assert "test strict" in table
    assert "slip" in table
    assert scores(cases)["train strict"].n == 100
    cases = [
        Case("a", TEST, "easy", True, ("dynamic plan",), strictly(UNPLANNED)),
        Case("b", TEST, "easy", True, (), strictly()),
    ]
    found = scores(cases)
    assert (found["test dynamic"].n, found["test solved"].n) == (2, 1)
    told = replace(case(False, True), outcome=strictly(NOT_DONE, "fell"))
    unplanned = replace(case(True, True), outcome=strictly(UNPLANNED))
    said = render([told, case(True, True), case(False, False), unplanned]).splitlines()[-1]
    assert said.startswith("Of 2 motions that were played and went wrong")
    assert said.endswith("says so of 1.")


def test_of_the_test_half_no_motion_is_named() -> None:
    wrong = wrong_ones([case(False, True, half=TRAIN), case(False, True), case(True, True)])
    assert wrong == ["name 0 1.0 (easy): passed; slip 12 mm"]
