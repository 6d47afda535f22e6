"""An answer where the constraints contradict each other: physical, within the motors, nearest."""

from dataclasses import replace

import numpy as np
import pytest

from go2_wbc.errors import QpInfeasible
from go2_wbc.reference import Reference
from go2_wbc.robot.model import RobotModel
from go2_wbc.robot.state import Snapshot
from go2_wbc.wbc.config import WbcConfig
from go2_wbc.wbc.controller import WbcSolution, WholeBodyController
from go2_wbc.wbc.solvers import LIMITS, is_grave, solve_relaxed
from tests.engine_helpers import (
    MODES,
    motion_error,
    random_reference,
    random_state,
    standing,
    state_of,
)

MODEL = RobotModel()
ROUNDING = 1e-6  # [N, N m] of forces up to 250
HARD = ("base dynamics", "torque limits")
SOLVER_AGREEMENT = 1e-3  # [N m] between two solvers of a problem with weights 1e-4 to 100


def violation(solution: WbcSolution, name: str) -> float:
    return next(row.norm for row in solution.violations if row.name == name)


def battered(index: int) -> tuple[Snapshot, Reference]:
    """A robot in the middle of a tumble: fast joints, some at their stops, any contact mode."""
    rng = np.random.default_rng(index)
    state = random_state(rng, tilt=0.6)
    q, v = state.q.copy(), 6.0 * state.v
    at_stop = rng.random(12) < 0.2
    q[7:][at_stop] = np.where(rng.random(12) < 0.5, MODEL.q_lower, MODEL.q_upper)[at_stop]
    snapshot = MODEL.snapshot(state_of(q, v))
    return snapshot, random_reference(snapshot, MODES[index % len(MODES)], 15.0, rng)


def contradiction() -> tuple[Snapshot, Reference]:
    """A state in which stance feet, joint limits and forces leave no solution."""
    wbc = WholeBodyController(MODEL)
    battered_cases = (battered(index) for index in range(390))
    return next(c for c in battered_cases if wbc.solve(*c, relax=True).is_relaxed)


def test_a_tumbling_robot_always_gets_an_answer_that_physics_and_motors_allow() -> None:
    wbc = WholeBodyController(MODEL)
    relaxed = 0
    for index in range(390):
        snapshot, reference = battered(index)
        solution = wbc.solve(snapshot, reference, relax=True)
        relaxed += solution.is_relaxed
        assert np.isfinite(solution.tau).all()
        assert (np.abs(solution.tau) <= MODEL.torque_limits + ROUNDING).all()
        assert motion_error(snapshot, solution) < ROUNDING
        forces = solution.forces[reference.stance]
        assert (np.abs(forces[:, :2]) <= 0.6 * forces[:, 2:] + ROUNDING).all()
        assert (forces[:, 2] <= reference.normal_force_max[reference.stance] + ROUNDING).all()
    assert relaxed > 40, "or the test would say nothing"


@pytest.mark.parametrize("backend", ["condensed", "full"])
def test_a_contradiction_is_no_reason_to_give_up(backend: str) -> None:
    snapshot, reference = contradiction()
    wbc = WholeBodyController(MODEL, backend)
    with pytest.raises(QpInfeasible):
        wbc.solve(snapshot, reference)
    solution = wbc.solve(snapshot, reference, relax=True)
    assert solution.is_relaxed
    given_way = ("stance feet", "joint limits", "contact forces")
    assert max(violation(solution, name) for name in given_way) > 1.0
    assert max(violation(solution, name) for name in HARD) < ROUNDING


def test_a_solution_of_the_hard_problem_is_taken_and_a_robot_too_weak_to_stand_sinks() -> None:
    snapshot, reference = standing(MODEL)
    wbc = WholeBodyController(MODEL)
    relaxed = wbc.solve(snapshot, reference, relax=True)
    assert not relaxed.is_relaxed
    np.testing.assert_array_equal(relaxed.tau, wbc.solve(snapshot, reference).tau)
    assert max(row.norm for row in relaxed.violations) < ROUNDING
    wbc = WholeBodyController(MODEL, config=WbcConfig(torque_share=0.02))
    reference = replace(reference, normal_force_min=np.full(4, 30.0))
    solution = wbc.solve(snapshot, reference, relax=True)
    assert solution.is_relaxed
    assert (np.abs(solution.tau) <= 0.02 * MODEL.torque_limits + ROUNDING).all()


@pytest.mark.parametrize("solver", ["daqp", "quadprog"])
def test_other_solvers_find_the_same_relaxed_answer(solver: str) -> None:
    wbc = WholeBodyController(MODEL)
    compared = 0
    for index in range(130):
        case = battered(index)
        if not wbc.solve(*case, relax=True).is_relaxed:
            continue
        problem = wbc.formulate(*case)
        ours, theirs = (solve_relaxed(problem, name) for name in ("active_set", solver))
        first, second = (
            WbcSolution.from_decision(z, problem, 0.0, "full").tau for z in (ours, theirs)
        )
        np.testing.assert_allclose(first, second, atol=SOLVER_AGREEMENT, rtol=0)
        compared += 1
    assert compared > 10


def test_grave_is_what_lies_beyond_the_documented_limits() -> None:
    solution = WholeBodyController(MODEL).solve(*contradiction(), relax=True)
    for name, limit in LIMITS.items():
        rows = [replace(row, norm=0.0) for row in solution.violations]
        assert not is_grave(rows)
        for factor, grave in ((0.99, False), (1.01, True)):
            raised = [replace(r, norm=factor * limit) if r.name == name else r for r in rows]
            assert is_grave(raised) is grave
