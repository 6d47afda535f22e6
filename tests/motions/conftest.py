"""What most tests of motions need: a robot, and what checks motions on one."""

import pytest

from go2_wbc.robot.model import RobotModel
from motions import FeasibilityChecker


@pytest.fixture(scope="module")
def model() -> RobotModel:
    return RobotModel()


@pytest.fixture(scope="module")
def checker(model: RobotModel) -> FeasibilityChecker:
    return FeasibilityChecker(model)
