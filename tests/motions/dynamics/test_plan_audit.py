"""The audit of a plan finds every way in which one can be broken."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pinocchio as pin
import pytest

from go2_wbc.legs import Leg
from go2_wbc.robot.model import RobotModel
from motions.dynamics import DynamicTrajectory, audit


def broken(plan: DynamicTrajectory, model: RobotModel) -> set[str]:
    return {reading.name for reading in audit(plan, model) if not reading.is_kept}


@pytest.fixture
def jump(plans: dict[str, DynamicTrajectory]) -> DynamicTrajectory:
    copies = {
        name: getattr(plans["jump"], name).copy() for name in ("q", "v", "tau", "forces", "p_feet")
    }
    return replace(plans["jump"], **copies)


def test_a_solved_plan_keeps_everything(plan: DynamicTrajectory, model: RobotModel) -> None:
    assert broken(plan, model) == set()


def test_a_wrong_torque_is_a_defect(jump: DynamicTrajectory, model: RobotModel) -> None:
    jump.tau[5, 3] += 0.01
    assert broken(jump, model) == {"defect"}


def test_a_force_outside_the_cone_is_found(jump: DynamicTrajectory, model: RobotModel) -> None:
    jump.forces[5, Leg.RL, 0] = 0.7 * jump.forces[5, Leg.RL, 2]
    assert "friction" in broken(jump, model)
    jump.forces[5, Leg.RL, 2] = -5.0
    assert "pull of the ground" in broken(jump, model)


def test_a_torque_beyond_the_motors_line_is_found(
    jump: DynamicTrajectory, model: RobotModel
) -> None:
    fast = 0.8 * model.speed_limits[2]
    jump.v[5, 8], jump.tau[5, 2] = fast, 0.8 * model.torque_limits[2]
    found = broken(jump, model)
    assert "torque share" in found
    jump.v[5, 8] = 1.1 * model.speed_limits[2]
    assert "speed share" in broken(jump, model)


def test_a_foot_under_the_ground_or_sliding_is_found(
    jump: DynamicTrajectory, model: RobotModel
) -> None:
    flying = int(np.flatnonzero(~jump.stance.any(axis=1))[3])
    jump.p_feet[flying, Leg.FR, 2] = 0.0
    jump.p_feet[-1, Leg.RL, 0] += 0.05
    assert broken(jump, model) == {"depth under ground", "slip"}


def test_a_foot_may_sink_in_the_step_in_which_it_pushes_off(
    jump: DynamicTrajectory, model: RobotModel
) -> None:
    """Up to there it stands: the way that is left of the last step's curvature is no flight's."""
    lifts = int(np.flatnonzero(~jump.stance.any(axis=1))[0])
    jump.p_feet[lifts, Leg.FR, 2] = model.foot_radius - 0.009
    assert broken(jump, model) == set()
    jump.p_feet[lifts + 1, Leg.FR, 2] = model.foot_radius - 0.009
    assert broken(jump, model) == {"depth under ground"}


def test_a_joint_beyond_its_range_is_found(jump: DynamicTrajectory, model: RobotModel) -> None:
    jump.q[5, 9] = model.q_upper[2] + 0.01
    assert "angle beyond its limit" in broken(jump, model)


def test_a_turn_that_the_rates_do_not_make_is_found(
    jump: DynamicTrajectory, model: RobotModel
) -> None:
    turn = pin.Quaternion(pin.exp3(np.array([0.0, 0.3, 0.0]))).coeffs()
    jump.q[30, 3:7] = turn
    assert "integrated rotation" in broken(jump, model)


def test_a_reading_says_what_where_and_when(jump: DynamicTrajectory, model: RobotModel) -> None:
    jump.p_feet[-1, Leg.RL, 0] += 0.05
    (slip,) = [reading for reading in audit(jump, model) if not reading.is_kept]
    assert slip.value == pytest.approx(0.05, abs=0.001)  # less what the plan itself is off
    assert str(slip).startswith(f"slip of RL_foot at {jump.duration:.2f} s: {slip.value:.3g} m")
