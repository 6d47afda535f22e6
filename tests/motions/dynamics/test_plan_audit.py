"""The audit of a plan finds every way in which one can be broken."""

from collections.abc import Callable, Mapping
from dataclasses import replace

import numpy as np
import pinocchio as pin
import pytest

from go2_wbc.legs import Leg
from go2_wbc.robot.model import RobotModel
from motions.dynamics import DynamicTrajectory, audit
from motions.dynamics.plan_audit import drift


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


def test_a_standing_foot_drifts_from_where_it_came_down() -> None:
    p_feet, stance = np.zeros((6, 4, 3)), np.ones((5, 4), dtype=bool)
    p_feet[:, :, 1] = np.arange(6)[:, None]
    stance[2, Leg.FR] = False
    off = drift(p_feet, stance)
    assert off[:, Leg.FL].tolist() == [0, 1, 2, 3, 4, 5]
    assert off[:, Leg.FR].tolist() == [0, 1, 2, 0, 1, 2]


BROKEN: Mapping[str, Callable[[DynamicTrajectory, RobotModel], tuple[str, object, float]]] = {
    "defect": lambda plan, model: ("tau", (5, 3), plan.tau[5, 3] + 0.01),
    "friction": lambda plan, model: ("forces", (5, Leg.RL, 0), 0.7 * plan.forces[5, Leg.RL, 2]),
    "pull of the ground": lambda plan, model: ("forces", (5, Leg.RL, 2), -5.0),
    "torque share": lambda plan, model: ("tau", (5, 2), 0.8 * model.torque_limits[2]),
    "speed share": lambda plan, model: ("v", (5, 8), 1.1 * model.speed_limits[2]),
    "angle beyond its limit": lambda plan, model: ("q", (5, 9), model.q_upper[2] + 0.01),
}


@pytest.mark.parametrize("name", BROKEN)
def test_what_is_broken_in_a_solved_plan_is_found(
    jump: DynamicTrajectory, model: RobotModel, name: str
) -> None:
    array, where, value = BROKEN[name](jump, model)
    if name == "torque share":  # at a speed at which the motor gives less
        jump.v[5, 8] = 0.8 * model.speed_limits[2]
    getattr(jump, array)[where] = value
    found = broken(jump, model)
    assert name in found
    assert name != "defect" or found == {"defect"}


def test_a_foot_under_the_ground_or_sliding_and_a_turn_that_is_none_are_found(
    jump: DynamicTrajectory, model: RobotModel
) -> None:
    flying = int(np.flatnonzero(~jump.stance.any(axis=1))[3])
    jump.p_feet[flying, Leg.FR, 2] = 0.0
    jump.p_feet[-1, Leg.RL, 0] += 0.05
    assert broken(jump, model) == {"depth under ground", "slip"}
    turn = pin.Quaternion(pin.exp3(np.array([0.0, 0.3, 0.0]))).coeffs()
    jump.q[30, 3:7] = turn
    assert "integrated rotation" in broken(jump, model)


def test_a_foot_may_sink_in_the_step_in_which_it_pushes_off(
    jump: DynamicTrajectory, model: RobotModel
) -> None:
    """Up to there it stands: the way that is left of the last step's curvature is no flight's."""
    lifts = int(np.flatnonzero(~jump.stance.any(axis=1))[0])
    jump.p_feet[lifts, Leg.FR, 2] = model.foot_radius - 0.009
    assert broken(jump, model) == set()
    jump.p_feet[lifts + 1, Leg.FR, 2] = model.foot_radius - 0.009
    assert broken(jump, model) == {"depth under ground"}


def test_a_reading_says_what_where_and_when(jump: DynamicTrajectory, model: RobotModel) -> None:
    jump.p_feet[-1, Leg.RL, 0] += 0.05
    (slip,) = [reading for reading in audit(jump, model) if not reading.is_kept]
    assert slip.value == pytest.approx(0.05, abs=0.001)  # less what the plan itself is off
    assert str(slip).startswith(f"slip of RL_foot at {jump.duration:.2f} s: {slip.value:.3g} m")
