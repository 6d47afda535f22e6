"""PlaCo's dynamics solver as an oracle: the same QP, formulated by somebody else."""

from dataclasses import replace

import numpy as np
import pytest

from go2_wbc.errors import QpInfeasible
from go2_wbc.robot.model import RobotModel
from go2_wbc.wbc.controller import WbcConfig, WholeBodyController
from tests.engine_helpers import (
    JO,
    ST,
    cases,
    fast_cases,
    motion_error,
    solved_alike,
    standing,
    state_of,
    with_planned_forces,
)

STATES = 120
TORQUE_TOLERANCE = 1e-5  # [N m]; measured 1.4e-7 at force_weight 1e-4
FORCE_TOLERANCE = 1e-4  # [N]; measured 5e-7
MOTION_TOLERANCE = 1e-8  # [N, N m]; rounding of a 158 N robot; measured 5e-13
ACTIVE = 1e-6  # [N, N m, rad/s^2]: nearer than this to a bound is on it

MODEL = RobotModel()


def both(
    model: RobotModel = MODEL, config: WbcConfig | None = None
) -> tuple[WholeBodyController, WholeBodyController]:
    return WholeBodyController(model, config=config), WholeBodyController(model, "placo", config)


@pytest.mark.parametrize("foot_radius", [0.022, 0.0], ids=["rolling feet", "point feet"])
def test_both_back_ends_find_the_same_torques_forces_and_accelerations(foot_radius: float) -> None:
    model = RobotModel(foot_radius=foot_radius)
    problems = cases(model, STATES, seed=4)
    for snapshot, _, a, b in solved_alike(*both(model), problems, TORQUE_TOLERANCE):
        np.testing.assert_allclose(a.forces, b.forces, atol=FORCE_TOLERANCE, rtol=0)
        np.testing.assert_allclose(a.qdd, b.qdd, atol=FORCE_TOLERANCE, rtol=1e-6)
        assert motion_error(snapshot, a) < MOTION_TOLERANCE
        assert motion_error(snapshot, b) < MOTION_TOLERANCE


def test_both_back_ends_keep_near_planned_forces_and_ramp_them_to_zero_alike() -> None:
    rng, problems = np.random.default_rng(8), []
    for snapshot, plain in cases(MODEL, STATES // 3, seed=9):
        problems += [(snapshot, with_planned_forces(plain, rng)), (snapshot, plain)]  # and back
    for *_, a, b in solved_alike(*both(), problems, TORQUE_TOLERANCE):
        np.testing.assert_allclose(a.forces, b.forces, atol=FORCE_TOLERANCE, rtol=0)
    snapshot, reference = standing(MODEL)
    least, greatest = np.array([0.0, 5.0, 5.0, 5.0]), np.array([0.0, 250.0, 250.0, 250.0])
    unloaded = replace(reference, normal_force_min=least, normal_force_max=greatest)
    ((*_, b),) = solved_alike(*both(), [(snapshot, unloaded)], TORQUE_TOLERANCE)
    np.testing.assert_allclose(b.forces[0], 0.0, atol=FORCE_TOLERANCE)


def test_both_back_ends_keep_to_the_motors_line_where_joints_are_fast() -> None:
    on_the_line = 0
    fast = fast_cases(MODEL, 104, seed=7)
    for snapshot, _, _, b in solved_alike(*both(), fast, TORQUE_TOLERANCE):
        lower, upper = MODEL.motor.limits(snapshot.state.joint_velocities)
        excess = np.maximum(b.tau - upper, lower - b.tau)
        assert excess.max() < TORQUE_TOLERANCE
        is_cut = np.where(b.tau < 0.0, -lower, upper) < MODEL.motor.peak
        on_the_line += int((is_cut & (excess > -TORQUE_TOLERANCE)).any())
    assert on_the_line > 5


def test_the_compared_problems_run_into_every_kind_of_limit() -> None:
    config = WbcConfig(torque_share=0.7, speed_share=0.15)
    ours, oracle = both(config=config)
    limit = MODEL.torque_limits * config.torque_share
    kinds = ("friction", "torque", "least force", "greatest force", "joint")
    active = dict.fromkeys(kinds, 0)
    problems = cases(MODEL, STATES, seed=5)
    for snapshot, reference, _, b in solved_alike(ours, oracle, problems, TORQUE_TOLERANCE):
        bounds, stance = ours.formulate(snapshot, reference).bounds, reference.stance
        if not stance.any():
            continue
        tangential, normal = np.abs(b.forces[stance, :2]), b.forces[stance, 2]
        slack = config.friction * normal[:, None] - tangential
        active["friction"] += int((slack < ACTIVE).any())
        active["torque"] += int((limit - np.abs(b.tau) < ACTIVE).any())
        least, greatest = reference.normal_force_min[stance], reference.normal_force_max[stance]
        active["least force"] += int((normal - least < ACTIVE).any())
        active["greatest force"] += int((greatest - normal < ACTIVE).any())
        distance = np.minimum(b.qdd[6:] - bounds.lower[-12:], bounds.upper[-12:] - b.qdd[6:])
        active["joint"] += int((distance < ACTIVE).any())
    assert min(active.values()) >= 5, active


def test_a_joint_at_its_limit_is_treated_alike() -> None:
    snapshot, reference = standing(MODEL, (JO, ST, ST, ST))
    wanted, problems, beyond = (
        replace(reference, a_joints=np.full(12, 300.0)),
        [],
        (-0.02, 0.0, 0.01),
    )
    for off in beyond:
        q, v = snapshot.state.q.copy(), np.zeros(18)
        q[9], v[8] = MODEL.q_upper[2] + off, 1.0
        problems.append((MODEL.snapshot(state_of(q, v)), wanted))
    found = list(solved_alike(*both(), problems, TORQUE_TOLERANCE))
    for off, (*_, b) in zip(beyond, found, strict=True):
        assert b.qdd[8] <= 0.0 or off < 0.0


@pytest.mark.parametrize("case", ["forces beyond the torques", "no torque to hold feet"])
def test_contradicting_limits_raise_with_a_residual_table(case: str) -> None:
    """Forces of which the least is above the greatest: in ``test_bad_input``."""
    snapshot, reference = standing(MODEL)
    asked, moving, share = reference, snapshot.state, 1e-9
    if case == "forces beyond the torques":
        share = 1.0
        most = {"normal_force_min": np.full(4, 600.0), "normal_force_max": np.full(4, 700.0)}
        asked = replace(reference, **most)
    else:
        whirl = 3.0 * np.random.default_rng(1).normal(size=12)
        moving = replace(moving, v=np.concatenate([np.zeros(6), whirl]))
    for controller in both(config=WbcConfig(torque_share=share)):
        with pytest.raises(QpInfeasible) as caught:
            controller.solve(MODEL.snapshot(moving), asked)
        names = [source.name for source in controller.formulate(snapshot, reference).sources]
        assert [row.name for row in caught.value.residuals] == names
        assert max(row.norm for row in caught.value.residuals[-3:]) > 0.0
