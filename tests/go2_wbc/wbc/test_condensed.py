"""The compiled QP against the full one, solved by daqp: same torques, refused where that is.

Both take their rows from ``tasks`` and ``constraints``, which are held to finite differences and
Pinocchio. What is proved here is the elimination, the cost, the bounds in the unknowns and the
active-set method.
"""

import inspect
from dataclasses import dataclass, replace

import numpy as np
import pytest

from go2_wbc.algebra.active_set import SOLVED, VIOLATION
from go2_wbc.reference import Reference, Target
from go2_wbc.robot.model import RobotModel
from go2_wbc.robot.rigid_body import Payload
from go2_wbc.robot.rotations import rotation_from_rpy
from go2_wbc.robot.state import Snapshot
from go2_wbc.wbc.condensed import Decision, Workspace, is_within, solve_tick
from go2_wbc.wbc.config import WbcConfig
from go2_wbc.wbc.controller import WholeBodyController
from go2_wbc.wbc.problem import SIZE, Rows
from go2_wbc.wbc.tasks import Gains, Task
from tests.engine_helpers import (
    cases,
    fast_cases,
    holding_reference,
    solved_alike,
    standing,
    standing_q,
    state_of,
    with_planned_forces,
)

AGREEMENT = 1e-6  # [N m] between two solvers; measured 2.3e-8
PLAIN = 1e-9  # [N, N m, rad/s^2] where the mathematical libraries differ; measured 0
PULL = 1.0  # [N] of the forces' regularisation on a robot at rest; measured 0.5, 0.06 N m
COUNT = 1040  # 80 of every contact mode
FAST_COUNT = 208  # 16 of every contact mode
SATURATING = WbcConfig(speed_share=0.15, torque_share=0.4)  # bounds bind in most states
ODD_NUMBERS = WbcConfig(
    body_position=Gains((31.0, 32.0, 33.0), (11.0, 12.0, 13.0)),
    body_orientation=Gains((101.0, 102.0, 103.0), (14.0, 15.0, 16.0)),
    swing_foot=Gains((201.0, 202.0, 203.0), (21.0, 22.0, 23.0)),
    leg_posture=Gains((301.0, 302.0, 303.0), (31.0, 32.0, 33.0)),
    position_weight=1.7,
    orientation_weight=3.1,
    swing_weight=0.7,
    flight_weight=0.19,
    posture_weight=1.3,
    force_weight=2e-4,
    friction=0.37,
    stance_damping=13.0,
    braking=170.0,
    limit_horizon=0.03,
    joint_margin=0.01,
)
"""No two numbers alike, so that one in another's place is seen."""


MODEL = RobotModel()


def both(config: WbcConfig | None = None) -> tuple[WholeBodyController, WholeBodyController]:
    """The compiled QP, and the full one, by daqp."""
    config = config or WbcConfig()
    full = WholeBodyController(MODEL, "full", replace(config, solver="daqp"))
    return WholeBodyController(MODEL, config=config), full


@pytest.mark.parametrize(
    "config", [WbcConfig(), SATURATING, ODD_NUMBERS], ids=["default", "saturating", "odd numbers"]
)
def test_torques_are_those_of_the_full_problem(config: WbcConfig) -> None:
    count = 0
    for *_, ours, theirs in solved_alike(*both(config), cases(MODEL, COUNT, seed=21), AGREEMENT):
        np.testing.assert_allclose(ours.forces, theirs.forces, atol=1e-4, rtol=0)
        np.testing.assert_allclose(ours.qdd, theirs.qdd, atol=1e-4, rtol=0)
        count += 1
    assert count > 3 * COUNT / 4


def test_planned_forces_are_kept_near_as_in_the_full_problem() -> None:
    rng, (compiled, full), moved = np.random.default_rng(27), both(), 0
    plain = list(cases(MODEL, 104, seed=26))
    planned = [(snapshot, with_planned_forces(reference, rng)) for snapshot, reference in plain]
    for snapshot, reference, ours, _ in solved_alike(compiled, full, planned, AGREEMENT):
        without = compiled.solve_compiled(
            snapshot, replace(reference, force_weight=0.0, orientation_discount=0.0)
        )
        moved += without is not None and np.abs(ours.forces - without.forces).max() > 1.0
    assert moved > 50


def test_a_payload_is_carried_as_in_the_full_problem() -> None:
    carried = Payload(4.0, (0.05, 0.08, 0.1))
    loaded = ((MODEL.snapshot(s.state, carried), r) for s, r in cases(MODEL, 104, seed=29))
    assert len(list(solved_alike(*both(), loaded, AGREEMENT))) > 50


@pytest.mark.parametrize("backend", ["condensed", "full"])
def test_a_robot_that_stands_with_a_payload_bears_both_weights(backend: str) -> None:
    carried = Payload(4.0, (0.05, 0.08, 0.0))
    snapshot = MODEL.snapshot(state_of(standing_q()), carried)
    solution = WholeBodyController(MODEL, backend).solve(snapshot, holding_reference(snapshot))
    weight = (MODEL.mass + carried.mass) * MODEL.gravity
    assert solution.forces.sum(axis=0) == pytest.approx([0.0, 0.0, weight], abs=PULL)
    contacts = snapshot.p_world_feet - snapshot.p_world_com
    moment = np.cross(contacts, solution.forces).sum(axis=0)
    assert moment == pytest.approx(np.zeros(3), abs=0.1 * PULL)


def test_planned_forces_keep_within_the_cone_as_in_the_full_problem() -> None:
    """On a pyramid's diagonal feet with little load slid 15 mm after a landing."""
    rng, beyond = np.random.default_rng(31), 0
    config = WbcConfig(friction=0.2, keeps_cone=True)
    square = WholeBodyController(MODEL, config=replace(config, keeps_cone=False))
    planned = ((s, with_planned_forces(r, rng)) for s, r in cases(MODEL, 104, seed=30))
    for snapshot, reference, ours, _ in solved_alike(*both(config), planned, AGREEMENT):
        wider = square.solve_compiled(snapshot, reference)
        assert wider is not None
        excess = [np.hypot(*f.T[:2]) - 0.2 * f[:, 2] for f in (ours.forces, wider.forces)]
        assert excess[0].max() < 1e-4
        beyond += bool(excess[1].max() > 1.0)
    assert beyond > 20


def test_less_friction_that_a_reference_asks_for_is_kept_and_more_is_not_believed() -> None:
    (compiled, full), bound = both(), 0
    slippery = ((s, replace(r, friction=0.2)) for s, r in cases(MODEL, 52, seed=29))
    for snapshot, reference, ours, _ in solved_alike(compiled, full, slippery, AGREEMENT):
        believed, without = (
            compiled.solve_compiled(snapshot, replace(reference, friction=mu)) for mu in (0.9, 0.0)
        )
        assert believed is not None
        assert without is not None
        np.testing.assert_array_equal(believed.tau, without.tau)
        sideways = np.abs(ours.forces[:, :2]).max(axis=1)
        assert (sideways <= 0.2 * ours.forces[:, 2] + 1e-4).all()
        bound += bool(np.abs(ours.tau - without.tau).max() > 1e-2)
    assert bound > 20


@pytest.mark.parametrize("share", [1.0, 0.4])
def test_torques_of_fast_joints_keep_to_the_motors_line(share: float) -> None:
    config, motor = WbcConfig(torque_share=share), MODEL.motor.scaled(share)
    blind = WholeBodyController(RobotModel(motor="ideal"), config=config)
    count, on_the_line, blindly_beyond = 0, 0, 0
    fast = fast_cases(MODEL, FAST_COUNT, seed=25)
    for snapshot, reference, ours, _ in solved_alike(*both(config), fast, AGREEMENT):
        lower, upper = motor.limits(snapshot.state.joint_velocities)
        other = blind.solve_compiled(snapshot, reference)
        assert other is not None
        excess = np.maximum(other.tau - upper, lower - other.tau)
        blindly_beyond += int(excess.max() > AGREEMENT)
        excess = np.maximum(ours.tau - upper, lower - ours.tau)
        assert excess.max() < AGREEMENT
        is_cut = np.where(ours.tau < 0.0, -lower, upper) < motor.peak
        on_the_line += int((is_cut & (excess > -AGREEMENT)).any())
        count += 1
    assert count > 7 * FAST_COUNT / 8
    assert on_the_line > FAST_COUNT / 12
    assert blindly_beyond > FAST_COUNT / 12


@dataclass(frozen=True, slots=True)
class SpreadFeet(Task):
    """Pull the forces of the front feet apart: rows in every column of z."""

    weight: float = 0.3
    name: str = "spread"
    unit: str = "N"

    def rows(self, snapshot: Snapshot, reference: Reference) -> Rows:
        A = np.random.default_rng(1).normal(size=(4, SIZE))
        return Rows(A, np.array([1.0, -2.0, 3.0, 4.0]))


def test_tasks_of_a_users_own_are_condensed_along() -> None:
    compiled, full = (
        WholeBodyController(MODEL, name, WbcConfig(solver=solver), extra_tasks=[SpreadFeet()] * 2)
        for name, solver in (("condensed", "active_set"), ("full", "daqp"))
    )
    found = list(solved_alike(compiled, full, cases(MODEL, 52, seed=22), AGREEMENT))
    assert len(found) > 40
    for *_, ours, theirs in found:
        assert [row.name for row in ours.residuals] == [row.name for row in theirs.residuals]


def test_torques_are_inverse_dynamics_and_residuals_those_of_the_readable_problem() -> None:
    wbc = WholeBodyController(MODEL)
    for snapshot, reference in cases(MODEL, 52, seed=28):
        solution = wbc.solve_compiled(snapshot, reference)
        if solution is None:
            continue
        state = snapshot.state
        needed = MODEL.inverse_dynamics(state.q, state.v, solution.qdd)
        pushed = np.einsum("fai,fa->i", snapshot.J_contacts, solution.forces)
        np.testing.assert_allclose(needed - pushed, [*np.zeros(6), *solution.tau], atol=1e-8)
    for snapshot, reference in cases(MODEL, 26, seed=23):
        solution = wbc.solve(snapshot, reference)
        z = np.concatenate([solution.qdd, solution.forces.ravel()])
        assert solution.residuals == wbc.formulate(snapshot, reference).residuals(z)


def test_a_tick_leaves_nothing_to_the_next() -> None:
    """The workspace is kept from tick to tick: what a tick with other legs left is not used."""
    kept = WholeBodyController(MODEL, config=SATURATING)
    for snapshot, reference in cases(MODEL, 52, seed=34):
        fresh = WholeBodyController(MODEL, config=SATURATING)
        ours, theirs = (wbc.solve_compiled(snapshot, reference) for wbc in (kept, fresh))
        assert (ours is None) == (theirs is None)
        if ours is not None and theirs is not None:
            np.testing.assert_array_equal(ours.tau, theirs.tau)


@pytest.mark.parametrize("config", [SATURATING, ODD_NUMBERS], ids=["saturating", "odd numbers"])
def test_the_python_that_is_compiled_gives_the_same(config: WbcConfig) -> None:
    rng = np.random.default_rng(36)
    wbc, plain_solve = WholeBodyController(MODEL, config=config), inspect.unwrap(solve_tick)
    rows = np.ascontiguousarray(rng.normal(size=(2, SIZE + 2)))
    for snapshot, plain in cases(MODEL, 13, seed=35):
        reference = with_planned_forces(plain, rng) if rng.random() < 0.5 else plain
        target, found, expected = Target.of(reference.row), Decision(), Decision()
        given = snapshot, target, wbc._numbers, rows
        outcome = solve_tick(*given, Workspace(), expected)
        with np.errstate(all="ignore"):
            assert plain_solve(*given, Workspace(), found) == outcome
        if outcome == SOLVED:
            np.testing.assert_allclose(found.row, expected.row, atol=PLAIN, rtol=0)


@pytest.mark.parametrize("bound", [-30.0, -0.5, 0.0, 0.5, 30.0])
def test_a_bound_counts_as_met_by_the_active_sets_tolerance(bound: float) -> None:
    """Stricter, a tick would go the long way for nothing; laxer, it would end beyond its bounds."""
    slack = VIOLATION * (1.0 + abs(bound))
    for off, expected in ((0.0, True), (0.9 * slack, True), (1.1 * slack, False)):
        assert is_within(bound + off, bound - 1.0, bound) is expected
        assert is_within(bound - off, bound, bound + 1.0) is expected
    assert not is_within(bound, bound + slack, bound - slack), "no bounds at all"
    assert not is_within(np.nan, -np.inf, np.inf)


@pytest.mark.parametrize("angle", [2.9, 3.05, np.pi])
def test_a_trunk_turned_over_is_solved_as_by_the_readable_form(angle: float) -> None:
    """The logarithm of a rotation near pi is left to Pinocchio's."""
    snapshot, reference = standing(MODEL)
    body = replace(reference.body, R_world_base=rotation_from_rpy(0.0, 0.0, angle))
    case = snapshot, replace(reference, body=body)
    assert list(solved_alike(*both(), [case], AGREEMENT))


@pytest.mark.parametrize("solver", ["daqp", "proxqp", "quadprog"])
def test_a_named_solver_is_the_one_that_solves(solver: str) -> None:
    wbc = WholeBodyController(MODEL, config=WbcConfig(solver=solver))
    assert not wbc.is_compiled
    assert WholeBodyController(MODEL).is_compiled
