"""What is mended of a motion: the parts that break a limit, from rest to rest, and nothing else."""

import numpy as np
import pytest

from go2_wbc.errors import PlanNotFound
from go2_wbc.robot.model import RobotModel
from motions import Timeline, compile_timeline
from motions.language.keys import BalanceShift
from motions.plan.timeline_compiler import LEAD, pieces_to_repair, without_vain_shifts
from motions.plan.trajectory import Trajectory, trajectory_of

LINE = (
    Timeline()
    .hold(0.5)
    .body(y=0.03, over=0.4)
    .body(y=-0.03, over=0.4)
    .home(over=0.4)
    .hold(1.0)
    .body(z=-0.05, over=0.6)
    .home(over=0.6)
    .hold(0.05)
)
"""A sway from 0.5 to 1.7 s and a crouch from 2.7 to 3.9 s."""


@pytest.fixture(scope="module")
def path() -> Trajectory:
    model = RobotModel()
    return trajectory_of(compile_timeline(LINE, model), model)


def spans(path: Trajectory, *broken: float) -> list[tuple[float, float]]:
    pieces = pieces_to_repair(path, path, np.array(broken))
    return [(round(piece.start, 2), round(piece.end, 2)) for piece in pieces]


@pytest.mark.parametrize(
    ("broken", "mended"),
    [
        ((1.0,), [(0.5 - LEAD, 1.7 + LEAD)]),  # from rest to rest, with a lead
        ((0.6, 1.6), [(0.5 - LEAD, 1.7 + LEAD)]),  # poses without a hold between them
        ((1.0, 3.0), [(0.2, 2.0), (2.4, 3.95)]),  # the ends bound the last
        ((), []),
        ((2.2,), [(0.2, 3.95)]),  # a rest that breaks a limit itself is no end
    ],
)
def test_every_part_that_is_broken_is_mended(
    path: Trajectory, broken: tuple[float, ...], mended: list[tuple[float, float]]
) -> None:
    assert spans(path, *broken) == mended


def test_at_a_rest_that_was_checked_elsewhere_nothing_ends(path: Trajectory) -> None:
    model = RobotModel()
    aside = LINE.at(1.2).body(x=0.01, over=0.1).at(LINE.end)
    other = trajectory_of(compile_timeline(aside, model), model)
    (piece,) = pieces_to_repair(path, other, np.array([1.0]))
    assert piece.end == pytest.approx(path.times[-1])


def test_at_home_an_instant_of_rest_is_enough_unless_the_trunk_only_passes_it() -> None:
    model = RobotModel()
    line = Timeline().body(y=0.03, over=0.5).home(over=0.5).body(y=0.03, over=0.4)
    line = line.body(y=-0.03, over=0.4).home(over=0.4)
    path = trajectory_of(compile_timeline(line, model), model)
    assert spans(path, 0.3) == [(0.0, 1.0)]
    assert spans(path, 1.3) == [(1.0, 2.2)]


def test_what_is_written_in_a_part_starts_at_zero(path: Trajectory) -> None:
    (piece,) = pieces_to_repair(path, path, np.array([3.0]))
    written = piece.written(path)
    assert written.times[0] == 0.0
    assert written.times[-1] == pytest.approx(piece.end - piece.start)
    np.testing.assert_array_equal(written.q[0], path.q[piece.first])


def test_a_shift_over_three_feet_stays_and_one_for_two_at_once_does_not() -> None:
    one = Timeline().foot("FL", z=0.05, over=0.5).home(over=0.5)
    two = Timeline().foot("FL", z=0.05, over=0.5).foot("RR", z=0.05, over=0.5).home(over=0.5)
    raised = Timeline().foot("FL", z=0.05, over=0.5)
    assert without_vain_shifts(one) == one
    assert without_vain_shifts(raised) == raised
    assert two.in_order(BalanceShift)
    assert not without_vain_shifts(two).in_order(BalanceShift)
    kept = without_vain_shifts(two.then(one)).in_order(BalanceShift)
    assert kept == [shift.later(two.end) for shift in one.in_order(BalanceShift)]


def test_what_is_repaired_in_vain_stays_as_it_is_written_with_the_reason(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    def refuse(*args: object, **others: object) -> None:
        raise PlanNotFound("no dynamic plan: nothing is near")

    model = RobotModel()
    monkeypatch.setattr("motions.plan.timeline_compiler.nearest_cached", refuse)
    written = compile_timeline(LINE, model)
    plan = compile_timeline(LINE, model, mend=lambda plan: np.array([1.0]))
    (problem,) = plan.problems
    assert (problem.check, problem.time) == ("nearest motion", pytest.approx(0.5 - LEAD))
    assert "nothing is near" in problem.reason
    for t in np.linspace(0.0, LINE.end, 25).tolist():
        np.testing.assert_array_equal(plan.at(t).row, written.at(t).row)
