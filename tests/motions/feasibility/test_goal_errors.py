"""``physics="nearest"``: what the robot cannot do is done nearly, with its deviation told."""

import re
from dataclasses import replace

import numpy as np
import pytest

from go2_wbc.errors import PlanNotFound, TimelineError
from go2_wbc.legs import LEGS, Leg
from motions import CompiledPlan, FeasibilityChecker, Timeline, deg
from motions.dynamics.phases import Tolerance
from motions.feasibility.goal_errors import Departure
from tests.solver import needs_solver

SWAY = (
    Timeline(physics="nearest")
    .body(y=0.06, over=0.2)
    .body(y=-0.06, over=0.2)
    .home(over=0.4)
    .hold(0.2)
)
"""Faster than friction allows."""
HIGH = Timeline(physics="nearest", shift_time=0.3).foot("FR", z=0.5, over=0.5).down("FR", over=0.5)
"""Higher and faster than a paw can go."""


def test_as_it_is_written_it_is_refused(checker: FeasibilityChecker) -> None:
    assert not checker.check(replace(SWAY, physics="as_written")).ok


@needs_solver
def test_the_nearest_motion_is_feasible_and_says_how_far_off_it_is(
    checker: FeasibilityChecker,
) -> None:
    plan = checker.plan(SWAY)
    assert isinstance(plan, CompiledPlan)
    assert plan.has_dynamic_spans
    assert plan.duration == pytest.approx(SWAY.end)
    report = checker.check(plan)
    assert report.ok, report.table()
    own = plan.dynamic[0].trajectory.position_deviation
    assert 0.01 < own < 0.05
    assert report.margins["off by"].value == pytest.approx(1e3 * own, abs=1.0)
    (departed,) = report.departures
    assert 1e3 * departed.place == pytest.approx(report.margins["off by"].value)
    assert departed.subject == report.margins["off by"].subject
    assert departed.place_time == report.margins["off by"].time
    assert np.degrees(departed.angle) == pytest.approx(report.margins["turned off by"].value)
    assert departed.lag == plan.dynamic[0].trajectory.lag
    assert report.as_dict()["departures"][0]["place"] == departed.place


@pytest.mark.parametrize(
    ("lag", "said"), [(0.02, "20 ms late"), (0.0, "0 ms late"), (-0.4, "400 ms early")]
)
def test_a_departure_says_where_it_is_greatest(lag: float, said: str) -> None:
    turn, foot = (np.radians(4.0), 1.25), (0.02, "FR_foot", 0.6)
    departed = Departure(0.5, 2.0, 0.025, "FL_foot", 0.7, *turn, lag, *foot)
    assert str(departed) == (
        "0.50 to 2.00 s is the nearest to what was written: 25 mm off\n"
        f"(FL_foot at 0.70 s), 4.0 deg (at 1.25 s), {said}."
    )


@needs_solver
def test_the_table_ends_with_how_far_it_had_to_go_where_and_how_late(
    checker: FeasibilityChecker,
) -> None:
    report = checker.check(SWAY)
    *_, first, second = lines = report.table().splitlines()
    assert re.fullmatch(r"0.00 to 1.00 s is the nearest to what was written: \d+ mm off", first)
    said = r"\(trunk at 0.\d\d s\), [\d.]+ deg \(at 0.\d\d s\), \d+ ms (late|early)\."
    assert re.fullmatch(said, second)
    assert max(map(len, lines)) <= 80
    slow = checker.check(Timeline(physics="nearest").body(y=0.03, over=0.8).home(over=0.8))
    assert not slow.departures
    assert "nearest" not in slow.table()


@needs_solver
def test_a_raised_foot_that_is_lowered_is_told_with_its_distance_and_when(
    checker: FeasibilityChecker,
) -> None:
    """Feet counted where they land only: of a paw 0.2 m too low nothing but the trunk was told."""
    line = HIGH.home(over=0.8).hold(0.2)
    (departed,) = checker.check(line).departures
    plan = checker.plan(line)
    written = checker.plan(replace(line, physics="as_written"), check=False)
    assert isinstance(plan, CompiledPlan)
    assert isinstance(written, CompiledPlan)
    t = np.linspace(0.0, line.end, 300)
    feet = [one.curves(t)[:, 18:].reshape(-1, 4, 3) for one in (plan, written)]
    off = np.linalg.norm(feet[0] - feet[1], axis=2)
    when, leg = np.unravel_index(int(off.argmax()), off.shape)
    assert departed.foot == "FR_foot"
    assert LEGS[leg] is Leg.FR
    assert departed.foot_place > 2.0 * departed.place
    assert departed.foot_place == pytest.approx(off.max(), abs=0.01)
    assert departed.foot_time == pytest.approx(t[when], abs=0.05)
    last = str(departed).splitlines()[-1]
    assert re.fullmatch(r"In the air it is \d+ mm \(FR_foot at \d\.\d\d s\) off\.", last)


@needs_solver
def test_a_narrow_tolerance_refuses_it_with_what_was_written_and_how_near_one_gets(
    checker: FeasibilityChecker,
) -> None:
    report = checker.check(replace(SWAY, tolerance=Tolerance(position=0.005)))
    checks = [one.check for one in report.failures]
    assert checks[0] == "nearest motion"
    assert "mm" in report.failures[0].note
    assert len(checks) > 1


def test_what_can_be_done_stays_as_it_is_written(
    checker: FeasibilityChecker, monkeypatch: pytest.MonkeyPatch
) -> None:
    def refuse(*args: object, **others: object) -> None:
        raise PlanNotFound("it was solved")

    monkeypatch.setattr("motions.plan.timeline_compiler.nearest_cached", refuse)
    slow = Timeline().body(y=0.03, over=0.8).home(over=0.8)
    near, written = checker.plan(replace(slow, physics="nearest")), checker.plan(slow)
    for t in np.linspace(0.0, slow.end, 20):
        np.testing.assert_allclose(near.at(float(t)).row, written.at(float(t)).row)


@needs_solver
def test_before_and_after_a_part_that_is_mended_all_stays_as_it_is_written(
    checker: FeasibilityChecker,
) -> None:
    paw = Timeline().foot("FR", z=0.05, over=0.7).home(over=0.7)
    line = paw.then(replace(SWAY, physics="as_written"), paw)
    near, written = checker.plan(replace(line, physics="nearest")), checker.plan(line, check=False)
    assert isinstance(near, CompiledPlan)
    (span,) = near.dynamic
    assert span.start == pytest.approx(paw.end, abs=0.02)
    assert span.end == pytest.approx(paw.end + SWAY.end, abs=0.3)
    outside = [*np.arange(0.0, span.start, 0.3), *np.arange(span.end + 0.01, line.end, 0.3)]
    for t in outside:
        np.testing.assert_allclose(near.at(float(t)).row, written.at(float(t)).row, atol=1e-9)
    during = span.start + 0.2
    assert not np.allclose(near.at(during).row, written.at(during).row)


@needs_solver
def test_two_feet_at_once_are_raised_where_the_trunk_was_written_not_balanced(
    checker: FeasibilityChecker,
) -> None:
    line = Timeline(physics="nearest", shift_time=0.3).hold(0.3).foot("FL", z=0.04, over=0.2).also()
    line = line.foot("RR", z=0.04, over=0.2).hold(0.1).home(over=0.4).hold(0.3)
    plan = checker.plan(line)
    assert isinstance(plan, CompiledPlan)
    (span,) = plan.dynamic
    level = span.written(np.linspace(span.start, span.end, 20))
    np.testing.assert_allclose(level[:, 1], level[0, 1], atol=1e-6)
    assert span.trajectory.position_deviation < 0.03


def test_what_is_no_motion_to_be_near_to_is_a_failure_in_words(checker: FeasibilityChecker) -> None:
    line = Timeline(balance=False, physics="nearest").foot("FL", z=0.04, over=0.2)
    failure = checker.check(line.hold(0.4)).failures[0]
    assert failure.check == "nearest motion"
    assert "must start and end on four feet" in failure.note


def test_physics_and_tolerance_are_checked_where_they_are_given() -> None:
    with pytest.raises(TimelineError, match=r"unknown physics 'nearly'.*as_written, nearest"):
        Timeline(physics="nearly")
    with pytest.raises(TimelineError, match=r"tolerance position must be a number above 0"):
        Timeline(tolerance=Tolerance(position=0.0, angle=deg(5)))
