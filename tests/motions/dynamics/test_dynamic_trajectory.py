"""A plan survives a file; what is no plan is refused."""

from dataclasses import replace

import numpy as np
import pytest

from go2_wbc.errors import MotionError
from go2_wbc.robot.model import RobotModel
from motions.dynamics import DynamicTrajectory, Miss, pieces
from motions.dynamics.dynamic_trajectory import COM, FEET, JOINTS, centred

MISSES = (Miss("trunk", "land", 0.04, 0.012, 0.1), Miss("FL_foot", "land", 0.04, 0.02, 0.0))
PLAN = DynamicTrajectory(
    times=np.array([0.0, 0.02, 0.04]),
    q=np.ones((3, 19)),
    v=np.zeros((3, 18)),
    tau=np.full((2, 12), 3.0),
    forces=np.zeros((2, 4, 3)),
    stance=np.array([[True] * 4, [False] * 4]),
    gains=np.zeros((2, 12, 36)),
    p_feet=np.zeros((3, 4, 3)),
    iterations=7,
    cost=0.25,
    misses=MISSES,
)


def test_a_plan_comes_back_from_its_bytes_and_damaged_ones_are_refused() -> None:
    copy = DynamicTrajectory.from_bytes(PLAN.to_bytes())
    for name in ("times", "q", "v", "tau", "forces", "stance", "gains", "p_feet"):
        assert np.array_equal(getattr(copy, name), getattr(PLAN, name))
    assert (copy.iterations, copy.cost, copy.misses) == (7, 0.25, MISSES)
    small = DynamicTrajectory.from_bytes(PLAN.to_bytes(is_small=True))
    assert small.gains.dtype == np.float64, "they are kept in 16 bits, and reckoned with in 64"
    content = PLAN.to_bytes()
    for bad in (b"", b"no plan", content[:-200], content[:200], b"\x00" + content):
        with pytest.raises(MotionError, match="no dynamic trajectory"):
            DynamicTrajectory.from_bytes(bad)
    content = replace(PLAN, tau=np.full((2, 12), np.nan)).to_bytes()
    with pytest.raises(MotionError, match=r"tau must be finite and \(2, 12\)"):
        DynamicTrajectory.from_bytes(content)


def test_the_deviation_names_the_worst_place_and_angle() -> None:
    assert PLAN.position_deviation == 0.02
    assert PLAN.angle_deviation == 0.1
    assert "FL_foot at 0.04 s (land): 20 mm" in PLAN.deviation
    assert "trunk at 0.04 s (land): 12 mm, 5.7 deg" in PLAN.deviation


JOINT_JERK = 15.0  # rad/s^2; knots of 19.6 to 20 ms beside each other shift rates by that
COM_ACCELERATION = 2.5  # m/s^2 of up to 40: the CoM of the middle of a knot is not that of its end


def middles(plan: DynamicTrajectory) -> np.ndarray:
    return 0.5 * (plan.times[1:] + plan.times[:-1])


def test_joints_and_com_accelerate_as_planned_and_positions_are_continuous(
    plan: DynamicTrajectory, model: RobotModel
) -> None:
    planned = np.diff(plan.v[:, 6:], axis=0) / np.diff(plan.times)[:, None]
    curves = pieces(plan, model)
    for share in (0.01, 0.5, 0.99):
        t = plan.times[:-1] + share * np.diff(plan.times)
        assert curves(t, 2)[:, JOINTS] == pytest.approx(planned, abs=JOINT_JERK)
    wanted = plan.forces.sum(axis=1) / model.mass - [0.0, 0.0, model.gravity]
    found = pieces(plan, model)(middles(plan), 2)[:, COM]
    assert found == pytest.approx(wanted, abs=COM_ACCELERATION)
    curves = pieces(plan, model)
    inner = plan.times[1:-1]
    for order, jump in ((0, 1e-7), (1, 1e-5)):
        before, after = curves(inner - 1e-10, order), curves(inner + 1e-10, order)
        assert before == pytest.approx(after, abs=jump)


def test_a_standing_foot_hardly_moves_and_the_ends_are_those_of_the_plan(
    plan: DynamicTrajectory, model: RobotModel
) -> None:
    rates = pieces(plan, model)(middles(plan), 1)[:, FEET].reshape(-1, 4, 3)
    settled = plan.stance & np.vstack([plan.stance[:1], plan.stance[:-1]])
    assert np.linalg.norm(rates[settled], axis=-1).max() < 0.15
    q = centred(plan, model)
    assert q[0] == pytest.approx(plan.q[0])
    assert q[-1] == pytest.approx(plan.q[-1], abs=2e-3)
