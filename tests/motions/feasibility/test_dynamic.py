"""Contact forces of a motion: what they must be, said without the QP that finds them."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy.linalg import null_space

from go2_wbc.robot.model import RobotModel
from motions import Timeline, compile_timeline
from motions.feasibility.dynamic import forces_of
from motions.trajectory import Trajectory, trajectory_of
from tests.engine_helpers import state_of

EXACT = 1e-6  # N; what the QP's solver leaves


@pytest.fixture(scope="module")
def model() -> RobotModel:
    return RobotModel()


@pytest.fixture(scope="module")
def resting(model: RobotModel) -> Trajectory:
    line = Timeline().body(z=-0.001, over=0.1).home(over=0.1)
    return trajectory_of(compile_timeline(line, model), model)


@pytest.mark.parametrize("share", [[1.0, 1.0, 1.0, 1.0], [1.0, 0.5, 0.7, 1.0], [0.4, 1, 1, 1]])
def test_what_the_wrench_leaves_open_is_shared_as_the_loads_are(
    model: RobotModel, resting: Trajectory, share: list[float]
) -> None:
    # Forces that cancel each other in the trunk's wrench cost nothing there, so in those
    # directions the forces are those of the even share exactly (KKT conditions of the QP).
    asked = np.tile(share, (len(resting.times), 1))
    forces = forces_of(replace(resting, load_share=asked), model).contact[0]
    J = model.snapshot(state_of(resting.q[0], resting.v[0])).J_contacts
    internal = null_space(J[:, :, :6].reshape(12, 6).T)
    even = np.zeros((4, 3))
    even[:, 2] = model.mass * model.gravity * np.array(share) / np.sum(share)
    assert internal.T @ forces.ravel() == pytest.approx(internal.T @ even.ravel(), abs=EXACT)
