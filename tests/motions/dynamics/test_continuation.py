"""A plan as the start for another: at the same knots it is itself, and it saves iterations."""

from dataclasses import replace

import numpy as np
import pytest

from go2_wbc.errors import TimelineError
from go2_wbc.robot.model import RobotModel
from motions.dynamics import DynamicTrajectory, PhaseProblem, Solved, audit, phase_builders, solve
from motions.dynamics.solver import continued
from tests.motions.dynamics.conftest import PROBLEMS

EXACT = 1e-9
FARTHER = PhaseProblem(phase_builders.jump(x=-0.33, yaw=0.55))


@pytest.fixture
def jump(plans: dict[str, DynamicTrajectory]) -> Solved:
    return Solved(PROBLEMS["jump"], plans["jump"])


def test_at_its_own_knots_a_plan_is_its_own_start(jump: Solved, model: RobotModel) -> None:
    x, tau = continued(jump, jump.problem, jump.plan.times, model)
    np.testing.assert_allclose(x[:, :19], jump.plan.q, atol=EXACT)
    np.testing.assert_allclose(x[:, 19:], jump.plan.v, atol=EXACT)
    np.testing.assert_array_equal(tau, jump.plan.tau)


def test_a_longer_phase_takes_the_same_states_at_its_ends(jump: Solved, model: RobotModel) -> None:
    push, factor = jump.problem.phases[1], 1.5
    phases = list(jump.problem.phases)
    phases[1] = replace(push, duration=factor * push.duration)
    begin, end = phases[0].duration, phases[0].duration + push.duration
    times = np.array([begin, begin + factor * push.duration])
    x, _ = continued(jump, PhaseProblem(tuple(phases)), times, model)
    rows = np.searchsorted(jump.plan.times, np.array([begin, end]) - EXACT)
    np.testing.assert_allclose(x[:, :19], jump.plan.q[rows], atol=1e-6)


def test_other_feet_in_a_phase_are_no_start(jump: Solved, model: RobotModel) -> None:
    with pytest.raises(TimelineError, match=r"of 6 phases is no start for these 6: the same feet"):
        solve(PROBLEMS["rear"], model, start=jump)


def test_a_start_next_to_it_finds_a_plan_in_fewer_iterations(
    jump: Solved, model: RobotModel
) -> None:
    cold, warm = solve(FARTHER, model), solve(FARTHER, model, start=jump)
    assert warm.iterations < cold.iterations
    assert all(reading.is_kept for reading in audit(warm, model))
    np.testing.assert_allclose(warm.p_feet[-1], cold.p_feet[-1], atol=0.01)
