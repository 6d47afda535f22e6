"""A robot in MuJoCo under a controller, which most tests of this folder ask for."""

from collections.abc import Iterator

import pytest

from controller import GO2Controller
from go2_wbc.robot.model import RobotModel
from motions import CompiledPlan, Timeline, compile_timeline
from tests.controller.plants import WatchedPlant


@pytest.fixture(scope="session")
def raised(model: RobotModel) -> CompiledPlan:
    """A paw that is raised and put down again."""
    line = Timeline(name="raise").foot("FR", z=0.06, over=0.5).hold(0.2).home(over=0.5)
    return compile_timeline(line, model)


@pytest.fixture
def plant() -> WatchedPlant:
    return WatchedPlant()


@pytest.fixture
def go2(plant: WatchedPlant) -> Iterator[GO2Controller]:
    """Lies on the ground of ``plant``."""
    with GO2Controller(plant=plant) as robot:
        yield robot


@pytest.fixture
def standing(go2: GO2Controller) -> GO2Controller:
    assert go2.stand()
    return go2
