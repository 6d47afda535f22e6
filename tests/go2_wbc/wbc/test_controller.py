"""The whole-body controller: a stand, its mirror image, hard demands, limits and refusals."""

from dataclasses import replace

import numpy as np
import pytest

from go2_wbc.errors import ConfigError, QpInfeasible, SolverUnavailable
from go2_wbc.legs import LEGS
from go2_wbc.reference import Reference
from go2_wbc.robot.model import RobotModel
from go2_wbc.wbc.config import WbcConfig
from go2_wbc.wbc.controller import WholeBodyController
from go2_wbc.wbc.solvers import SOLVERS
from tests.engine_helpers import (
    FOUR_FEET,
    JO,
    MODES,
    ST,
    SW,
    cases,
    holding_reference,
    mirrored_feet,
    mirrored_joints,
    mirrored_reference,
    mirrored_state,
    random_reference,
    random_state,
    standing,
    standing_q,
    state_of,
    symmetric_model,
)

BACKENDS = ("condensed", "full", "placo")
EXACT = 1e-8  # [N, N m] rounding of a 158 N robot
SOFT = 0.02  # [N] what the force regularisation takes from the height; measured 0.003
MIRRORED = 1e-6  # [N, N m] a mirrored QP takes another way to the same minimum; measured 1e-8
ACTIVE = 1e-5  # [N, N m] nearer than this to a bound is on it
CONFIG = WbcConfig()
NAMES = [
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


MODEL = RobotModel()


STAND = standing(MODEL)


@pytest.mark.parametrize("backend", BACKENDS)
def test_forces_and_torques_of_a_static_stand_are_its_static_equilibrium(backend: str) -> None:
    """sum f = m g, tau = g - J' f joint by joint, and no moment about the CoM is left."""
    snapshot, reference = STAND
    solution = WholeBodyController(MODEL, backend).solve(snapshot, reference)
    weight = [0.0, 0.0, MODEL.mass * MODEL.gravity]
    np.testing.assert_allclose(solution.forces.sum(axis=0), weight, atol=SOFT)
    gravity = MODEL.inverse_dynamics(snapshot.state.q, np.zeros(18), np.zeros(18))
    supported = np.einsum("lij,li->j", snapshot.J_contacts, solution.forces)
    np.testing.assert_allclose(solution.tau, (gravity - supported)[6:], atol=SOFT)
    ground = snapshot.p_world_feet - [0.0, 0.0, MODEL.foot_radius]
    arms = ground - snapshot.p_world_com
    moment = np.cross(arms, solution.forces).sum(axis=0)
    np.testing.assert_allclose(moment, 0.0, atol=SOFT)
    np.testing.assert_allclose(solution.qdd, 0.0, atol=SOFT)


@pytest.mark.parametrize("raised", LEGS)
def test_three_feet_carry_the_weight_too(raised: int) -> None:
    """The CoM lies near the edge of their triangle, so it moves too: m (a - g) is carried."""
    snapshot = MODEL.snapshot(state_of(standing_q()))
    legs = tuple(JO if leg == raised else ST for leg in LEGS)
    solution = WholeBodyController(MODEL).solve(snapshot, holding_reference(snapshot, legs))
    assert not solution.forces[raised].any()
    a_com = snapshot.J_com @ solution.qdd + snapshot.drift_com
    expected = MODEL.mass * (a_com + np.array([0.0, 0.0, MODEL.gravity]))
    np.testing.assert_allclose(solution.forces.sum(axis=0), expected, atol=EXACT)


@pytest.mark.parametrize("backend", ["condensed", "full"])
def test_the_mirrored_robot_gets_the_mirrored_solution(backend: str) -> None:
    """PlaCo is left out: it loads the URDF itself, whose trunk is not symmetric."""
    symmetric = symmetric_model()
    controller = WholeBodyController(symmetric, backend)
    rng = np.random.default_rng(21)
    for index in range(52):
        state = random_state(rng)
        snapshot = symmetric.snapshot(state)
        reference = random_reference(snapshot, MODES[index % len(MODES)], 2.0, rng)
        here = controller.solve(snapshot, reference)
        image = symmetric.snapshot(mirrored_state(state))
        there = controller.solve(image, mirrored_reference(reference))
        np.testing.assert_allclose(there.tau, mirrored_joints(here.tau), atol=MIRRORED)
        np.testing.assert_allclose(there.forces, mirrored_feet(here.forces), atol=MIRRORED)


def pulled(reference: Reference, a_world: list[float]) -> Reference:
    return replace(reference, body=replace(reference.body, a_world=np.array(a_world)))


@pytest.mark.parametrize("backend", BACKENDS)
@pytest.mark.parametrize("direction", [[1.0, 0.0], [0.0, -1.0], [-0.6, 0.8]])
def test_a_body_that_is_asked_to_slide_stays_on_the_friction_pyramid(
    backend: str, direction: list[float]
) -> None:
    snapshot, reference = STAND
    demand = pulled(reference, [50.0 * direction[0], 50.0 * direction[1], 0.0])
    config = WbcConfig(friction=0.4)
    forces = WholeBodyController(MODEL, backend, config).solve(snapshot, demand).forces
    slack = config.friction * forces[:, 2:] - np.abs(forces[:, :2])
    assert (slack > -ACTIVE).all()
    assert (slack < ACTIVE).sum() >= 2
    assert forces.sum(axis=0)[:2] @ direction > 0.4 * MODEL.mass * MODEL.gravity


@pytest.mark.parametrize("backend", BACKENDS)
def test_a_body_that_is_asked_to_jump_stays_within_the_torques(backend: str) -> None:
    snapshot, reference = STAND
    demand = replace(pulled(reference, [0.0, 0.0, 100.0]), normal_force_max=np.full(4, 1e4))
    tau = WholeBodyController(MODEL, backend).solve(snapshot, demand).tau
    slack = MODEL.torque_limits - np.abs(tau)
    assert (slack > -ACTIVE).all()
    assert (slack < ACTIVE).any()


@pytest.mark.parametrize("share", [0.5, 0.8])
def test_a_share_of_the_torque_is_kept_as_asked(share: float) -> None:
    snapshot, reference = STAND
    demand = replace(pulled(reference, [0.0, 0.0, 100.0]), normal_force_max=np.full(4, 1e4))
    controller = WholeBodyController(MODEL, config=WbcConfig(torque_share=share))
    ratio = np.abs(controller.solve(snapshot, demand).tau) / MODEL.torque_limits
    assert ratio.max() == pytest.approx(share, abs=1e-6)


@pytest.mark.parametrize("backend", BACKENDS)
@pytest.mark.parametrize(("a_z", "bound"), [(50.0, "greatest"), (-50.0, "least")])
def test_normal_forces_stay_between_their_bounds(backend: str, a_z: float, bound: str) -> None:
    snapshot, reference = STAND
    least, greatest = np.array([5.0, 10.0, 15.0, 20.0]), np.array([60.0, 70.0, 80.0, 90.0])
    limited = replace(reference, normal_force_min=least, normal_force_max=greatest)
    solution = WholeBodyController(MODEL, backend).solve(snapshot, pulled(limited, [0, 0, a_z]))
    normal = solution.forces[:, 2]
    assert (normal >= least - ACTIVE).all()
    assert (normal <= greatest + ACTIVE).all()
    at_bound = np.abs(normal - (greatest if bound == "greatest" else least)) < ACTIVE
    assert at_bound.sum() >= 2


@pytest.mark.parametrize("backend", BACKENDS)
@pytest.mark.parametrize("side", [1.0, -1.0])
def test_a_joint_that_runs_towards_its_limit_is_decelerated(backend: str, side: float) -> None:
    controller = WholeBodyController(MODEL, backend)
    for joint in range(3):
        q, v = standing_q(), np.zeros(18)
        limit = (MODEL.q_upper if side > 0 else MODEL.q_lower)[joint]
        q[7 + joint] = limit - side * 0.05
        v[6 + joint] = side * 8.0  # more than the braking allows there: sqrt(2 200 0.05) = 4.5
        snapshot = MODEL.snapshot(state_of(q, v))
        outwards = np.zeros(12)
        outwards[joint] = side * 500.0
        demand = replace(holding_reference(snapshot, (JO, ST, ST, ST)), a_joints=outwards)
        slowed = controller.solve(snapshot, demand).qdd[6 + joint] * side
        expected = max((np.sqrt(2 * CONFIG.braking * 0.05) - 8.0) / CONFIG.limit_horizon, -200.0)
        assert slowed <= expected + ACTIVE
        assert slowed < 0.0


def test_the_joint_margin_moves_limits_inwards_and_a_residual_is_the_largest_error() -> None:
    margin = 0.07
    controller = WholeBodyController(MODEL, config=WbcConfig(joint_margin=margin))
    limits = controller.inequalities[-1]
    np.testing.assert_allclose(limits.q_upper, MODEL.q_upper - margin)  # pyright: ignore
    np.testing.assert_allclose(limits.q_lower, MODEL.q_lower + margin)  # pyright: ignore
    snapshot, reference = STAND
    solution = WholeBodyController(MODEL).solve(snapshot, pulled(reference, [50.0, 0.0, 0.0]))
    a_com = snapshot.J_com @ solution.qdd + snapshot.drift_com
    rows = {row.name: row.norm for row in solution.residuals}
    assert rows["body position"] == pytest.approx(np.abs(a_com - [50.0, 0.0, 0.0]).max())


@pytest.mark.parametrize("solver", SOLVERS)
@pytest.mark.parametrize("backend", ["condensed", "full"])
@pytest.mark.parametrize(
    ("least", "share", "named"),
    [(300.0, 1.0, "contact forces"), (100.0, 0.01, "torque limits")],
    ids=["least above greatest force", "impossible torque limit"],
)
def test_an_infeasible_problem_raises_with_a_table_of_every_block(
    solver: str, backend: str, least: float, share: float, named: str
) -> None:
    snapshot, reference = STAND
    config = WbcConfig(solver=solver, torque_share=share)
    demand = replace(reference, normal_force_min=np.full(4, least))
    with pytest.raises(QpInfeasible) as caught:
        WholeBodyController(MODEL, backend, config).solve(snapshot, demand)
    error = caught.value
    assert error.solver == solver
    assert [row.name for row in error.residuals] == NAMES
    assert all(row.name in str(error) and row.unit in str(error) for row in error.residuals)
    assert {row.name: row.norm for row in error.residuals}[named] > 1.0


@pytest.mark.parametrize("backend", BACKENDS)
def test_after_an_infeasible_tick_the_next_one_is_solved_as_ever(backend: str) -> None:
    snapshot, reference = STAND
    controller = WholeBodyController(MODEL, backend)
    before = controller.solve(snapshot, reference).tau
    with pytest.raises(QpInfeasible):
        controller.solve(snapshot, replace(reference, normal_force_max=np.zeros(4)))
    np.testing.assert_array_equal(controller.solve(snapshot, reference).tau, before)


def test_an_unknown_back_end_is_answered_with_the_valid_names() -> None:
    with pytest.raises(ConfigError, match="back end 'tsid'; valid: condensed, full, placo"):
        WholeBodyController(MODEL, "tsid")


@pytest.mark.parametrize("backend", ["condensed", "full"])
def test_an_unknown_solver_is_refused_before_the_first_tick(backend: str) -> None:
    with pytest.raises(SolverUnavailable, match="valid: active_set, daqp, proxqp, quadprog"):
        WholeBodyController(MODEL, backend, WbcConfig(solver="cplex"))


@pytest.mark.parametrize("backend", BACKENDS)
def test_the_residuals_of_a_solution_audit_it(backend: str) -> None:
    controller = WholeBodyController(MODEL, backend)
    for snapshot, reference in cases(MODEL, 13, seed=31):
        solution = controller.solve(snapshot, reference)
        rows = {row.name: row.norm for row in solution.residuals}
        assert list(rows) == NAMES
        for name in ("base dynamics", "stance feet"):
            assert rows[name] < EXACT
        for name in ("contact forces", "torque limits", "joint limits"):
            assert rows[name] < 1e-6
        if SW not in reference.legs:
            assert rows["swing feet"] == 0.0
        if JO not in reference.legs:
            assert rows["leg posture"] == 0.0


@pytest.mark.parametrize("legs", MODES)
def test_the_problem_knows_who_contributed_which_rows(legs: tuple) -> None:
    snapshot = MODEL.snapshot(random_state(np.random.default_rng(41)))
    controller = WholeBodyController(MODEL)
    problem = controller.formulate(snapshot, holding_reference(snapshot, legs))
    stance, swing, joints = legs.count(ST), legs.count(SW), legs.count(JO)
    assert [source.name for source in problem.sources] == NAMES
    assert problem.counts == (
        *(3, 3, 3 * swing, 3 * joints, 3 * stance),
        *(6, 3 * stance),
        *(5 * stance, 12, 12),
    )
    assert sum(problem.counts[:5]) == len(problem.tasks.b) == len(problem.weights)
    assert sum(problem.counts[5:7]) == len(problem.equalities.b)
    assert sum(problem.counts[7:]) == len(problem.bounds.lower)
    weight = CONFIG.orientation_weight if stance else CONFIG.flight_weight
    assert problem.weights[3] == weight


def test_a_solution_is_pure_torque_and_solving_repeats_exactly() -> None:
    controller = WholeBodyController(MODEL)
    snapshot, reference = next(cases(MODEL, 1, seed=51))
    before = [snapshot.mass_matrix.copy(), snapshot.bias.copy(), reference.p_world_feet.copy()]
    first, second = (controller.solve(snapshot, reference).tau for _ in range(2))
    np.testing.assert_array_equal(first, second)
    after = [snapshot.mass_matrix, snapshot.bias, reference.p_world_feet]
    for a, b in zip(before, after, strict=True):
        np.testing.assert_array_equal(a, b)
    solution = WholeBodyController(MODEL).solve(*STAND)
    np.testing.assert_array_equal(solution.command.tau, solution.tau_motors)
    assert not solution.command.kp.any()
    assert not solution.command.kd.any()
    assert solution.backend == "condensed"
    assert solution.solve_time >= 0.0
    assert STAND[1].legs == FOUR_FEET
