"""Solved once for all tests: a jump, a rear and a lift, each a second of processor time."""

import pytest

from go2_wbc.legs import Leg
from go2_wbc.robot.model import RobotModel
from motions.dynamics import DynamicTrajectory, PhaseProblem, solve
from motions.dynamics import phases as phase_builders
from tests.solver import HAS_SOLVER, IS_REQUIRED

PROBLEMS = {
    "jump": PhaseProblem(phase_builders.jump(x=-0.3, yaw=0.5)),
    "hop": PhaseProblem(phase_builders.hop(times=1)),
    "rear": PhaseProblem(phase_builders.rear()),
    "lift": PhaseProblem(phase_builders.lift((Leg.FR, Leg.RL))),
}


@pytest.fixture(scope="session")
def plans(model: RobotModel) -> dict[str, DynamicTrajectory]:
    if not (HAS_SOLVER or IS_REQUIRED):
        pytest.skip("crocoddyl is not installed: pip install go2-wbc[dynamics]")
    return {name: solve(problem, model) for name, problem in PROBLEMS.items()}


@pytest.fixture(params=PROBLEMS)
def name(request: pytest.FixtureRequest) -> str:
    return request.param


@pytest.fixture
def plan(plans: dict[str, DynamicTrajectory], name: str) -> DynamicTrajectory:
    return plans[name]
