"""A simulated robot, and the same of Pinocchio."""

from collections.abc import Iterator

import pinocchio as pin
import pytest

from go2_wbc.plant import MujocoPlant
from go2_wbc.robot.description import find_description


@pytest.fixture
def plant() -> Iterator[MujocoPlant]:
    plant = MujocoPlant()
    yield plant
    plant.close()


@pytest.fixture(scope="module")
def robot() -> pin.Model:
    return pin.buildModelFromUrdf(str(find_description().urdf_path), pin.JointModelFreeFlyer())
