"""The back ends: physics, optimality and agreement on random problems in every contact mode."""

from collections.abc import Callable
from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from scipy.optimize import nnls

from go2_wbc.errors import QpInfeasible
from go2_wbc.legs import LEGS, Leg
from go2_wbc.reference import LegTask, Reference
from go2_wbc.robot.model import RobotModel
from go2_wbc.robot.state import Snapshot
from go2_wbc.wbc.backends import eliminate_equalities, solve_condensed, solve_full
from go2_wbc.wbc.condensed import SINGULAR_DETERMINANT
from go2_wbc.wbc.config import WbcConfig
from go2_wbc.wbc.controller import WbcSolution, WholeBodyController
from go2_wbc.wbc.problem import FORCES, Problem
from go2_wbc.wbc.solvers import SOLVERS
from tests.engine_helpers import (
    FOUR_FEET,
    MODES,
    cases,
    holding_reference,
    motion_error,
    random_state,
    standing,
    standing_q,
    state_of,
)

SPEED_SHARE = 0.15  # so low that the joint limits bind in some of the random states
CASES = 78  # six of every contact mode, two at each effort
MOTION_TOLERANCE = 1e-8  # [N, N m] rounding of a 158 N robot; measured 4e-10 (full, ProxQP)
EQUALITY_TOLERANCE = 1e-8  # [m/s^2, N, N m] of rows up to 1000; measured 6e-10 (full, ProxQP)
BOUND_TOLERANCE = 1e-8  # [N, N m, rad/s^2] how far a solver may leave a bound; measured 1e-9
TORQUE_AGREEMENT = 1e-5  # [N m] between any two; measured 1.4e-6 (ProxQP), 6e-9 (the others)
STATIONARITY = 1e-8  # of the gradient's part along free directions; measured 8e-10
ACTIVE = 1e-5  # [N, N m, rad/s^2] nearer than this to a bound is on it

PAIRS = [(backend, solver) for backend in ("condensed", "full") for solver in SOLVERS]
IDS = ["-".join(pair) for pair in PAIRS]


@cache
def model() -> RobotModel:
    return RobotModel()


def controller(backend: str = "condensed", solver: str = "daqp") -> WholeBodyController:
    config = WbcConfig(solver=solver, speed_share=SPEED_SHARE)
    return WholeBodyController(model(), backend, config)


@cache
def random_cases() -> list[tuple[Snapshot, Reference]]:
    return list(cases(model(), CASES, seed=11))


@cache
def solved(backend: str, solver: str) -> list[WbcSolution]:
    ours = controller(backend, solver)
    return [ours.solve(snapshot, reference) for snapshot, reference in random_cases()]


def problems() -> list[Problem]:
    return [controller().formulate(*case) for case in random_cases()]


def decision(solution: WbcSolution) -> np.ndarray:
    return np.concatenate([solution.qdd, solution.forces.ravel()])


@pytest.mark.parametrize(("backend", "solver"), PAIRS, ids=IDS)
def test_the_solution_obeys_the_equation_of_motion_with_an_unactuated_base(
    backend: str, solver: str
) -> None:
    """M qdd + h = S' tau + J' f in all 18 rows; no torque acts on the first six, no foot on air."""
    found = solved(backend, solver)
    for (snapshot, reference), solution in zip(random_cases(), found, strict=True):
        assert motion_error(snapshot, solution) < MOTION_TOLERANCE
        assert not solution.forces[~reference.stance].any()


def stationarity(problem: Problem, z: np.ndarray) -> float:
    """How much of the cost's gradient no multiplier can balance, relative to the gradient.

    Multipliers are found here, not taken from the solver: free ones for the equalities, by
    projecting on their null space, and non-negative ones for the active bounds (Lawson & Hanson).
    """
    unknown = np.concatenate([np.ones(18, dtype=bool), np.repeat(problem.stance, 3)])
    A, E, C = (
        rows[:, unknown] for rows in (problem.tasks.A, problem.equalities.A, problem.bounds.C)
    )
    error = problem.tasks.A @ z - problem.tasks.b
    gradient = A.T @ (problem.weights * error)
    free = np.linalg.svd(E)[2][np.linalg.matrix_rank(E) :].T
    value = problem.bounds.C @ z
    at_upper = problem.bounds.upper - value < ACTIVE
    at_lower = value - problem.bounds.lower < ACTIVE
    push = np.concatenate([C[at_upper], -C[at_lower]]) @ free
    wanted = -(free.T @ gradient)
    scale = max(1.0, float(np.linalg.norm(problem.weights * error)))
    if not len(push):
        return float(np.linalg.norm(wanted)) / scale
    return nnls(push.T, wanted)[1] / scale


@pytest.mark.parametrize(("backend", "solver"), PAIRS, ids=IDS)
def test_each_solution_meets_the_optimality_conditions(backend: str, solver: str) -> None:
    """Feasible; and the gradient is balanced by multipliers >= 0 of active bounds only."""
    for problem, solution in zip(problems(), solved(backend, solver), strict=True):
        z = decision(solution)
        equalities = problem.equalities
        np.testing.assert_allclose(equalities.A @ z, equalities.b, atol=EQUALITY_TOLERANCE)
        value = problem.bounds.C @ z
        assert (value <= problem.bounds.upper + BOUND_TOLERANCE).all()
        assert (value >= problem.bounds.lower - BOUND_TOLERANCE).all()
        assert stationarity(problem, z) < STATIONARITY


def test_the_optimality_check_notices_a_feasible_but_worse_answer() -> None:
    problem, solution = problems()[0], solved("condensed", "daqp")[0]
    reduction = eliminate_equalities(problem)
    assert reduction is not None
    worse = decision(solution) + reduction[0] @ np.full(12, 1e-2)
    np.testing.assert_allclose(problem.equalities.A @ worse, problem.equalities.b, atol=1e-6)
    assert stationarity(problem, worse) > 10 * STATIONARITY


def test_every_kind_of_bound_is_active_somewhere() -> None:
    """Or the conditions above would say nothing about that kind."""
    kinds = dict.fromkeys(("contact forces", "torque limits", "joint limits"), 0)
    for problem, solution in zip(problems(), solved("condensed", "daqp"), strict=True):
        value = problem.bounds.C @ decision(solution)
        distance = np.minimum(problem.bounds.upper - value, value - problem.bounds.lower)
        counts = problem.counts[-3:]
        pieces = np.split(distance, np.cumsum(counts)[:-1])
        for name, piece in zip(kinds, pieces, strict=True):
            kinds[name] += bool((piece < ACTIVE).any())
    assert min(kinds.values()) >= 3, kinds


@pytest.mark.parametrize(("backend", "solver"), PAIRS[1:], ids=IDS[1:])
def test_both_back_ends_and_all_solvers_find_the_same_torques(backend: str, solver: str) -> None:
    for first, other in zip(solved("condensed", "daqp"), solved(backend, solver), strict=True):
        np.testing.assert_allclose(other.tau, first.tau, atol=TORQUE_AGREEMENT, rtol=0)


@pytest.mark.parametrize("seed", range(3))
def test_every_u_meets_the_equalities(seed: int) -> None:
    rng = np.random.default_rng(seed)
    for problem in problems():
        reduction = eliminate_equalities(problem)
        assert reduction is not None
        Z, z0 = reduction
        z = Z @ rng.normal(scale=20.0, size=12) + z0
        E, e = problem.equalities
        np.testing.assert_allclose(E @ z, e, atol=EQUALITY_TOLERANCE)
        assert not z[FORCES].reshape(4, 3)[~problem.stance].any()


def test_nothing_that_meets_the_equalities_is_lost() -> None:
    """u has as many unknowns as the equalities leave free, and can be read off z."""
    for problem in problems():
        reduction = eliminate_equalities(problem)
        assert reduction is not None
        Z, _ = reduction
        stance = problem.stance
        free = 18 + 3 * int(stance.sum()) - len(problem.equalities.b)
        assert np.linalg.matrix_rank(Z) == free == 12
        for leg in LEGS:
            rows = slice(18 + 3 * leg, 21 + 3 * leg) if stance[leg] else leg.velocities
            np.testing.assert_array_equal(Z[rows], np.eye(12)[leg.joints])


def with_foot_level_with_its_hip(leg: Leg, offset: float) -> tuple[Snapshot, Reference]:
    """The foot at the height of the abduction axis: hip motion moves it in no direction."""
    q = standing_q()
    calf = -1.7
    q[7:][leg.joints] = [0.0, np.pi / 2 - calf / 2 + offset, calf]
    snapshot = model().snapshot(state_of(q))
    return snapshot, holding_reference(snapshot, FOUR_FEET)


def determinant(snapshot: Snapshot, leg: Leg) -> float:
    return abs(float(np.linalg.det(snapshot.J_contacts[leg][:, leg.velocities])))


@pytest.mark.parametrize("leg", LEGS)
def test_a_singular_stance_leg_is_solved_in_full(leg: Leg) -> None:
    # The contact lies below the foot, so the singular angle is a little beside the computed one.
    snapshot, reference = min(
        (with_foot_level_with_its_hip(leg, offset) for offset in np.linspace(-0.2, 0.2, 401)),
        key=lambda case: determinant(case[0], leg),
    )
    assert determinant(snapshot, leg) < SINGULAR_DETERMINANT
    problem = controller().formulate(snapshot, reference)
    assert eliminate_equalities(problem) is None
    np.testing.assert_array_equal(solve_condensed(problem, "daqp"), solve_full(problem, "daqp"))
    assert controller(solver="active_set").solve_compiled(snapshot, reference) is None
    lifted = tuple(LegTask.JOINTS if one is leg else LegTask.STANCE for one in LEGS)
    problem = controller().formulate(snapshot, replace(reference, legs=lifted))
    assert eliminate_equalities(problem) is not None


@pytest.mark.parametrize("solve", [solve_condensed, solve_full])
def test_what_cannot_be_is_told_with_the_residuals_of_the_best_without_bounds(
    solve: Callable[[Problem, str], np.ndarray],
) -> None:
    snapshot, reference = standing(model())
    least, most = np.full(4, 60.0), np.full(4, 9.0)
    broken = replace(reference, normal_force_min=least, normal_force_max=most)
    problem = controller().formulate(snapshot, broken)
    A, E, w = problem.tasks.A, problem.equalities.A, problem.weights
    K = np.block([[A.T @ (w[:, None] * A), E.T], [E, np.zeros((len(E), len(E)))]])
    right = np.concatenate([A.T @ (w * problem.tasks.b), problem.equalities.b])
    best = problem.residuals(np.linalg.lstsq(K, right, rcond=None)[0][: A.shape[1]])
    with pytest.raises(QpInfeasible) as caught:
        solve(problem, "daqp")
    for ours, theirs in zip(caught.value.residuals, best, strict=True):
        assert ours.norm == pytest.approx(theirs.norm, abs=1e-3), ours


@pytest.mark.parametrize("leg", LEGS)
def test_just_outside_the_singularity_both_forms_still_agree(leg: Leg) -> None:
    tested = 0
    for offset in np.linspace(-0.3, 0.3, 301):
        snapshot, reference = with_foot_level_with_its_hip(leg, offset)
        if not SINGULAR_DETERMINANT < determinant(snapshot, leg) < 3 * SINGULAR_DETERMINANT:
            continue
        problem = controller().formulate(snapshot, reference)
        assert eliminate_equalities(problem) is not None
        a, b = (controller(name).solve(snapshot, reference).tau for name in ("condensed", "full"))
        np.testing.assert_allclose(a, b, atol=TORQUE_AGREEMENT, rtol=0)
        tested += 1
    assert tested >= 3


def test_the_cases_go_through_every_contact_mode_far_from_the_singularity() -> None:
    rng = np.random.default_rng(9)
    for _ in range(50):
        snapshot = model().snapshot(random_state(rng))
        assert min(determinant(snapshot, leg) for leg in LEGS) > 20 * SINGULAR_DETERMINANT
    assert {reference.legs for _, reference in random_cases()} == set(MODES)
