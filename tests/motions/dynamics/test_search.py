"""A search leaves nothing behind, and goes on until a plan turns as it was asked to."""

import gc
import logging
import math
import time
import weakref
from collections.abc import Iterator
from dataclasses import replace

import numpy as np
import pytest

from go2_wbc.errors import PlanNotFound
from go2_wbc.robot.model import RobotModel
from motions.dynamics import DynamicTrajectory, PhaseProblem, Tolerance, solve
from motions.dynamics import phases as phase_builders
from motions.dynamics.knots import Knots, Solution, knots_of, pose_of
from motions.dynamics.phases import Phase
from motions.dynamics.plan_audit import PlanLimits, Weights
from motions.dynamics.solver import _misses
from tests.motions.dynamics.conftest import PROBLEMS
from tests.solver import needs_solver

pytestmark = needs_solver
ROUND = 2.0 * math.pi
LIFT = PROBLEMS["lift"]


def with_yaw(problem: PhaseProblem, yaw: float) -> PhaseProblem:
    """``problem`` with another heading [rad] at its end: the feet land as before."""
    *phases, last = problem.phases
    assert last.body is not None
    return PhaseProblem((*phases, replace(last, body=(*last.body[:5], yaw))))


def hops_round(times: int) -> PhaseProblem:
    """Once round to the left in so many hops."""
    phases: list[Phase] = []
    for hop in range(times):
        before, after = (ROUND * (hop + step) / times for step in (0, 1))
        up, down = (
            phase_builders._moved(share, (0.0, 0.0, yaw), z)
            for share, yaw, z in ((1.0, 0.5 * (before + after), 0.12), (1.0, after, 0.0))
        )
        phases += [
            Phase(0.3, body=(0.0, 0.0, -0.06, 0.0, 0.0, before), label=f"crouch {hop}"),
            Phase(0.2, label=f"push {hop}"),
            Phase(0.16, frozenset(), feet=up, label=f"rise {hop}"),
            Phase(0.16, frozenset(), feet=down, label=f"fall {hop}"),
        ]
    home = Phase(0.3, body=(0.0, 0.0, 0.0, 0.0, 0.0, ROUND), label="stand")
    return PhaseProblem((*phases, Phase(0.2, label="land"), home))


def headings(knots: Knots) -> np.ndarray:
    return np.unwrap([pose_of(q)[5] for q in knots.q])


@pytest.fixture
def without_collector() -> Iterator[None]:
    """The garbage collector sleeps: what goes, goes because nothing holds it."""
    gc.collect()
    gc.disable()
    yield
    gc.enable()


@pytest.mark.parametrize("tolerance", [Tolerance(), Tolerance(position=1e-6)])
def test_solving_leaves_nothing_behind_whether_or_not_there_is_a_plan(
    monkeypatch: pytest.MonkeyPatch,
    without_collector: None,
    model: RobotModel,
    tolerance: Tolerance,
) -> None:
    """The solver held its callback, and that the search with its solvers: 114 MB a question."""
    from motions.dynamics import shooting_problem

    made: list[weakref.ref[object]] = []
    for name in ("ShootingProblem", "Search"):

        class Noted(getattr(shooting_problem, name)):
            def __init__(self, *args: object, **kwargs: object) -> None:
                super().__init__(*args, **kwargs)
                made.append(weakref.ref(self))

        monkeypatch.setattr(shooting_problem, name, Noted)
    try:
        solve(replace(LIFT, tolerance=tolerance), model)
    except PlanNotFound:
        assert tolerance != Tolerance()
    assert len(made) == 3
    assert not any(ref() for ref in made)


def test_a_solution_that_does_not_turn_is_left_for_the_next_start(model: RobotModel) -> None:
    from motions.dynamics.shooting_problem import Search, ShootingProblem

    knots = knots_of(LIFT, model, PlanLimits())
    soft, full = (
        ShootingProblem(knots, model, PlanLimits(), weights)
        for weights in (Weights().softened(), Weights())
    )

    def iterations(answers: list[bool]) -> int:
        def turns(found: Solution) -> bool:
            return answers.pop(0)

        search = Search(
            soft, full, knots, objections=lambda _: ["no"], turns=turns, budget=20.0, progress=None
        )
        return search.run().iterations

    assert iterations([False, True]) > iterations([True])
    with pytest.raises(PlanNotFound, match="converges to a motion that turns as asked"):
        iterations([False] * 6)


def test_a_turn_that_is_lost_is_missed_as_a_whole(
    plans: dict[str, DynamicTrajectory], model: RobotModel
) -> None:
    plan, jump = plans["jump"], PROBLEMS["jump"]
    for yaw, left in ((0.5, 0.0), (0.5 + ROUND, ROUND), (0.5 - 2.0 * ROUND, 2.0 * ROUND)):
        misses = _misses(knots_of(with_yaw(jump, yaw), model, PlanLimits()), plan)
        trunk = [miss.angle for miss in misses if miss.phase == "stand" and miss.subject == "trunk"]
        assert trunk == pytest.approx([left], abs=math.radians(3.0))


@pytest.mark.parametrize("yaw", [ROUND, -ROUND, 1.5 * math.pi])
def test_the_first_guess_turns_in_the_air_as_far_as_was_asked(
    model: RobotModel, yaw: float
) -> None:
    """Headings were taken for the shorter way round: a turn by 360 deg for none."""
    jump = PhaseProblem(phase_builders.jump(yaw=math.remainder(yaw, ROUND), height=0.3))
    knots = knots_of(with_yaw(jump, yaw), model, PlanLimits())
    turned, flight = headings(knots), ~knots.stance.any(axis=1)
    assert turned[-1] - turned[0] == pytest.approx(yaw)
    in_flight = turned[1:][flight][-1] - turned[:-1][flight][0]
    assert abs(in_flight) > 0.5 * abs(yaw)


def test_what_binds_is_said_within_a_second_and_what_is_tried(
    model: RobotModel, caplog: pytest.LogCaptureFixture
) -> None:
    from motions.dynamics.shooting_problem import FIRST_ANSWER

    impossible = PhaseProblem(phase_builders.jump(height=0.4))
    began = time.thread_time()
    with caplog.at_level(logging.INFO), pytest.raises(PlanNotFound):
        solve(impossible, model, budget=FIRST_ANSWER + 0.2)
    assert time.thread_time() - began < 2.0  # with all that is made before and after
    told = [record.message for record in caplog.records]
    assert any("trying to begin from a guess" in line for line in told)
    assert any("no plan yet; what binds: " in line and "torque share" in line for line in told)


def test_once_round_in_four_hops_is_found(model: RobotModel) -> None:
    """With a first guess that lost the turn there was no plan."""
    plan = solve(hops_round(4), model)
    turned = np.sum(plan.v[1:, 5] * np.diff(plan.times))
    assert turned == pytest.approx(ROUND, abs=math.radians(3.0))
