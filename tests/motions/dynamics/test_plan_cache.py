"""A plan is solved once, whatever happens to the folder that keeps it."""

import time
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from go2_wbc.errors import PlanNotFound
from go2_wbc.robot.model import RobotModel
from motions.dynamics import DynamicTrajectory, PhaseProblem, PlanLimits, Tolerance, plan_cache
from tests.motions.dynamics.conftest import PROBLEMS

PROBLEM = PROBLEMS["lift"]


class Solver:
    """Answers every question with one plan, and counts."""

    def __init__(self, plan: DynamicTrajectory) -> None:
        self.plan, self.calls = plan, 0

    def __call__(self, *_: object, **__: object) -> DynamicTrajectory:
        self.calls += 1
        return self.plan


@pytest.fixture
def solver(plans: dict[str, DynamicTrajectory], monkeypatch: pytest.MonkeyPatch) -> Solver:
    solver = Solver(plans["lift"])
    monkeypatch.setattr(plan_cache, "solve", solver)
    return solver


def test_a_kept_plan_is_not_solved_again(solver: Solver, model: RobotModel, tmp_path: Path) -> None:
    new = tmp_path / "new" / "below"
    first = plan_cache.solve_cached(PROBLEM, model, folder=new)
    second = plan_cache.solve_cached(PROBLEM, model, folder=new)
    assert solver.calls == 1
    assert first.to_bytes() == second.to_bytes()


def test_another_question_robot_or_limit_is_another_plan(
    solver: Solver, model: RobotModel, tmp_path: Path
) -> None:
    heavier = RobotModel(armature=1.1 * model.pin_model.armature[6:])
    ideal = RobotModel(motor="ideal")
    longer = replace(PROBLEM.phases[0], duration=0.42)
    others = [
        (PROBLEM, heavier, None),
        (PROBLEM, ideal, None),
        (PROBLEM, model, PlanLimits(friction=0.4)),
        (PhaseProblem((longer, *PROBLEM.phases[1:])), model, None),
    ]
    plan_cache.solve_cached(PROBLEM, model, folder=tmp_path)
    for problem, robot, limits in others:
        plan_cache.solve_cached(problem, robot, limits=limits, folder=tmp_path)
    assert solver.calls == 5
    assert len(list(tmp_path.iterdir())) == 5


def test_a_damaged_plan_is_solved_and_kept_anew(
    solver: Solver, model: RobotModel, tmp_path: Path, caplog: pytest.LogCaptureFixture
) -> None:
    plan_cache.solve_cached(PROBLEM, model, folder=tmp_path)
    (kept,) = tmp_path.iterdir()
    content = kept.read_bytes()
    kept.write_bytes(content[: len(content) // 2])
    plan_cache.solve_cached(PROBLEM, model, folder=tmp_path)
    assert solver.calls == 2
    assert "is of no use and will be solved anew" in caplog.text
    assert kept.read_bytes() == content


def test_a_folder_that_cannot_be_written_only_costs_time(
    solver: Solver, model: RobotModel, tmp_path: Path, caplog: pytest.LogCaptureFixture
) -> None:
    blocked = tmp_path / "file"
    blocked.write_text("in the way")
    for _ in range(2):
        plan_cache.solve_cached(PROBLEM, model, folder=blocked / "below")
    assert solver.calls == 2
    assert "cannot be kept in" in caplog.text


def test_a_kept_plan_is_judged_by_the_tolerance_of_today(
    solver: Solver, model: RobotModel, tmp_path: Path
) -> None:
    plan_cache.solve_cached(PROBLEM, model, folder=tmp_path)
    strict = replace(PROBLEM, tolerance=Tolerance(position=1e-6))
    with pytest.raises(PlanNotFound, match="nearest one is off"):
        plan_cache.solve_cached(strict, model, folder=tmp_path)
    assert solver.calls == 1


def test_that_there_is_no_plan_is_kept_for_the_tolerance_that_was_asked(
    model: RobotModel, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    asked: list[PhaseProblem] = []

    def fail(problem: PhaseProblem, *_: object, **__: object) -> DynamicTrajectory:
        asked.append(problem)
        raise PlanNotFound("no dynamic plan", ["torque of FL_calf", "friction"])

    def refusal(problem: PhaseProblem) -> PlanNotFound:
        with pytest.raises(PlanNotFound) as told:
            plan_cache.solve_cached(problem, model, folder=tmp_path)
        return told.value

    monkeypatch.setattr(plan_cache, "solve", fail)
    first, began = refusal(PROBLEM), time.thread_time()
    again = refusal(PROBLEM)
    assert time.thread_time() - began < 0.05
    assert (str(again), again.reasons) == (str(first), first.reasons)
    assert len(asked) == 1
    refusal(replace(PROBLEM, tolerance=Tolerance(position=0.2)))
    assert len(asked) == 2
    for kept in tmp_path.iterdir():
        kept.write_text("[")
    refusal(PROBLEM)
    assert len(asked) == 3


def test_a_doctored_plan_is_found_out(solver: Solver, model: RobotModel, tmp_path: Path) -> None:
    plan_cache.solve_cached(PROBLEM, model, folder=tmp_path)
    (kept,) = tmp_path.iterdir()
    plan = solver.plan
    kept.write_bytes(replace(plan, tau=np.zeros_like(plan.tau)).to_bytes())
    with pytest.raises(PlanNotFound, match="defect"):
        plan_cache.solve_cached(PROBLEM, model, folder=tmp_path)
