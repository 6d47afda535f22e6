"""What each cost of a search says of a state: nothing within limits, and what was recorded."""

from pathlib import Path
from unittest.mock import Mock

import numpy as np
import pytest

from go2_wbc.robot.model import RobotModel
from motions.dynamics import PhaseProblem
from motions.dynamics.knots import knots_of
from motions.dynamics.plan_audit import PlanLimits, Weights
from tests.motions.dynamics.conftest import PROBLEMS
from tests.recorded import assert_as_recorded
from tests.solver import needs_solver

pytestmark = needs_solver
FILE = Path(__file__).with_name("recorded_costs.json")
LIMITS = PlanLimits()


def costs_of(
    problem: PhaseProblem, model: RobotModel, x: list[np.ndarray], u: np.ndarray
) -> dict[str, list[float]]:
    """Each cost with its weight, knot by knot; every fourth knot, and the last, at each state."""
    from motions.dynamics.shooting_problem import ShootingProblem

    found = ShootingProblem(knots_of(problem, model, LIMITS), model, LIMITS, Weights()).problem
    told = dict[str, list[float]]()
    for knot in (*[*found.runningModels][::4], found.terminalModel):
        data = knot.createData()
        for state in x:
            knot.calc(data, state, u)
            for item in knot.differential.costs.costs:
                name, cost = item.key(), item.data()
                value = cost.weight * data.differential.costs.costs[name].cost
                told.setdefault(name, []).append(value)
    return told


def beyond(model: RobotModel, off: float) -> list[np.ndarray]:
    """States in which one joint is at a limit and so far beyond: of its angle, then its speed."""
    lower, upper = model.q_lower + LIMITS.joint_margin, model.q_upper - LIMITS.joint_margin
    fastest, states = LIMITS.speed_share * model.speed_limits, list[np.ndarray]()
    for sign, angles in ((-1.0, lower), (1.0, upper)):
        for joint in range(12):
            for start, values in ((7, angles), (25, sign * fastest)):
                x = np.concatenate([[3.0, 2.0, 9.0, 0.0, 0.0, 0.0, 1.0], (lower + upper) / 2.0])
                x = np.concatenate([x, np.full(6, 9.0), np.zeros(12)])
                x[start + joint] = values[joint] + sign * off
                states.append(x)
    return states


def test_only_a_joint_beyond_a_limit_costs_anything(model: RobotModel) -> None:
    within, out = (beyond(model, off) for off in (-1e-6, 1e-3))
    told = costs_of(PROBLEMS["lift"], model, [*within, *out], np.zeros(12))["limits"]
    of_each = np.array(told).reshape(-1, 2, len(out))
    assert (of_each[:, 0] == 0.0).all()
    assert (of_each[:, 1] > 0.0).all()


@pytest.mark.parametrize("name", PROBLEMS)
def test_costs_are_those_recorded(name: str, model: RobotModel) -> None:
    rng, states = np.random.default_rng(1), list[np.ndarray]()
    for state in beyond(model, 0.1)[::5]:
        state[:3], state[7:] = rng.normal(scale=0.2, size=3), state[7:] + rng.normal(size=30)
        states.append(state)
    told = costs_of(PROBLEMS[name], model, states, rng.normal(scale=9.0, size=12))
    assert_as_recorded(FILE, name, {cost: np.arcsinh(told[cost]) for cost in told})


def test_a_clock_counts_tells_once_what_binds_and_ends_in_time(
    monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    import crocoddyl

    from motions.dynamics import shooting_problem

    now, told, solver = [5.0], list[tuple[int, float]](), Mock(spec=crocoddyl.SolverBoxFDDP, cost=2)
    monkeypatch.setattr(shooting_problem.time, "thread_time", lambda: now[0])
    caplog.set_level("INFO")
    clock = shooting_problem.Clock(30.0, lambda *given: told.append(given), lambda _: ["torque"])
    for after in (0.0, shooting_problem.FIRST_ANSWER, shooting_problem.FIRST_ANSWER + 0.1, 30.0):
        now[0] = 5.0 + after
        clock(solver)
    now[0] = 35.1
    with pytest.raises(shooting_problem._Expired):
        clock(solver)
    assert told == [(k, 2.0) for k in (1, 2, 3, 4, 5)]
    assert clock.iterations == 5
    assert caplog.text.count("what binds: torque") == 1
