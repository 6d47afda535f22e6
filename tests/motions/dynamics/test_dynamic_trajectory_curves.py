"""Between knots a plan moves as its own accelerations say: nothing is invented."""

import numpy as np
import pytest

from go2_wbc.robot.model import RobotModel
from motions.dynamics import DynamicTrajectory, pieces
from motions.dynamics.dynamic_trajectory import COM, FEET, JOINTS, centred

JOINT_JERK = 15.0  # rad/s^2; knots of 19.6 to 20 ms beside each other shift rates by that
COM_ACCELERATION = 2.5  # m/s^2 of up to 40: the CoM of the middle of a knot is not that of its end


def middles(plan: DynamicTrajectory) -> np.ndarray:
    return 0.5 * (plan.times[1:] + plan.times[:-1])


def test_joints_accelerate_as_planned(plan: DynamicTrajectory, model: RobotModel) -> None:
    planned = np.diff(plan.v[:, 6:], axis=0) / np.diff(plan.times)[:, None]
    curves = pieces(plan, model)
    for share in (0.01, 0.5, 0.99):
        t = plan.times[:-1] + share * np.diff(plan.times)
        assert curves(t, 2)[:, JOINTS] == pytest.approx(planned, abs=JOINT_JERK)


def test_the_com_accelerates_as_the_forces_say(plan: DynamicTrajectory, model: RobotModel) -> None:
    wanted = plan.forces.sum(axis=1) / model.mass - [0.0, 0.0, model.gravity]
    found = pieces(plan, model)(middles(plan), 2)[:, COM]
    assert found == pytest.approx(wanted, abs=COM_ACCELERATION)


def test_positions_and_rates_are_continuous(plan: DynamicTrajectory, model: RobotModel) -> None:
    curves = pieces(plan, model)
    inner = plan.times[1:-1]
    for order, jump in ((0, 1e-7), (1, 1e-5)):
        before, after = curves(inner - 1e-10, order), curves(inner + 1e-10, order)
        assert before == pytest.approx(after, abs=jump)


def test_a_standing_foot_hardly_moves(plan: DynamicTrajectory, model: RobotModel) -> None:
    rates = pieces(plan, model)(middles(plan), 1)[:, FEET].reshape(-1, 4, 3)
    settled = plan.stance & np.vstack([plan.stance[:1], plan.stance[:-1]])
    assert np.linalg.norm(rates[settled], axis=-1).max() < 0.15


def test_the_ends_are_those_of_the_plan(plan: DynamicTrajectory, model: RobotModel) -> None:
    q = centred(plan, model)
    assert q[0] == pytest.approx(plan.q[0])
    assert q[-1] == pytest.approx(plan.q[-1], abs=2e-3)
