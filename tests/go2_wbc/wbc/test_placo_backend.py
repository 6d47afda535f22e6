"""PlaCo's dynamics solver as an oracle: the same QP, formulated by somebody else."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pinocchio as pin
import pytest

from go2_wbc.errors import QpInfeasible
from go2_wbc.legs import JOINT_NAMES, LEGS
from go2_wbc.reference import BodyTarget, LegTask, Reference, TrackedPoint
from go2_wbc.robot.inverse_kinematics import load_placo_robot
from go2_wbc.robot.model import RobotModel
from go2_wbc.robot.rotations import rotation_from_rpy
from go2_wbc.robot.snapshot import Snapshot
from go2_wbc.robot.state import RobotState
from go2_wbc.wbc.controller import WbcConfig, WholeBodyController
from go2_wbc.wbc.solution import WbcSolution
from tests.engine_helpers import fast_cases, with_planned_forces

STATES = 120
TORQUE_TOLERANCE = 1e-5  # [N m]; measured 1.4e-7 at force_weight 1e-4
FORCE_TOLERANCE = 1e-4  # [N]; measured 5e-7
MOTION_TOLERANCE = 1e-8  # [N, N m]; rounding of a 158 N robot; measured 5e-13
REGULARISED = 0.05  # [N]; what the soft force regularisation takes; measured 0.011
ACTIVE = 1e-6  # [N, N m, rad/s^2]: nearer than this to a bound is on it
EFFORTS = (0.0, 2.0, 15.0)  # scale of the desired accelerations: at rest, lively, too much

ST, SW, JO = LegTask.STANCE, LegTask.SWING, LegTask.JOINTS
THREE_FEET = [tuple(t if leg is up else ST for leg in LEGS) for up in LEGS for t in (SW, JO)]
MODES = [(ST, ST, ST, ST), *THREE_FEET, (ST, SW, SW, ST), (SW, ST, ST, SW), (JO, ST, ST, JO)]


def random_snapshot(model: RobotModel, rng: np.random.Generator) -> Snapshot:
    orientation = pin.Quaternion(rotation_from_rpy(*rng.normal(scale=0.1, size=3))).coeffs()
    joints = np.tile([0.0, 0.85, -1.7], 4) + rng.normal(scale=0.15, size=12)
    q = np.concatenate([rng.normal(scale=0.3, size=3), orientation, joints])
    v = np.concatenate([rng.normal(scale=0.5, size=6), rng.normal(scale=1.0, size=12)])
    return model.snapshot(RobotState(0.0, q, v, np.zeros(12), np.zeros(4), np.zeros(4, dtype=bool)))


def random_reference(
    snapshot: Snapshot,
    legs: tuple[LegTask, LegTask, LegTask, LegTask],
    effort: float,
    rng: np.random.Generator,
) -> Reference:
    point = TrackedPoint.COM if rng.random() < 0.5 else TrackedPoint.BASE
    p = snapshot.p_world_com if point is TrackedPoint.COM else snapshot.state.p_world_base
    turn = rotation_from_rpy(*rng.normal(scale=0.1, size=3))
    body = BodyTarget(
        point=point,
        p_world=p + rng.normal(scale=0.02, size=3),
        v_world=rng.normal(scale=0.2, size=3),
        a_world=effort * rng.normal(size=3),
        R_world_base=snapshot.R_world_base @ turn,
        w_world=rng.normal(scale=0.3, size=3),
        dw_world=effort * rng.normal(size=3),
    )
    return Reference(
        body=body,
        legs=legs,
        normal_force_min=rng.choice([0.0, 5.0, 15.0], size=4),
        normal_force_max=rng.choice([40.0, 90.0, 250.0], size=4),
        p_world_feet=snapshot.p_world_feet + rng.normal(scale=0.03, size=(4, 3)),
        v_world_feet=rng.normal(scale=0.3, size=(4, 3)),
        a_world_feet=effort * rng.normal(size=(4, 3)),
        q_joints=snapshot.state.joint_positions + rng.normal(scale=0.1, size=12),
        v_joints=rng.normal(scale=0.5, size=12),
        a_joints=3.0 * effort * rng.normal(size=12),
    )


def cases(model: RobotModel, seed: int) -> list[tuple[Snapshot, Reference]]:
    rng = np.random.default_rng(seed)
    found = []
    for index in range(STATES):
        snapshot = random_snapshot(model, rng)
        effort = EFFORTS[index % len(EFFORTS)]
        legs = MODES[(index // len(EFFORTS)) % len(MODES)]
        found.append((snapshot, random_reference(snapshot, legs, effort, rng)))
    return found


def motion_error(snapshot: Snapshot, solution: WbcSolution) -> float:
    generalised = np.concatenate([np.zeros(6), solution.tau])
    for J, force in zip(snapshot.J_contacts, solution.forces, strict=True):
        generalised += J.T @ force
    M, h = snapshot.mass_matrix, snapshot.bias
    return float(np.abs(M @ solution.qdd + h - generalised).max())


def standing(model: RobotModel) -> tuple[Snapshot, Reference]:
    q = np.concatenate([[0.0, 0.0, 0.3, 0.0, 0.0, 0.0, 1.0], np.tile([0.0, 0.85, -1.7], 4)])
    state = RobotState(0.0, q, np.zeros(18), np.zeros(12), np.zeros(4), np.zeros(4, dtype=bool))
    snapshot = model.snapshot(state)
    reference = random_reference(snapshot, (ST, ST, ST, ST), 0.0, np.random.default_rng(0))
    body = replace(
        reference.body, point=TrackedPoint.COM, p_world=snapshot.p_world_com, v_world=np.zeros(3)
    )
    body = replace(body, R_world_base=np.eye(3), w_world=np.zeros(3))
    reference = replace(reference, body=body, normal_force_min=np.full(4, 5.0))
    return snapshot, replace(reference, normal_force_max=np.full(4, 250.0))


@pytest.mark.parametrize("foot_radius", [0.022, 0.0], ids=["rolling feet", "point feet"])
def test_both_back_ends_find_the_same_torques_forces_and_accelerations(foot_radius: float) -> None:
    model = RobotModel(foot_radius=foot_radius)
    ours, oracle = WholeBodyController(model), WholeBodyController(model, "placo")
    for snapshot, reference in cases(model, seed=4):
        a, b = ours.solve(snapshot, reference), oracle.solve(snapshot, reference)
        np.testing.assert_allclose(a.tau, b.tau, atol=TORQUE_TOLERANCE, rtol=0)
        np.testing.assert_allclose(a.forces, b.forces, atol=FORCE_TOLERANCE, rtol=0)
        np.testing.assert_allclose(a.qdd, b.qdd, atol=FORCE_TOLERANCE, rtol=1e-6)
        assert motion_error(snapshot, a) < MOTION_TOLERANCE
        assert motion_error(snapshot, b) < MOTION_TOLERANCE


def test_both_back_ends_keep_near_the_planned_forces() -> None:
    model, rng = RobotModel(), np.random.default_rng(8)
    ours, oracle = WholeBodyController(model), WholeBodyController(model, "placo")
    for snapshot, plain in cases(model, seed=9)[::3]:
        for reference in (with_planned_forces(plain, rng), plain):  # and back again
            a, b = ours.solve(snapshot, reference), oracle.solve(snapshot, reference)
            np.testing.assert_allclose(a.tau, b.tau, atol=TORQUE_TOLERANCE, rtol=0)
            np.testing.assert_allclose(a.forces, b.forces, atol=FORCE_TOLERANCE, rtol=0)


def solved(
    wbc: WholeBodyController, snapshot: Snapshot, reference: Reference
) -> WbcSolution | None:
    try:
        return wbc.solve(snapshot, reference)
    except QpInfeasible:
        return None


def test_both_back_ends_keep_to_the_motors_line_where_joints_are_fast() -> None:
    model = RobotModel()
    ours, oracle = WholeBodyController(model), WholeBodyController(model, "placo")
    on_the_line = 0
    for snapshot, reference in fast_cases(model, 104, seed=7):
        a, b = solved(ours, snapshot, reference), solved(oracle, snapshot, reference)
        assert (a is None) == (b is None)
        if a is None or b is None:
            continue
        np.testing.assert_allclose(a.tau, b.tau, atol=TORQUE_TOLERANCE, rtol=0)
        lower, upper = model.motor.limits(snapshot.state.joint_velocities)
        excess = np.maximum(b.tau - upper, lower - b.tau)
        assert excess.max() < TORQUE_TOLERANCE
        is_cut = np.where(b.tau < 0.0, -lower, upper) < model.motor.peak
        on_the_line += int((is_cut & (excess > -TORQUE_TOLERANCE)).any())
    assert on_the_line > 5


def test_the_compared_problems_run_into_every_kind_of_limit() -> None:
    model = RobotModel()
    config = WbcConfig(torque_share=0.7, speed_share=0.15)
    ours = WholeBodyController(model, config=config)
    oracle = WholeBodyController(model, "placo", config)
    limit = model.torque_limits * config.torque_share
    kinds = ("friction", "torque", "least force", "greatest force", "joint")
    active = dict.fromkeys(kinds, 0)
    for snapshot, reference in cases(model, seed=5):
        problem = ours.formulate(snapshot, reference)
        a, b = ours.solve(snapshot, reference), oracle.solve(snapshot, reference)
        np.testing.assert_allclose(a.tau, b.tau, atol=TORQUE_TOLERANCE, rtol=0)
        stance = reference.stance
        tangential, normal = np.abs(b.forces[stance, :2]), b.forces[stance, 2]
        slack = config.friction * normal[:, None] - tangential
        active["friction"] += int((slack < ACTIVE).any())
        active["torque"] += int((limit - np.abs(b.tau) < ACTIVE).any())
        least, greatest = reference.normal_force_min[stance], reference.normal_force_max[stance]
        active["least force"] += int((normal - least < ACTIVE).any())
        active["greatest force"] += int((greatest - normal < ACTIVE).any())
        joints = problem.bounds.lower[-12:], problem.bounds.upper[-12:]
        distance = np.minimum(b.qdd[6:] - joints[0], joints[1] - b.qdd[6:])
        active["joint"] += int((distance < ACTIVE).any())
    assert min(active.values()) >= 5, active


def test_a_joint_at_its_limit_is_treated_alike() -> None:
    model = RobotModel()
    ours, oracle = WholeBodyController(model), WholeBodyController(model, "placo")
    snapshot, reference = standing(model)
    legs = (JO, ST, ST, ST)
    for beyond in (-0.02, 0.0, 0.01):
        q = snapshot.state.q.copy()
        q[9] = model.q_upper[2] + beyond
        v = np.zeros(18)
        v[8] = 1.0
        held = model.snapshot(replace(snapshot.state, q=q, v=v))
        wanted = replace(reference, legs=legs, a_joints=np.full(12, 300.0))
        a, b = ours.solve(held, wanted), oracle.solve(held, wanted)
        np.testing.assert_allclose(a.tau, b.tau, atol=TORQUE_TOLERANCE, rtol=0)
        assert b.qdd[8] <= 0.0 or beyond < 0.0


def test_a_foot_whose_normal_force_is_ramped_to_zero_is_treated_alike() -> None:
    model = RobotModel()
    snapshot, reference = standing(model)
    least, greatest = np.array([0.0, 5.0, 5.0, 5.0]), np.array([0.0, 250.0, 250.0, 250.0])
    unloaded = replace(reference, normal_force_min=least, normal_force_max=greatest)
    a = WholeBodyController(model).solve(snapshot, unloaded)
    b = WholeBodyController(model, "placo").solve(snapshot, unloaded)
    np.testing.assert_allclose(a.tau, b.tau, atol=TORQUE_TOLERANCE, rtol=0)
    np.testing.assert_allclose(b.forces[0], 0.0, atol=FORCE_TOLERANCE)


def test_a_static_stand_carries_the_weight() -> None:
    model = RobotModel()
    snapshot, reference = standing(model)
    solution = WholeBodyController(model, "placo").solve(snapshot, reference)
    weight = [0.0, 0.0, model.mass * model.gravity]
    inertial = model.mass * (snapshot.J_com @ solution.qdd + snapshot.drift_com)
    np.testing.assert_allclose(solution.forces.sum(axis=0), weight + inertial, atol=1e-9)
    np.testing.assert_allclose(inertial, 0.0, atol=REGULARISED)


def test_without_any_foot_on_the_ground_both_let_the_robot_fall() -> None:
    model = RobotModel()
    snapshot, reference = standing(model)
    flying = replace(reference, legs=(SW, SW, SW, SW))
    a = WholeBodyController(model).solve(snapshot, flying)
    b = WholeBodyController(model, "placo").solve(snapshot, flying)
    np.testing.assert_allclose(a.tau, b.tau, atol=TORQUE_TOLERANCE, rtol=0)
    fall = snapshot.J_com @ b.qdd + snapshot.drift_com
    np.testing.assert_allclose(fall, [0.0, 0.0, -model.gravity], atol=1e-6)


ROWS = [
    "body position",
    "body orientation",
    "swing feet",
    "leg posture",
    "force regularisation",
    "base dynamics",
    "stance feet",
    "contact forces",
    "torque limits",
    "joint limits",
]
WHIRL = 3.0 * np.random.default_rng(1).normal(size=12)


@pytest.mark.parametrize("backend", ["condensed", "placo"])
@pytest.mark.parametrize(
    ("least", "greatest", "share", "v_joints"),
    [
        (50.0, 20.0, 1.0, np.zeros(12)),
        (600.0, 700.0, 1.0, np.zeros(12)),
        (0.0, 250.0, 1e-9, WHIRL),
    ],
    ids=["least above greatest force", "forces beyond the torques", "no torque to hold feet"],
)
def test_contradicting_limits_raise_with_a_residual_table(
    backend: str, least: float, greatest: float, share: float, v_joints: np.ndarray
) -> None:
    model = RobotModel()
    snapshot, reference = standing(model)
    moving = replace(snapshot.state, v=np.concatenate([np.zeros(6), v_joints]))
    asked = replace(
        reference, normal_force_min=np.full(4, least), normal_force_max=np.full(4, greatest)
    )
    controller = WholeBodyController(model, backend, WbcConfig(torque_share=share))
    with pytest.raises(QpInfeasible) as caught:
        controller.solve(model.snapshot(moving), asked)
    assert [row.name for row in caught.value.residuals] == ROWS
    assert max(row.norm for row in caught.value.residuals[-3:]) > 0.0


def test_an_infeasible_tick_leaves_the_next_one_untouched() -> None:
    model = RobotModel()
    snapshot, reference = standing(model)
    controller = WholeBodyController(model, "placo")
    before = controller.solve(snapshot, reference).tau
    with pytest.raises(QpInfeasible):
        controller.solve(snapshot, replace(reference, normal_force_max=np.zeros(4)))
    np.testing.assert_array_equal(controller.solve(snapshot, reference).tau, before)


def test_placo_has_the_same_dynamics_as_pinocchio() -> None:
    model = RobotModel()
    robot = load_placo_robot(model)
    assert list(robot.joint_names()) == list(JOINT_NAMES)
    snapshot = random_snapshot(model, np.random.default_rng(8))
    robot.state.q, robot.state.qd = snapshot.state.q, snapshot.state.v
    robot.update_kinematics()
    np.testing.assert_allclose(robot.mass_matrix(), snapshot.mass_matrix, atol=1e-12)
    np.testing.assert_allclose(robot.non_linear_effects(), snapshot.bias, atol=1e-12)
    np.testing.assert_allclose(robot.com_jacobian(), snapshot.J_com, atol=1e-12)
