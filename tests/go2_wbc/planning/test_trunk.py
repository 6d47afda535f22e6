"""The trunk's reference on a slope, and what the forces are planned for there."""

from __future__ import annotations

import numpy as np
import pytest

from go2_wbc.contacts import GAITS
from go2_wbc.planning.force_mpc import fill_goals
from go2_wbc.planning.ground import FOLLOW, Ground
from go2_wbc.planning.locomotion import LocomotionConfig
from go2_wbc.planning.mpc import NODES
from go2_wbc.planning.trunk import Command, Trunk, fill_body
from go2_wbc.planning.walk import Planner, Walk
from go2_wbc.reference import Target
from go2_wbc.robot.rotations import log_rotation, yaw_rotation
from tests.go2_wbc.planning.squared import MODEL

SLOPE = np.array([0.2, -0.1])
EXACT = 1e-12


def attitude(yaw: float, slope: np.ndarray) -> np.ndarray:
    target = Target()
    fill_body(Trunk(yaw=yaw), Ground(slope=slope / FOLLOW), 0.3, target)
    return target.R_world_base


def test_a_trunk_on_a_slope_keeps_its_heading_and_has_its_normal_up() -> None:
    R = attitude(0.7, SLOPE)
    np.testing.assert_allclose(R.T @ R, np.eye(3), atol=EXACT)
    np.testing.assert_allclose(R[:, 2], np.array([-0.2, 0.1, 1.0]) / np.sqrt(1.05), atol=EXACT)
    assert np.arctan2(R[1, 0], R[0, 0]) == pytest.approx(0.7, abs=EXACT)
    np.testing.assert_allclose(attitude(0.7, np.zeros(2)), yaw_rotation(0.7), atol=EXACT)


@pytest.mark.parametrize("slope", [(0.0, 0.3), (0.3, 0.0)])
def test_the_turn_that_is_planned_for_is_that_of_the_slope(slope: tuple[float, float]) -> None:
    walk = Walk.of(MODEL, GAITS["trot"], LocomotionConfig())
    planner = Planner(ground=Ground(slope=np.array(slope) / FOLLOW))
    fill_goals(planner, walk, Command())
    turn = log_rotation(attitude(0.0, np.array(slope)))
    np.testing.assert_allclose(planner.horizon.goals[:, :3], np.tile(turn, (NODES, 1)), atol=EXACT)
    assert np.linalg.norm(turn) == pytest.approx(np.arctan(0.3))
