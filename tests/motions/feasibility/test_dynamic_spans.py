"""Dynamic spans are judged by their own dynamics: what is broken in a good plan is found."""

from collections.abc import Callable, Mapping
from dataclasses import replace

import numpy as np
import pinocchio as pin
import pytest

from go2_wbc.robot.model import RobotModel
from go2_wbc.world import World
from motions import (
    CheckedMotion,
    CompiledPlan,
    FeasibilityChecker,
    Timeline,
    compile_timeline,
    load_motion,
)
from motions.dynamics.dynamic_trajectory import DynamicTrajectory
from motions.dynamics.phases import Tolerance
from motions.feasibility.forces import torque
from tests.motions.feasibility.cases import case_of
from tests.solver import needs_solver

Mutation = Callable[[DynamicTrajectory, np.random.Generator], DynamicTrajectory]
_OWN_ROWS = {"steps", "equations", "curves", "ground pulls", "friction cone", "standing feet"}
_OWN_ROWS |= {"touchdown", "off by", "turned off by", "few feet", "mass solved for"}


def plan_of(name: str, checker: FeasibilityChecker) -> CompiledPlan:
    return compile_timeline(load_motion(name), checker.model)


@pytest.fixture(scope="module")
def jump(checker: FeasibilityChecker) -> CheckedMotion:
    return checker.evaluate(plan_of("jump_up", checker))


def mutated(plan: CompiledPlan, mutate: Mutation, seed: int = 0) -> CompiledPlan:
    """``plan`` with its first span broken; the curves stay."""
    first, *others = plan.dynamic
    broken = replace(first, trajectory=mutate(first.trajectory, np.random.default_rng(seed)))
    return replace(plan, dynamic=(broken, *others))


def with_more(name: str, *more: tuple[object, object]) -> Mutation:
    """A mutation that adds to an array of the plan in these places."""

    def mutate(good: DynamicTrajectory, rng: np.random.Generator) -> DynamicTrajectory:
        array = getattr(good, name).copy()
        for where, what in more:
            array[where] += what
        return replace(good, **{name: array})

    return mutate


def force_in_the_air(good: DynamicTrajectory, rng: np.random.Generator) -> DynamicTrajectory:
    flying = np.flatnonzero(~good.stance.any(axis=1))
    return with_more("forces", ((rng.choice(flying), rng.integers(4), 2), 40.0))(good, rng)


def missing_rotation(good: DynamicTrajectory, rng: np.random.Generator) -> DynamicTrajectory:
    """The trunk keeps its heading, as a solver may find that loses a whole turn."""
    return replace(good, v=good.v * np.repeat([1.0, 0.0, 1.0], [3, 3, 12]))


def slides(good: DynamicTrajectory, rng: np.random.Generator) -> DynamicTrajectory:
    """It glides ahead at 0.2 m/s from its first instant on, feet and all."""
    q, v = good.q.copy(), good.v.copy()
    q[:, 0] += 0.2 * good.times
    for row in range(len(q)):
        R = pin.Quaternion(q[row, 3:7]).toRotationMatrix()
        v[row, :3] += R.T @ [0.2, 0.0, 0.0]
    return replace(good, q=q, v=v)


BROKEN: Mapping[str, tuple[Mutation, set[str]]] = {
    "more torque": (with_more("tau", ((9, 5), 3.0)), {"equations"}),
    "more force": (with_more("forces", ((2, 1, 2), 5.0)), {"equations"}),
    "force in the air": (force_in_the_air, {"equations", "ground pulls"}),
    "slippery": (with_more("forces", ((3, 2, 0), 40.0)), {"equations", "friction cone"}),
    "foot under ground": (with_more("q", ((slice(None), 2), -0.06)), {"standing feet"}),
    "missing rotation": (missing_rotation, {"steps", "equations"}),
    "gap": (with_more("q", ((slice(40, None), 0), 0.03)), {"steps"}),
    "faster": (lambda good, _: replace(good, times=0.8 * good.times), {"steps", "equations"}),
    "other curves": (with_more("q", ((slice(None), 2), 0.05)), {"curves", "standing feet"}),
    "slides": (slides, {"standing feet", "off by", "curves"}),
}


def test_good_plans_pass_with_rows_of_their_own_and_none_of_support_in_flight(
    checker: FeasibilityChecker, jump: CheckedMotion
) -> None:
    assert jump.report.ok, jump.report.table()
    assert set(jump.report.margins) >= _OWN_ROWS
    for row in ("off by", "turned off by", "equations"):
        assert row in jump.report.table()
    assert not _OWN_ROWS & set(checker.check("bow").margins)
    by_name = {series.check: series for series in jump.report.series}
    within = jump.path.is_dynamic
    assert within.any()
    for name in ("support", "support of ZMP", "foot load", "continuity", "friction"):
        assert np.isnan(by_name[name].margins[within]).all()
    assert not np.isnan(by_name["joint speed"].margins[within]).any()


@pytest.mark.parametrize("how", BROKEN)
def test_what_is_broken_in_a_good_plan_is_found(checker: FeasibilityChecker, how: str) -> None:
    mutate, found = BROKEN[how]
    plan = plan_of("spin_jump", checker)
    report = checker.check(mutated(plan, mutate))
    assert found <= {one.check for one in report.failures}, report.table()


@pytest.mark.parametrize(
    ("name", "where", "what", "check", "subject"),
    [
        ("v", (20, 1), 3.0, "steps", "trunk"),
        ("v", (20, 4), 30.0, "steps", "trunk turning"),
        ("v", (20, 9), 30.0, "steps", "joints"),
        ("tau", (9, 5), 30.0, "equations", "FR_calf"),
        ("forces", (5, 1, 2), -900.0, "ground pulls", "FR"),
    ],
)
def test_what_is_broken_is_found_in_its_row(
    checker: FeasibilityChecker, name: str, where: tuple[int, ...], what: float, check: str,
    subject: str,
) -> None:  # fmt: skip
    plan = mutated(plan_of("spin_jump", checker), with_more(name, (where, what)))
    found = next(one for one in checker.check(plan).failures if one.check == check)
    span = plan.dynamic[0]
    assert found.time == pytest.approx(span.start + span.trajectory.times[where[0]])
    assert found.subject == subject


@pytest.mark.parametrize(("payload", "is_refused"), [(2.0, False), (4.0, True)])
def test_what_was_solved_for_another_mass_is_refused(payload: float, is_refused: bool) -> None:
    """With 4 kg on its trunk the robot fell out of this motion, which passed all else."""
    report = FeasibilityChecker(RobotModel(), world=World(payload=payload)).check("rear_up")
    assert ("mass solved for" in {one.check for one in report.failures}) is is_refused


@needs_solver
@pytest.mark.parametrize(("rest", "is_refused"), [(0.0, True), (0.4, False)])
def test_two_feet_are_stood_on_for_long_only_after_a_while_on_four(
    checker: FeasibilityChecker, rest: float, is_refused: bool
) -> None:
    """Without it the robot, 2 mm off its plan when it lifts them, slid 200 mm and tilted 36 deg."""
    line = Timeline(physics="nearest", balance=False)
    line = line if rest == 0.0 else line.hold(rest)
    for z in (0.04, 0.0):
        line = line.foot("FL", z=z, over=0.38).also().foot("RR", z=z, over=0.38)
    report = checker.check(line.home(over=0.5))
    found = [one for one in report.failures if one.check == "few feet"]
    assert bool(found) is is_refused
    if is_refused:
        assert found[0].value == pytest.approx(0.74, abs=0.03)
    else:
        assert report.ok, report.table()


def test_a_plan_beyond_its_tolerance_is_refused_with_how_far_and_when(
    checker: FeasibilityChecker,
) -> None:
    plan = plan_of("jump_forward", checker)
    (span,) = plan.dynamic
    narrow = replace(span, tolerance=Tolerance(position=0.0005))
    report = checker.check(replace(plan, dynamic=(narrow,)))
    (check,) = {one.check for one in report.failures}
    assert check == "off by"
    worst = report.margins["off by"]
    assert worst.unit == "mm"
    assert worst.value == pytest.approx(1e3 * span.trajectory.position_deviation, rel=1e-3)


def test_a_solved_part_at_the_torque_that_it_may_use_would_need_more(
    checker: FeasibilityChecker, jump: CheckedMotion
) -> None:
    """A solver never exceeds its bound: a plan that was cut by it is told by reaching it."""
    tau = np.zeros(jump.forces.tau.shape)
    row = int(np.flatnonzero(jump.path.is_dynamic)[5])
    written = int(np.flatnonzero(~jump.path.is_dynamic)[0])
    tau[[row, written], 1] = 0.85 * checker.model.torque_limits[1] - 1e-6
    forces = replace(jump.forces, tau=tau)
    peak, _ = torque(case_of(jump.path, checker.model, forces))
    assert np.argwhere(peak.margins < 0.0).tolist() == [[row, 1]]


def test_the_path_and_its_forces_are_the_plan_s_own(jump: CheckedMotion) -> None:
    assert isinstance(jump.plan, CompiledPlan)
    (span,) = jump.plan.dynamic
    solved = span.trajectory
    for row in range(0, len(solved.tau), 7):
        middle = span.start + 0.5 * (solved.times[row] + solved.times[row + 1])
        sample = int(np.argmin(np.abs(jump.path.times - middle)))
        np.testing.assert_array_equal(jump.forces.tau[sample], solved.tau[row])
        np.testing.assert_allclose(
            jump.path.v[sample], 0.5 * (solved.v[row] + solved.v[row + 1]), atol=0.6
        )
    run = jump.recording()
    assert "flight" in run.labels
    flying = ~run.stance.any(axis=1)
    assert run.foot_forces[flying].max() == 0.0
    assert run.q[flying, 2].max() > 0.4
