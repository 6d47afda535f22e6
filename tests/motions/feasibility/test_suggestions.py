"""Suggestions: the least change of each kind, and what is pasted is what was checked."""

import math
from functools import cache

import pytest

from go2_wbc.errors import CommandError
from motions import (
    CompiledPlan,
    FeasibilityChecker,
    FeasibilityReport,
    Suggestion,
    Timeline,
    compile_timeline,
    deg,
    suggest,
)
from motions.feasibility.suggestions import AIM, AMPLITUDE, BOTH, HIGHER, LOWER, SHIFT_TIME, TEMPO
from motions.language.keys import PhaseKey

CHECKER = FeasibilityChecker()
FAST_TWIST = Timeline(name="twist").body(yaw=deg(25), over=0.12).home(over=0.12)
TALL = Timeline(name="tall").body(z=0.12, over=1.0).body(roll=deg(15), over=0.8).home(over=1.0)
HASTY_PAW = Timeline(name="paw", shift_time=0.2).foot("FL", z=0.08, over=0.5).home(over=0.6)
SWAY = Timeline(name="sway").body(y=0.12, over=0.06).body(y=-0.12, over=0.06).home(over=0.2)
FEASIBLE = Timeline(name="bow").body(pitch=deg(5), over=1.0).home(over=1.0)


@cache
def _found(line: Timeline) -> tuple[Suggestion, ...]:
    return suggest(line, checker=CHECKER)


def _suggested(line: Timeline) -> dict[str, Suggestion]:
    return {one.kind: one for one in _found(line)}


@pytest.mark.parametrize("line", [FAST_TWIST, TALL, HASTY_PAW, SWAY], ids=lambda line: line.name)
def test_what_is_pasted_is_feasible_and_is_what_was_checked(line: Timeline) -> None:
    found = _found(line)
    assert found
    assert [one.change for one in found] == sorted(one.change for one in found)
    for one in found:
        pasted = eval(f"line{one.call}", {"line": line})
        assert pasted == one.motion
        assert CHECKER.check(pasted).ok
        assert one.call in str(one)
        assert one.as_dict()["duration"] == pytest.approx(pasted.end)


@pytest.mark.parametrize("line", [FAST_TWIST, TALL, HASTY_PAW, SWAY], ids=lambda line: line.name)
def test_one_step_less_is_refused_or_nearer_to_the_border(line: Timeline) -> None:
    for one in _found(line):
        kinds = [kind for kind in (TEMPO, AMPLITUDE, SHIFT_TIME, BOTH) if kind.name == one.kind]
        kinds = kinds or [LOWER if "(-" in one.call else HIGHER]
        steps = round(one.change * kinds[0].ladder[-1])
        assert kinds[0].apply(line, steps) == one.motion
        less = CHECKER.check(kinds[0].apply(line, steps - 1))
        assert steps == 1 or not less.ok or less.probability < AIM <= one.report.probability


def test_each_kind_is_found_where_it_helps() -> None:
    assert {"tempo", "amplitude"} <= set(_suggested(FAST_TWIST))
    assert {"height", "amplitude"} <= set(_suggested(TALL))
    assert "(-" in _suggested(TALL)["height"].call
    assert "tempo" not in _suggested(TALL)
    assert {"tempo", "shift time"} <= set(_suggested(HASTY_PAW))
    assert set(_suggested(SWAY)) == {"tempo and amplitude"}


def test_nothing_is_suggested_for_what_is_feasible_hopeless_or_a_plan() -> None:
    assert suggest(FEASIBLE, checker=CHECKER) == ()
    hopeless = Timeline().leg("FL", hip=0.0, thigh=-2.0, calf=-0.2, over=0.5).hold(0.5)
    assert suggest(hopeless, checker=CHECKER) == ()
    with pytest.raises(CommandError, match="motion as it is written"):
        suggest(compile_timeline(FEASIBLE, CHECKER.model), checker=CHECKER)


def test_the_nearest_lower_jump_is_found_in_few_tries(monkeypatch: pytest.MonkeyPatch) -> None:
    tried: list[float] = []

    def report(line: Timeline, _: FeasibilityChecker) -> FeasibilityReport | None:
        (jump,) = line.in_order(PhaseKey)
        tried.append(max(z for phase in jump.phases for _, _, z in phase.feet.values()))
        return CHECKER.check(FEASIBLE) if tried[-1] < 0.19 else None

    monkeypatch.setattr("motions.feasibility.suggestions._report", report)
    (only,) = suggest(Timeline().jump(height=0.4), checker=CHECKER)
    assert (only.kind, only.call) == ("jump", ".scale_jumps(0.45)")
    assert len(tried) < 10


def test_a_trunk_that_is_lower_all_along_comes_back_in_the_last_move() -> None:
    line = TALL.shift_height(-0.02)
    plan = compile_timeline(line, CHECKER.model)
    asked = compile_timeline(TALL, CHECKER.model)
    assert _height(plan, 1.4) == pytest.approx(_height(asked, 1.4) - 0.02, abs=3e-3)
    assert _height(plan, 2.8) == pytest.approx(_height(asked, 2.8), abs=1e-6)
    assert math.isclose(line.end, TALL.end)


def _height(plan: CompiledPlan, t: float) -> float:
    return float(plan.curves(t)[2])
