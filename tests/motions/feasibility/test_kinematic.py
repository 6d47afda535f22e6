"""Checks without forces: what is looked at, and when."""

from __future__ import annotations

import numpy as np
import pytest

from go2_wbc.legs import LEGS
from go2_wbc.robot.model import RobotModel
from motions import Timeline, compile_timeline
from motions.feasibility.kinematic import clearance
from motions.feasibility.limits import FeasibilityLimits
from motions.trajectory import Trajectory, trajectory_of


@pytest.fixture(scope="module")
def model() -> RobotModel:
    return RobotModel()


@pytest.fixture(scope="module")
def raising(model: RobotModel) -> Trajectory:
    line = Timeline().foot("FR", z=0.06, over=0.8).home(over=0.8)
    line = line.foot("RL", z=0.06, over=0.8).home(over=0.8)
    return trajectory_of(compile_timeline(line, model), model)


def test_only_a_standing_foot_is_excused_from_clearance(
    model: RobotModel, raising: Trajectory
) -> None:
    series = clearance(raising, model, FeasibilityLimits())
    unchecked = np.isnan(series.margins)
    for leg in LEGS:
        foot = unchecked[:, series.subjects.index(f"{leg.name} foot")]
        assert foot.tolist() == raising.stance[:, leg].tolist()
        assert not unchecked[:, series.subjects.index(f"{leg.name} knee")].any()
    assert not unchecked[:, series.subjects.index("trunk")].any()
