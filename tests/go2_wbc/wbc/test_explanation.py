"""Multipliers and sensitivities against finite differences, and causes that are known."""

import pickle
from collections.abc import Callable, Iterator
from contextlib import closing
from dataclasses import dataclass, replace
from functools import cache

import numpy as np
import pytest

from controller import GO2Controller
from go2_wbc.brief import LONGEST
from go2_wbc.errors import QpInfeasible
from go2_wbc.legs import LEGS, Leg
from go2_wbc.plant import MujocoPlant
from go2_wbc.records import packed
from go2_wbc.reference import Reference
from go2_wbc.robot.model import RobotModel
from go2_wbc.robot.state import Snapshot
from go2_wbc.wbc.backends import dense_qp, eliminate_equalities, solve_condensed
from go2_wbc.wbc.config import WbcConfig
from go2_wbc.wbc.constraints import JointLimits
from go2_wbc.wbc.contact_prices import HASTY
from go2_wbc.wbc.controller import WbcSolution, WholeBodyController
from go2_wbc.wbc.explanation import BindingLimit, Explanation, Gain, _ranked, task_labels
from go2_wbc.wbc.limit_rows import places_of
from go2_wbc.wbc.problem import SIZE, Problem, Rows
from go2_wbc.wbc.solvers import DenseQp, solve_dense_qp
from go2_wbc.wbc.tasks import Task
from tests.engine_helpers import JO, ST, SW, standing
from tests.go2_wbc.wbc.situations import (
    JOINT_WORDS,
    KINDS,
    MODEL,
    PLAIN,
    Situation,
    contact_in_the_air,
    end_of_joint,
    force_cap,
    least_force,
    pressed,
    situations,
    slow_joint,
    weak_motor,
)

STEP = 1e-4  # of a bound, relative to 1 + |bound|; a cost is quadratic while the same rows bind
DIFFERENCES = 1e-3  # relative, of multipliers and gains
INDEPENDENT = 1e-5  # least singular value of the unit rows that bind
FINE = {"N": 1e-2, "N m": 1e-3, "rad/s": 1e-4, "rad": 1e-7}
"""What a user's limit is changed by: beside rounding much, of what is not linear little."""
TICKS = 500
Kind = Callable[[np.random.Generator], Iterator[Situation]]


@dataclass(frozen=True, slots=True)
class Still(Task):
    """A task of a user's own."""

    weight: float = 1.0
    name: str = "steady"
    unit: str = "rad/s^2"

    def rows(self, snapshot: Snapshot, reference: Reference) -> Rows:
        """Two rows: the angular acceleration about the trunk's first two axes."""
        return Rows(np.eye(2, SIZE, 3), np.zeros(2))


class Watched(WholeBodyController):
    """Keeps the ticks in which limits bind."""

    kept: list[tuple[Snapshot, Reference, WbcSolution]]

    def solve(
        self, snapshot: Snapshot, reference: Reference, *, relax: bool = False
    ) -> WbcSolution:
        """Solve it, and keep it if a limit binds."""
        solution = super().solve(snapshot, reference, relax=relax)
        if np.any(solution.multipliers.row) and not solution.is_relaxed:
            self.kept.append((snapshot, reference, solution))
        return solution


@cache
def ticks() -> list[tuple[Problem, np.ndarray]]:
    """Of a stand, a trot, turns, pushes and a high five: problems, multipliers of their rows."""
    with closing(MujocoPlant()) as plant, GO2Controller(plant=plant) as go2:
        loop = go2._runner.loop
        loop.wbc = watched = Watched(loop.model)
        loop._dynamic_wbc = loop.wbc
        watched.kept = []
        assert go2.stand()
        plant.push(np.array([150.0, 60.0, 0.0]), 0.2)
        go2.wait(0.5)
        go2.walk()
        for speed, turn, force in ((1.2, 0.0, 0.0), (0.0, 1.5, 150.0), (0.8, -1.0, -300.0)):
            go2.move(speed, turn)
            go2.wait(0.5)
            plant.push(np.array([force / 2, force, 0.0]), 0.1)
            go2.wait(0.6)
        go2.stop()
        assert go2.high_five(hold=0.5)
    chosen = np.linspace(0, len(watched.kept) - 1, TICKS).astype(int)
    assert len(set(chosen)) == TICKS, "or there are too few"
    found = list[tuple[Problem, np.ndarray]]()
    for snapshot, reference, solution in (watched.kept[k] for k in chosen):
        problem = watched.formulate(snapshot, reference)
        found.append((problem, solution.multipliers.row[places_of(problem)]))
    return found


def cost(problem: Problem, z: np.ndarray) -> float:
    return float(problem.weights @ (problem.tasks.A @ z - problem.tasks.b) ** 2) / 2


def moved(qp: DenseQp, row: int, y: float, step: float) -> DenseQp:
    """The side that binds is wider by ``step``."""
    lower, upper = qp.lower.copy(), qp.upper.copy()
    if y > 0:
        upper[row] += step
    else:
        lower[row] -= step
    return replace(qp, lower=lower, upper=upper)


def binding_rows(qp: DenseQp, x: np.ndarray) -> frozenset[int]:
    value, near = qp.C @ x, 1e-7 * (1.0 + np.abs(qp.C @ x))
    return frozenset(np.flatnonzero((value - qp.lower < near) | (qp.upper - value < near)).tolist())


def differences() -> Iterator[float]:
    """Relative errors of the multipliers, by another solver's optima."""
    for problem, y in ticks():
        reduction = eliminate_equalities(problem)
        assert reduction is not None
        qp, (Z, z0) = dense_qp(problem, *reduction), reduction
        active = np.flatnonzero(y)
        rows = qp.C[active] / np.linalg.norm(qp.C[active], axis=1, keepdims=True)
        if np.linalg.svd(rows, compute_uv=False).min() < INDEPENDENT:
            continue
        here = binding_rows(qp, solve_dense_qp(qp, "quadprog"))
        for row in active.tolist():
            bound = qp.upper[row] if y[row] > 0 else qp.lower[row]
            step = STEP * (1.0 + abs(float(bound)))
            both = [moved(qp, row, float(y[row]), side * step) for side in (-1.0, 1.0)]
            try:
                tight, wide = (solve_dense_qp(one, "quadprog") for one in both)
            except QpInfeasible:
                continue
            if binding_rows(both[0], tight) == here == binding_rows(both[1], wide):
                slope = (cost(problem, Z @ tight + z0) - cost(problem, Z @ wide + z0)) / (2 * step)
                yield abs(slope / abs(float(y[row])) - 1.0)


def test_multipliers_are_the_slope_of_the_optimal_cost() -> None:
    errors = np.array(list(differences()))
    assert len(errors) > TICKS
    assert errors.max() < DIFFERENCES


def wider_by(situation: Situation, limit: BindingLimit, step: float) -> Problem:
    """The problem with ``step`` [its unit] more of a limit, joints' where a user would put it."""
    problem = situation.wbc.formulate(situation.snapshot, situation.reference)
    what, subject = limit.name.split(" of ")
    is_upper, sign = limit.side == "upper", 1.0 if limit.side == "upper" else -1.0
    lower, upper = problem.bounds.lower.copy(), problem.bounds.upper.copy()
    if what.endswith("normal force"):
        place = 5 * Leg[subject] + 4
    else:
        place = 20 + JOINT_WORDS.index(subject)
    if what.endswith("normal force") or what == "torque limit":
        (row,) = np.flatnonzero(places_of(problem) == place)
        (upper if is_upper else lower)[row] += sign * step
    else:
        own = situation.wbc._numbers.constraints.joint
        numbers = {name: np.array(getattr(own, name)) for name in ("q_lower", "q_upper", "speed")}
        end = "q_upper" if is_upper else "q_lower"
        part = {"speed limit": "speed", "position limit": end}[what]
        numbers[part][place - 20] += step if part == "speed" else sign * step
        limits = packed(JointLimits(**numbers, braking=own.braking, horizon=own.horizon))
        _, lower[-12:], upper[-12:] = limits.bounds(situation.snapshot, situation.reference)
    return replace(problem, bounds=problem.bounds._replace(lower=lower, upper=upper))


def fall(values: list[float], step: float) -> float:
    """How fast a quadratic function falls at the first of three places ``step`` apart."""
    return (3.0 * values[0] - 4.0 * values[1] + values[2]) / (2.0 * step)


def errors_of(problem: Problem) -> np.ndarray:
    """Of every row of the tasks, at the optimum by another solver."""
    z = solve_condensed(problem, "daqp")
    return np.abs(problem.tasks.A @ z - problem.tasks.b)


@pytest.mark.parametrize("kind", [weak_motor, force_cap, least_force, slow_joint, end_of_joint])
def test_one_unit_more_of_a_users_limit_gives_what_is_told(kind: Kind) -> None:
    told = 0
    for situation in situations(kind, 8, seed=40):
        problem = situation.wbc.formulate(situation.snapshot, situation.reference)
        for limit in Explanation.of(problem).binding:
            if not limit.name.startswith(situation.causes) or "braking" in limit.name:
                continue
            step = min(0.1 * limit.reach, FINE[limit.unit])
            wider = [problem, *(wider_by(situation, limit, k * step) for k in (1, 2))]
            costs = [Explanation.of(one).cost for one in wider]
            np.testing.assert_allclose(fall(costs, step), limit.multiplier, rtol=DIFFERENCES)
            row = task_labels(problem).index((limit.gives.what, limit.gives.unit))
            errors = [errors_of(one)[row] for one in wider]
            np.testing.assert_allclose(errors[0], limit.gives.error, rtol=DIFFERENCES)
            np.testing.assert_allclose(fall(errors, step), limit.gives.amount, rtol=DIFFERENCES)
            told += 1
    assert told >= 5


@pytest.mark.parametrize(
    ("side", "at", "reach", "said"),
    [
        ("upper", 12.34, 9.0, "knee at 12 N m; 1 N m more gives 0.25 rad of pitch"),
        ("upper", -1.0, 1.0, "knee at -1 N m; 1 N m more gives 0.25 rad of pitch"),
        ("lower", 0.0, 0.5, "knee at 0 N m; 0.5 N m less gives 0.12 rad of pitch"),
        ("lower", 10.0, 0.0, "knee at 10 N m; 1 N m less gives 0.25 rad of pitch"),
        ("lower", -1.5, 2.0, "knee at -1.5 N m; 1 N m more gives 0.25 rad of pitch"),
    ],
)
def test_a_limit_says_what_a_unit_of_it_gives(
    side: str, at: float, reach: float, said: str
) -> None:
    gain = Gain("pitch", 0.25, 1.0, "rad")
    limit = BindingLimit("knee", side, at + 1e-9, at, "N m", 3.0, gain, reach, 2.0)
    assert str(limit) == said
    assert limit.slack == pytest.approx(1e-9)


def test_what_a_limit_costs_is_what_the_robot_without_it_saves() -> None:
    for situation in situations(weak_motor, 8, seed=41):
        found = situation.wbc.explain(situation.snapshot, situation.reference)
        limit = next(one for one in found.binding if one.name in situation.causes)
        sound = PLAIN.explain(situation.snapshot, situation.reference)
        assert not sound.binding
        np.testing.assert_allclose(limit.cost, found.cost - sound.cost, rtol=1e-6)


def test_the_same_limits_bind_as_far_as_is_told_and_no_farther() -> None:
    """So far the multiplier moves along a line."""
    checked = 0
    for situation in situations(weak_motor, 12, seed=42):
        problem = situation.wbc.formulate(situation.snapshot, situation.reference)
        limit = Explanation.of(problem).binding[0]
        if limit.name not in situation.causes or not np.isfinite(limit.reach):
            continue
        seen = list[float]()
        for share in (0.0, 0.5, 0.99, 1.1):
            found = Explanation.of(wider_by(situation, limit, share * limit.reach)).binding
            seen += [next((one.multiplier for one in found if one.name == limit.name), 0.0)]
        line = [seen[0] + share * 2 * (seen[1] - seen[0]) for share in (0.99, 1.1)]
        np.testing.assert_allclose(seen[2], line[0], atol=1e-6 * seen[0])
        assert abs(seen[3] - line[1]) > 1e-4 * seen[0]
        checked += 1
    assert checked >= 5


@pytest.mark.parametrize("backend", ["full", "condensed", "placo"])
def test_every_back_end_tells_the_multipliers_of_the_compiled_solve(backend: str) -> None:
    for situation in situations(force_cap, 6, seed=43):
        ours = situation.wbc.solve(situation.snapshot, situation.reference).multipliers
        config = replace(WbcConfig(), solver="quadprog")
        other = WholeBodyController(MODEL, backend, config)
        theirs = other.solve(situation.snapshot, situation.reference).multipliers
        np.testing.assert_allclose(theirs.row, ours.row, rtol=1e-5, atol=1e-8)
        assert np.count_nonzero(ours.row) > 0


def test_the_cause_that_was_made_is_named_first() -> None:
    """Of 50 at least 48; the seed is of no search of the rules."""
    per_kind = -(-50 // len(KINDS))
    made = [one for kind in KINDS for one in situations(kind, per_kind, seed=2026)][:50]
    wrong = list[str]()
    for situation in made:
        found = situation.wbc.explain(situation.snapshot, situation.reference)
        if not found.first.startswith(situation.causes):
            wrong.append(f"{situation.causes[0]}: {found}")
    assert len(made) == 50
    assert len(wrong) <= 2, "\n".join(wrong)


def test_a_contradiction_says_what_would_do_and_what_gave_way() -> None:
    many = situations(pressed, 40, seed=45)
    found = [(one, one.wbc.explain(one.snapshot, one.reference)) for one in many]
    infeasible = [(one, told.contradiction) for one, told in found if told.contradiction]
    assert len(infeasible) > 2
    named = sum(contradiction.name in one.causes for one, contradiction in infeasible)
    assert named >= len(infeasible) - 1
    for situation, contradiction in infeasible:
        (cause,) = situation.causes
        cures = [d for d in (contradiction.demand, *contradiction.others) if d is not None]
        demand = next(cure for cure in cures if cure.name == cause)
        joint = JOINT_WORDS.index(cause.removeprefix("torque limit of "))
        for share, is_cured in ((0.999, False), (1.001, True)):
            peak = np.array(situation.wbc._numbers.constraints.torque.motor.peak)
            peak[joint] = share * demand.needs
            model = RobotModel()
            model.motor = MODEL.motor.with_peak(peak)
            solved = WholeBodyController(model).solve(
                situation.snapshot, situation.reference, relax=True
            )
            assert solved.is_relaxed is not is_cured
        relaxed = situation.wbc.solve(situation.snapshot, situation.reference, relax=True)
        assert relaxed.explain() == Explanation(np.nan, (), contradiction)
        assert np.isfinite(relaxed.multipliers.row).all()
        assert any(what.startswith("least normal force") for what in contradiction.gave_way)
        assert f"{contradiction.name} contradicts the {contradiction.against}: needs" in repr(
            relaxed.explain()
        )


def test_a_least_force_above_the_greatest_is_explained_though_nothing_can_be_followed() -> None:
    snapshot, reference = standing(MODEL)
    crossed = replace(reference, normal_force_max=np.array([250.0, 3.0, 250.0, 250.0]))
    with pytest.raises(QpInfeasible):
        PLAIN.solve(snapshot, crossed, relax=True)
    found = PLAIN.explain(snapshot, crossed)
    assert found.first == "greatest normal force of FR"
    assert found.contradiction is not None
    assert found.contradiction.against == "least normal force of FR"
    assert found.contradiction.gave_way == ()


def test_a_foot_that_shall_stand_though_it_flies_is_a_limit() -> None:
    made = situations(contact_in_the_air, 12, seed=47)
    told = [one.wbc.explain(one.snapshot, one.reference) for one in made]
    feasible = [(one, why) for one, why in zip(made, told, strict=True) if why.binding]
    assert len(feasible) > 5
    for situation, why in feasible:
        contact = next(limit for limit in why.binding if limit.name in situation.causes)
        assert contact.unit == "m/s^2"
        assert contact.limit > HASTY
        assert 0.0 < contact.cost <= why.cost
    assert sum(why.first in one.causes for one, why in feasible) >= len(feasible) - 1


def contact_slope(problem: Problem, foot: int) -> float | None:
    """By how much the least cost falls for 1 m/s^2 less, by another solver; None across a kink."""
    E, e = problem.equalities.A, problem.equalities.b
    rows, step = slice(6 + 3 * foot, 9 + 3 * foot), 0.1
    costs, bound = list[float](), set[frozenset[int]]()
    Z = np.linalg.svd(E)[2][len(E) :].T
    for side in (1.0, -1.0):
        less = e.copy()
        less[rows] -= side * step * e[rows] / np.linalg.norm(e[rows])
        z0 = np.linalg.lstsq(E, less, rcond=None)[0]
        qp = dense_qp(problem, Z, z0)
        u = solve_dense_qp(qp, "quadprog")
        bound.add(binding_rows(qp, u))
        costs.append(cost(problem, Z @ u + z0))
    return (costs[1] - costs[0]) / (2 * step) if len(bound) == 1 else None


def test_what_a_contact_costs_is_the_slope_of_the_optimal_cost_in_the_record_too() -> None:
    """With a task of a user's own, too."""
    own = WholeBodyController(MODEL, extra_tasks=(Still(),))
    checked = 0
    for situation in situations(contact_in_the_air, 8, seed=50):
        for wbc in (PLAIN, own):
            snapshot, reference = situation.snapshot, situation.reference
            try:
                solution = wbc.solve(snapshot, reference)
            except QpInfeasible:
                continue
            problem, recorded = wbc.formulate(snapshot, reference), solution.multipliers.contacts
            told = {limit.name: limit for limit in solution.explain().binding}
            for foot in range(4):
                limit = told.get(f"contact of {LEGS[foot].name}")
                assert (recorded[foot] != 0.0) == (limit is not None)
                if limit is not None:
                    side = 1.0 if limit.side == "upper" else -1.0
                    np.testing.assert_allclose(recorded[foot], side * limit.multiplier, rtol=1e-6)
                    if (slope := contact_slope(problem, foot)) is not None:
                        np.testing.assert_allclose(-recorded[foot], slope, rtol=DIFFERENCES)
                        checked += 1
    assert checked >= 8


def test_of_limits_that_cost_about_as_much_the_most_unusual_comes_first() -> None:
    (situation,) = situations(weak_motor, 1, seed=46)
    limit = situation.wbc.explain(situation.snapshot, situation.reference).binding[0]
    costs = {"dearest": 10.0, "alike": 6.0, "odd": 5.5, "cheap": 4.0, "cheaper": 3.0}
    odd = {"alike": 0.1, "odd": 2.0, "cheaper": 9.0}
    found = [(replace(limit, name=n, cost=c), odd.get(n, 0.0)) for n, c in costs.items()]
    told = [one.name for one, _ in _ranked(found)]
    assert told == ["odd", "alike", "dearest", "cheap", "cheaper"]


def test_an_explanation_is_one_line_and_a_table() -> None:
    free = PLAIN.explain(*standing(MODEL))
    assert repr(free) == "<Explanation: no limit binds>"
    assert (free.first, free.binding, free.contradiction) == ("", (), None)
    for kind in KINDS:
        (situation,) = situations(kind, 1, seed=44)
        found = situation.wbc.explain(situation.snapshot, situation.reference)
        assert len(repr(found)) <= LONGEST
        assert found.first in repr(found)
        assert max(map(len, found.table().splitlines())) <= 110
        assert repr(pickle.loads(pickle.dumps(found))) == repr(found)
        assert all(
            limit.slack < 1e-6 * (1.0 + abs(limit.limit))
            for limit in found.binding
            if not limit.name.startswith("contact")
        )


def test_a_task_of_a_users_own_is_named_by_its_name() -> None:
    task = Still()
    wbc = WholeBodyController(MODEL, extra_tasks=[task])
    labels = task_labels(wbc.formulate(*standing(MODEL)))
    assert labels[-2:] == [("steady 1", "rad/s^2"), ("steady 2", "rad/s^2")]
    assert ("trunk height", "m/s^2") in labels


def test_the_joints_of_a_leg_that_is_raised_have_rows_and_its_foot_has_none() -> None:
    labels = task_labels(WholeBodyController(MODEL).formulate(*standing(MODEL, (ST, ST, SW, JO))))
    names = [name for name, _ in labels]
    assert [name for name in JOINT_WORDS if name in names] == list(JOINT_WORDS[9:])
    assert [name for name in names if "foot" in name] == [f"RL foot {axis}" for axis in "xyz"]
    forces = [name for name in names if "force" in name]
    assert forces == [f"{leg} force {axis}" for leg in ("FL", "FR") for axis in "xyz"]
