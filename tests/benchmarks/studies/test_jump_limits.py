"""The climb finds the greatest size that is planned, and its jump is what is played."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from benchmarks.dynamic_motions import Played
from benchmarks.studies import jump_limits
from benchmarks.studies.jump_bounds import best_take_off
from benchmarks.studies.jump_limits import BISECTIONS, KINDS, Climber, Jump, Kind
from controller.sweeps.trials import Trial, TrialFailed
from go2_wbc.errors import PlanNotFound
from go2_wbc.kept_code import CACHE_VARIABLE
from go2_wbc.robot.model import RobotModel
from motions import CompiledPlan, Timeline, compile_timeline
from motions.dynamics import PhaseProblem, Solved
from motions.dynamics.plan_limits import PlanLimits
from tests.go2_wbc.plant.helpers import empty_recording
from tests.solver import needs_solver

MODEL = RobotModel()
ASKED = 0.32  # m; the planner of the tests finds what is lower


class Planner:
    """Finds jumps up to a height, and only with one time in the air."""

    def __init__(self, longest: float = 9.0) -> None:
        self.longest, self.highest = longest, ASKED
        self.starts: list[Solved | None] = []
        self.kept: list[object] = []

    def solve(
        self,
        problem: PhaseProblem,
        model: RobotModel,
        *,
        budget: float,
        limits: PlanLimits,
        start: Solved | None,
    ) -> str:
        assert limits.knee_height > PlanLimits().knee_height
        self.starts.append(start)
        rise = problem.phases[2]
        height = max(place[2] for place in rise.feet.values())
        if height > ASKED or 2.0 * rise.duration > self.longest:
            raise PlanNotFound("no dynamic plan", [f"asked for {height:g} m"])
        return f"plan of {height:g} m"

    def objection(self, plan: Jump, model: RobotModel) -> str:
        return "the check: torque at speed" if plan.height > self.highest else ""

    def keep(self, problem: PhaseProblem, model: RobotModel, plan: object) -> None:
        self.kept.append(plan)


@pytest.fixture
def planner(monkeypatch: pytest.MonkeyPatch) -> Planner:
    planner = Planner()
    monkeypatch.setattr(jump_limits, "solve", planner.solve)
    monkeypatch.setattr(jump_limits, "keep", planner.keep)
    monkeypatch.setattr(jump_limits, "Solved", lambda problem, plan: plan)
    monkeypatch.setattr(jump_limits, "compiled", lambda jump, model: jump)
    monkeypatch.setattr(jump_limits, "objection", planner.objection)
    return planner


def done(plan: object) -> str:
    return ""


def climb(
    kind: Kind, told: list[str], play: Callable[[CompiledPlan], str] = done
) -> jump_limits.Climb:
    return Climber(kind, MODEL, 1.0, play=play, tell=told.append).climb()


def test_a_climb_ends_within_a_bisected_step_of_what_is_planned(planner: Planner) -> None:
    told: list[str] = []
    found = climb(KINDS["high"], told)
    step = KINDS["high"].sizes[1] - KINDS["high"].sizes[0]
    assert ASKED - step / 2**BISECTIONS <= found.size <= ASKED
    assert found.jump.height == found.size
    assert len(told) == len(found.attempts)
    assert "asked for 0.35 m" in " ".join(told)


def test_every_plan_is_the_start_for_the_next_one(planner: Planner) -> None:
    climb(KINDS["high"], [])
    assert planner.starts[:4] == [None, "plan of 0.15 m", "plan of 0.2 m", "plan of 0.25 m"]
    assert planner.kept == [*planner.starts[1:5], "plan of 0.3125 m"]


def test_a_plan_that_the_check_refuses_does_not_count(planner: Planner) -> None:
    planner.highest = 0.22
    found = climb(KINDS["high"], [])
    assert 0.2 <= found.size <= planner.highest
    assert "the check: torque at speed" in [attempt.reason for attempt in found.attempts]
    assert "plan of 0.25 m" in planner.starts, "it is a start all the same"


def test_a_plan_that_is_not_done_does_not_count(planner: Planner) -> None:
    def play(plan: CompiledPlan) -> str:
        assert isinstance(plan, Jump)  # as the planner of these tests compiles it
        return "played: fell" if plan.height > 0.22 else ""

    found = climb(KINDS["high"], [], play)
    assert 0.2 <= found.size <= 0.22
    assert "played: fell" in [attempt.reason for attempt in found.attempts]
    assert "plan of 0.25 m" in planner.starts, "it is a start all the same"


def test_a_robot_that_does_not_do_it_says_why(monkeypatch: pytest.MonkeyPatch) -> None:
    seeds: list[int] = []

    def play(plant: int, plan: object, model: RobotModel) -> Played:
        seeds.append(plant)
        if len(seeds) == 5:
            raise TrialFailed("fell at t=1.00 s")
        return Played(empty_recording(2, np.zeros((2, 4, 3))), np.zeros(3), 0.0, "")

    monkeypatch.setattr(jump_limits, "plant_of", lambda trial, _first: trial.seed)
    monkeypatch.setattr(jump_limits, "play", play)
    plan = compile_timeline(Timeline().body(z=-0.01, over=0.3), MODEL)
    assert jump_limits.not_done(plan) == ""
    assert seeds == list(jump_limits.TRIED)
    assert jump_limits.not_done(plan) == "played: fell at t=1.00 s"
    judged = range(jump_limits.OFFSET, jump_limits.OFFSET + 20)
    assert not set(judged) & set(seeds)


def test_the_time_in_the_air_is_searched(planner: Planner) -> None:
    planner.longest = 0.37
    found = climb(KINDS["high"], [])
    assert found.size > 0.3
    assert found.jump.flight < planner.longest < KINDS["high"].ask(found.size).flight


def test_a_kind_of_which_nothing_is_found_says_so(planner: Planner) -> None:
    planner.longest = 0.0
    with pytest.raises(PlanNotFound, match=r"jump up: 0\.15"):
        climb(KINDS["high"], [])


@needs_solver
def test_a_small_climb_is_planned_and_played(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    monkeypatch.setenv(CACHE_VARIABLE, str(tmp_path))
    kind = KINDS["high"]
    small = Kind(kind.title, kind.unit, kind.scale, kind.sizes[:2], kind.ask)
    found = climb(small, [])
    assert found.size == 0.2
    monkeypatch.setattr("motions.dynamics.plan_cache.solve", None)  # what is kept is played
    values = jump_limits.measure(Trial(0), "high", found.jump).values
    assert values["high.done"] == 1.0
    assert values["high.reached"] == pytest.approx(values["high.planned"], abs=0.02)
    assert values["high.asked"] <= 1.0
    motor = MODEL.motor.scaled(PlanLimits().torque_share)
    assert values["high.reached"] < best_take_off(MODEL, motor, PlanLimits()).feet
