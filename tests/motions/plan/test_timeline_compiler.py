"""Plans of what is written and what is solved: continuous, in place, and told what cannot be."""

import sys
from itertools import pairwise

import numpy as np
import pytest

from benchmarks.solved_plans import shipped_problems
from go2_wbc.errors import MissingDependency, MotionInfeasible, PlanNotFound, TimelineError
from go2_wbc.robot.model import RobotModel
from motions import CompiledPlan, FeasibilityChecker, Timeline, compile_timeline, deg
from motions.dynamics import plan_cache
from motions.language.keys import BalanceShift, PhaseKey
from motions.plan.compiled_plan import FORCE_WEIGHT
from motions.plan.timeline_compiler import LEAD, pieces_to_repair, without_vain_shifts
from motions.plan.trajectory import Trajectory, trajectory_of

_SAME = 1e-9  #: Rounding of sums, m, rad, m/s and rad/s
_LANDED = 0.01  #: [m] What a plan may land beside the place that is asked, here; it reports how far


@pytest.fixture(scope="module")
def jumps(model: RobotModel) -> CompiledPlan:
    """A bow, two jumps of the library's with a walk between them, and a raised paw."""
    line = Timeline().body(pitch=0.1, over=0.5).home(over=0.5).spin_jump(deg(90)).hold(0.2)
    line = line.jump(x=0.5, height=0.1).foot("FR", z=0.06, over=0.6).home(over=0.8)
    return compile_timeline(line, model)


def test_parts_meet_in_places_and_speeds_and_a_plan_lasts_as_long_as_its_timeline(
    jumps: CompiledPlan,
) -> None:
    knots, c = jumps.curves.x, jumps.curves.c
    dt = np.diff(knots)[:-1, None]
    place = ((c[0, :-1] * dt + c[1, :-1]) * dt + c[2, :-1]) * dt + c[3, :-1]
    speed = (3.0 * c[0, :-1] * dt + 2.0 * c[1, :-1]) * dt + c[2, :-1]
    np.testing.assert_allclose(place, c[3, 1:], atol=_SAME)
    np.testing.assert_allclose(speed, c[2, 1:], atol=_SAME)
    assert all(b > a for a, b in pairwise(jumps.contacts.times))
    first, second = jumps.dynamic
    assert first.start == pytest.approx(1.0)
    assert second.start == pytest.approx(first.end + 0.2)
    assert jumps.is_dynamic
    assert not jumps.at(first.start + 0.6).stance.any()


def test_after_a_jump_all_counts_from_where_it_lands_and_in_flight_feet_bear_all_along(
    jumps: CompiledPlan,
) -> None:
    x, y, yaw = jumps.end_pose
    assert (x, y) == pytest.approx((0.0, 0.5), abs=_LANDED)  # ahead, after a turn to the left
    assert yaw == pytest.approx(deg(90), abs=0.01)
    paw = jumps.at(jumps.duration - 1.7)
    assert paw.stance.tolist() == [True, False, True, True]
    assert paw.body.p_world[1] == pytest.approx(0.5, abs=0.1)
    span = jumps.dynamic[0]
    stance = span.trajectory.stance
    take_off = span.start + span.trajectory.times[int(np.argmin(stance.all(axis=1)))]
    loads = jumps.samples(np.array([take_off - 1e-4, take_off + 1e-4])).normal_force_max
    assert loads[0].min() == pytest.approx(400.0)
    assert loads[1].max() == 0.0


def test_a_solved_part_is_played_with_the_forces_that_it_was_solved_with(
    jumps: CompiledPlan,
) -> None:
    span = jumps.dynamic[0]
    plan = span.trajectory
    for step in (0, 7, len(plan.forces) - 1):
        asked = jumps.at(span.start + float(plan.times[step : step + 2].mean()))
        np.testing.assert_array_equal(asked.f_world_feet, plan.forces[step])
        assert asked.force_weight == FORCE_WEIGHT
    assert jumps.at(span.start - 1e-3).force_weight == 0.0
    assert jumps.at(span.end + 1e-3).force_weight == 0.0


def test_the_library_s_plans_are_shipped_and_none_is_left_over(model: RobotModel) -> None:
    kept = {file.stem for file in plan_cache.SHIPPED.glob("*.npz")}
    assert set(shipped_problems(model)) == kept, "run: python -m benchmarks solve"


def test_without_the_solver_a_new_motion_is_refused_with_the_line_that_installs_it(
    model: RobotModel, monkeypatch: pytest.MonkeyPatch, tmp_path: object
) -> None:
    monkeypatch.setattr(plan_cache, "plan_folder", lambda: tmp_path)
    monkeypatch.setitem(sys.modules, "crocoddyl", None)
    with pytest.raises(MissingDependency, match=r"pip install .go2-wbc\[dynamics\]"):
        compile_timeline(Timeline().jump(height=0.0314), model)


def test_what_no_plan_is_found_for_is_rest_and_a_failure_that_says_what_binds(
    model: RobotModel, monkeypatch: pytest.MonkeyPatch
) -> None:
    def refuse(*args: object, **others: object) -> None:
        raise PlanNotFound("no dynamic plan", ["torque of FL_calf at 0.48 s: 1.3"])

    monkeypatch.setattr("motions.plan.timeline_compiler.solve_cached", refuse)
    line = Timeline().hold(0.5).jump(height=0.3).body(z=-0.02, over=0.5).home(over=0.5)
    checker = FeasibilityChecker(model)
    report = checker.check(line)
    assert [one.check for one in report.failures] == ["dynamic plan"]
    assert report.failures[0].time == pytest.approx(0.5)
    assert "torque of FL_calf at 0.48 s" in str(report.failures[0])
    assert report.duration == pytest.approx(line.end)
    with pytest.raises(MotionInfeasible, match="FL_calf"):
        checker.plan(line)


@pytest.mark.parametrize(
    ("line", "message"),
    [
        (
            Timeline().jump().at(0.2).body(z=-0.02, over=0.3),
            "body z moves from 0.20 to 0.50 s, within a dynamic block from 0.00 to",
        ),
        (
            Timeline().phase(0.3).phase(0.3, stance=("FL", "FR")),
            "is the last one: it must stand on four feet",
        ),
    ],
)
def test_what_does_not_go_together_is_refused(
    model: RobotModel, line: Timeline, message: str
) -> None:
    with pytest.raises(TimelineError, match=message):
        compile_timeline(line, model)


def test_keys_of_blocks_are_moved_in_time_with_their_phases() -> None:
    (key,) = Timeline().jump().in_order(PhaseKey)
    later = key.later(1.0)
    assert later.phases == key.phases
    assert later.start == pytest.approx(1.0)


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
        ((0.5,), [(0.5 - LEAD, 1.7 + LEAD)]),  # as the rest ends
        ((2.2,), [(0.2, 3.95)]),  # a rest that breaks a limit itself is no end
    ],
)
def test_every_part_that_is_broken_is_mended(
    path: Trajectory, broken: tuple[float, ...], mended: list[tuple[float, float]]
) -> None:
    assert spans(path, *broken) == mended


def test_a_rest_ends_a_part_at_home_and_none_that_was_checked_elsewhere(path: Trajectory) -> None:
    model = RobotModel()
    aside = LINE.at(1.2).body(x=0.01, over=0.1).at(LINE.end)
    other = trajectory_of(compile_timeline(aside, model), model)
    (piece,) = pieces_to_repair(path, other, np.array([1.0]))
    assert piece.end == pytest.approx(path.times[-1])
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
