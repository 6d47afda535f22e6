"""Legs in the air follow their places, and their joints near a singularity."""

from dataclasses import replace

import numpy as np
import pinocchio as pin
import pytest

from benchmarks.validation_set.physics import play
from controller.motion_measurement import failures_of
from go2_wbc.legs import Leg
from go2_wbc.robot.leg_kinematics import LegGeometry
from go2_wbc.robot.model import RobotModel
from motions import CompiledPlan, FeasibilityChecker, Timeline
from motions.dynamics.dynamic_trajectory import DynamicTrajectory
from motions.plan.leg_tasks import determinants, tasks_of
from tests.solver import needs_solver

TRIPOD = (True, False, True, True)


@pytest.mark.parametrize("leg", [Leg.FL, Leg.RR])
def test_the_determinant_is_that_of_the_foots_jacobian(leg: Leg, model: RobotModel) -> None:
    rng, pin_model = np.random.default_rng(3), model.pin_model
    q = rng.uniform(model.q_lower, model.q_upper, (20, 12))
    found = determinants(LegGeometry.of(model, leg), q[:, leg.joints])
    data, frame = pin_model.createData(), pin_model.getFrameId(leg.foot)
    for angles, own in zip(q, found, strict=True):
        whole = np.concatenate([[0.0, 0.0, 0.3, 0.0, 0.0, 0.0, 1.0], angles])
        J = pin.computeFrameJacobian(
            pin_model, data, whole, frame, pin.ReferenceFrame.LOCAL_WORLD_ALIGNED
        )[:3, 6:][:, leg.joints]
        assert abs(own) == pytest.approx(abs(np.linalg.det(J)), abs=1e-9)


def _raised(thighs: list[float]) -> DynamicTrajectory:
    """FR in the air but for its first and its last knot, its thigh at these angles [rad]."""
    n = len(thighs)
    q = np.zeros((n + 1, 19))
    q[:, 6] = 1.0
    q[:-1, 7:] = np.tile([0.0, 0.8, -1.6], 4)
    q[:-1, 11] = thighs
    stance = np.ones((n, 4), dtype=bool)
    stance[1:-1] = TRIPOD
    return DynamicTrajectory(
        times=0.1 * np.arange(n + 1), q=q, v=np.zeros((n + 1, 18)), tau=np.zeros((n, 12)),
        forces=np.zeros((n, 4, 3)), stance=stance, gains=np.zeros((n, 12, 36)),
        p_feet=np.zeros((n + 1, 4, 3)), iterations=0, cost=0.0, misses=(),
    )  # fmt: skip


def test_a_foot_follows_its_joints_from_the_height_of_its_hip_until_it_is_below_again(
    model: RobotModel,
) -> None:
    times, stance, swings = tasks_of(_raised([0.8, 0.4, -0.8, -1.6, -0.8, 0.4, 0.8]), model)
    np.testing.assert_allclose(times, [0.0, 0.1, 0.2, 0.5, 0.6])
    assert stance[:, Leg.FR].tolist() == [True, False, False, False, True]
    assert swings[:, Leg.FR].tolist() == [False, True, False, True, False]
    assert not np.delete(swings, Leg.FR, axis=1).any()


def test_a_foot_that_stays_low_follows_its_place_all_along(model: RobotModel) -> None:
    times, stance, swings = tasks_of(_raised([0.8, 0.4, 0.2, 0.4, 0.8]), model)
    np.testing.assert_allclose(times, [0.0, 0.1, 0.4])
    np.testing.assert_array_equal(swings, ~stance)


@needs_solver
def test_a_paw_solved_past_the_height_of_its_hip_is_done(model: RobotModel) -> None:
    """It was passed at 93 %, and threw the trunk by 39 deg: its place was followed there."""
    line = Timeline(physics="nearest").foot("FR", z=0.5, over=0.5).down("FR", over=0.5)
    checker = FeasibilityChecker(model)
    plan = checker.plan(line.home(over=0.8))
    assert isinstance(plan, CompiledPlan)
    assert plan.dynamic
    assert plan.swings.any()
    assert checker.check(plan).ok
    assert not failures_of(play(plan, model, seed=0), plan)
    placed = replace(plan, swings=~plan.contacts.modes)
    assert failures_of(play(placed, model, seed=0), placed)
