"""What cannot be solved is refused alike by every back end, and what can be is answered.

Nothing here may hang, end in torques that are no numbers, or be noticed by one way and not another.
"""

import re
from dataclasses import dataclass, field, fields, replace
from typing import Any, cast

import numpy as np
import pytest

from go2_wbc.errors import CommandError, ConfigError, QpInfeasible
from go2_wbc.reference import BodyTarget, Reference
from go2_wbc.robot.model import RobotModel
from go2_wbc.robot.state import Snapshot
from go2_wbc.wbc.config import FORCE_WEIGHTS, GREATEST_GAIN, WEIGHTS, Gains, WbcConfig
from go2_wbc.wbc.controller import GREATEST_EXTRA_WEIGHT, WholeBodyController
from go2_wbc.wbc.problem import SIZE, Rows
from go2_wbc.wbc.tasks import Task
from tests.engine_helpers import (
    FOUR_FEET,
    JO,
    ST,
    SW,
    Legs,
    cases,
    motion_error,
    random_reference,
    random_state,
    standing,
)

AGREEMENT = 1e-4  # [N m] between two back ends; PlaCo's measured 1e-5
CORNER_AGREEMENT = 2e-3  # [N m] at the ends of the weights' ranges; measured 5e-4
ROUNDING = 1e-6  # [N, N m, m/s^2]
WITHOUT_BODY = WbcConfig(position_weight=0.0, orientation_weight=0.0)
NOT_FINITE = [np.nan, np.inf, -np.inf]
NOT_NUMBERS = "body", "legs", "stance", "_row"
PLACES = [
    *(("reference", f.name) for f in fields(Reference) if f.name not in NOT_NUMBERS),
    *(("reference.body", f.name) for f in fields(BodyTarget) if f.name != "point"),
    *(("snapshot", name) for name in Snapshot.part_names()[2:]),
    *(("snapshot.state", name) for name in ("q", "v")),
]


@dataclass(frozen=True, slots=True)
class OwnTask(Task):
    """A task of a user's own, right or wrong."""

    rows_given: Rows = field(default_factory=lambda: Rows(np.eye(1, SIZE, 6), np.zeros(1)))
    weight: float = 0.1
    name: str = "own"
    unit: str = "rad/s^2"

    def rows(self, snapshot: Snapshot, reference: Reference) -> Rows:
        return self.rows_given


MODEL = RobotModel()


@pytest.fixture(scope="module")
def ways() -> dict[str, WholeBodyController]:
    """Every way to an answer."""
    solvers = {name: WbcConfig(solver=name) for name in ("daqp", "quadprog", "proxqp")}
    return {
        "compiled": WholeBodyController(MODEL),
        **{name: WholeBodyController(MODEL, config=config) for name, config in solvers.items()},
        "full": WholeBodyController(MODEL, "full"),
        "full by daqp": WholeBodyController(MODEL, "full", solvers["daqp"]),
        "placo": WholeBodyController(MODEL, "placo"),
        "compiled with a task": WholeBodyController(MODEL, extra_tasks=[OwnTask()]),
        "daqp with a task": WholeBodyController(
            MODEL, config=solvers["daqp"], extra_tasks=[OwnTask()]
        ),
    }


Ways = dict[str, WholeBodyController]


def moving(legs: Legs = (ST, SW, JO, ST)) -> tuple[Snapshot, Reference]:
    rng = np.random.default_rng(0)
    snapshot = MODEL.snapshot(random_state(rng))
    return snapshot, random_reference(snapshot, legs, 2.0, rng)


def spoilt(array: np.ndarray | float, value: float) -> tuple[np.ndarray | float, str]:
    """A copy with ``value`` at one place, and that place as a message names it."""
    if isinstance(array, float):
        return value, f" is {value}"
    copy, index = np.array(array), np.size(array) // 2
    copy.ravel()[index] = value
    place = ", ".join(str(i) for i in np.unravel_index(index, copy.shape))
    return copy, f"[{place}] is {value}"


def expect_refusal(ways: Ways, case: tuple[Snapshot, Reference], message: str) -> None:
    for name, wbc in ways.items():
        assert wbc.solve_compiled(*case) is None, name
        for relax in (False, True):
            with pytest.raises(QpInfeasible, match=re.escape(message)):
                wbc.solve(*case, relax=relax)


@pytest.mark.parametrize("value", NOT_FINITE)
@pytest.mark.parametrize(("owner", "name"), PLACES, ids=[".".join(place) for place in PLACES])
def test_what_is_not_finite_is_refused_by_name(
    owner: str, name: str, value: float, ways: Ways
) -> None:
    """In arrays that no leg uses now, too: the next change of contacts would use them."""
    snapshot, reference = moving()
    held = {
        "reference": reference,
        "reference.body": reference.body,
        "snapshot": snapshot,
        "snapshot.state": snapshot.state,
    }[owner]
    array, place = spoilt(getattr(held, name), value)
    change: dict[str, Any] = {name: array}
    if owner == "snapshot.state":
        snapshot = MODEL.snapshot(replace(snapshot.state, **change))
    elif owner == "snapshot":
        snapshot = snapshot.replaced(**change)
    elif owner == "reference.body":
        reference = replace(reference, body=replace(reference.body, **change))
    else:
        reference = replace(reference, **change)
    if (name, value) in (("normal_force_min", -np.inf), ("normal_force_max", np.inf)):
        for wbc in ways.values():
            assert np.isfinite(wbc.solve(snapshot, reference, relax=True).tau).all()
    else:
        expect_refusal(ways, (snapshot, reference), f"{owner}.{name}{place}")


@pytest.mark.parametrize("size", [1e100, 1e300])
def test_a_goal_out_of_this_world_is_refused(size: float, ways: Ways) -> None:
    """Finite, but its squares are not: no solver may take what is left for a solution."""
    snapshot, reference = standing(MODEL)
    body = replace(reference.body, p_world=np.full(3, size))
    for name, wbc in ways.items():
        if name == "proxqp" and size < 1e200:
            continue  # it thinks about this one for a second before it gives up
        with pytest.raises(QpInfeasible):
            wbc.solve(snapshot, replace(reference, body=body), relax=True)


def test_a_target_that_is_no_rotation_is_refused(ways: Ways) -> None:
    snapshot, reference = standing(MODEL)
    body = replace(reference.body, R_world_base=np.zeros((3, 3)))
    expect_refusal(ways, (snapshot, replace(reference, body=body)), "rows of 'body orientation'")


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"normal_force_min": np.ones(1)}, "normal_force_min must have the shape (4,), got (1,)"),
        ({"normal_force_max": 1.0}, "normal_force_max must have the shape (4,), got ()"),
        ({"p_world_feet": np.zeros((3, 4))}, "p_world_feet must have the shape (4, 3)"),
        ({"a_joints": np.zeros(11)}, "a_joints must have the shape (12,), got (11,)"),
        ({"q_joints": ["a"] * 12}, "q_joints must hold numbers"),
        ({"q_joints": None}, "q_joints must have the shape (12,), got ()"),
        ({"legs": (ST, ST, ST)}, "legs must be four"),
        ({"legs": (0, 0, 0, 0)}, "legs must be four"),
        ({"legs": (ST, ST, ST, 9)}, "legs must be four"),
    ],
    ids=lambda value: next(iter(value)) if isinstance(value, dict) else "",
)
def test_another_shape_is_refused_by_name(
    changes: dict[str, object], message: str, ways: Ways
) -> None:
    """A single number in place of four would otherwise be taken for all four by one way only."""
    snapshot, reference = standing(MODEL)
    for wbc in ways.values():
        broken = unchecked(reference, changes)
        with pytest.raises(CommandError, match=re.escape(f"reference: {message}")):
            wbc.solve(snapshot, broken, relax=True)


def unchecked(reference: Reference, changes: dict[str, object]) -> Reference:
    """A copy with ``changes``, past the run-time check of types that only tests have."""
    copy = replace(reference)
    for name, value in changes.items():
        object.__setattr__(copy, name, value)
    return copy


def test_a_snapshot_of_another_shape_is_refused_by_name() -> None:
    snapshot, _ = standing(MODEL)
    with pytest.raises(CommandError, match=r"snapshot: bias must have the shape \(18,\)"):
        snapshot.replaced(bias=np.zeros(17))


@pytest.mark.parametrize(("least", "greatest"), [(60.0, 50.0), (-20.0, -5.0), (5.0, -5.0)])
def test_forces_that_no_ground_can_give_are_refused(
    least: float, greatest: float, ways: Ways
) -> None:
    """With the table of residuals, and by ``relax`` too: the ground never pulls."""
    snapshot, reference = standing(MODEL)
    broken = replace(
        reference, normal_force_min=np.full(4, least), normal_force_max=np.full(4, greatest)
    )
    for name, wbc in ways.items():
        assert wbc.solve_compiled(snapshot, broken) is None, name
        for relax in (False, True):
            with pytest.raises(QpInfeasible) as caught:
                wbc.solve(snapshot, broken, relax=relax)
            assert "contact forces" in {row.name for row in caught.value.residuals}, name


def test_a_negative_least_force_is_none(ways: Ways) -> None:
    snapshot, reference = standing(MODEL)
    free, below = (
        replace(reference, normal_force_min=np.full(4, least)) for least in (-np.inf, -30.0)
    )
    for wbc in ways.values():
        ours, theirs = wbc.solve(snapshot, free), wbc.solve(snapshot, below)
        np.testing.assert_allclose(ours.tau, theirs.tau, atol=ROUNDING, rtol=0)


@pytest.mark.parametrize("legs", [(SW, SW, SW, SW), (JO, JO, JO, JO), (SW, JO, SW, JO)])
def test_without_a_foot_on_the_ground_the_robot_falls_freely_and_its_legs_follow(
    legs: Legs, ways: Ways
) -> None:
    """The documented answer of flight; the legs' own motion turns the trunk, as in a cat."""
    snapshot, reference = moving(legs)
    torques = {}
    for name, wbc in ways.items():
        solution = wbc.solve(snapshot, reference)
        a_com = snapshot.J_com @ solution.qdd + snapshot.drift_com
        np.testing.assert_allclose(a_com, [0.0, 0.0, -MODEL.gravity], atol=ROUNDING)
        assert motion_error(snapshot, solution) < ROUNDING
        assert not solution.forces.any()
        if "task" not in name:
            torques[name] = solution.tau
    for tau in torques.values():
        np.testing.assert_allclose(tau, torques["compiled"], atol=AGREEMENT, rtol=0)
    alone = WholeBodyController(MODEL, config=WITHOUT_BODY).solve(snapshot, reference)
    rows = {row.name: row.norm for row in alone.residuals}
    assert rows["swing feet"] + rows["leg posture"] < ROUNDING, "no trunk to be turned by them"


@pytest.mark.parametrize("stance", range(4))
def test_one_foot_on_the_ground_is_answered_alike(stance: int, ways: Ways) -> None:
    legs = tuple(ST if leg == stance else SW for leg in range(4))
    snapshot, reference = moving(legs)
    solutions = {n: way.solve(snapshot, reference) for n, way in ways.items() if "task" not in n}
    for solution in solutions.values():
        np.testing.assert_allclose(solution.tau, solutions["compiled"].tau, atol=AGREEMENT, rtol=0)
        assert motion_error(snapshot, solution) < ROUNDING


WEIGHT_NAMES = ["position_weight", "orientation_weight", "swing_weight", "posture_weight"]
LEAST, GREATEST = WEIGHTS


@pytest.mark.parametrize("value", [*NOT_FINITE, -1.0, LEAST / 2, 2 * GREATEST, 1e12])
@pytest.mark.parametrize("name", [*WEIGHT_NAMES, "force_weight"])
def test_a_weight_that_leaves_no_accuracy_is_refused_when_it_is_set(
    name: str, value: float
) -> None:
    if name == "force_weight" and value == LEAST / 2:
        value = FORCE_WEIGHTS[0] / 2
    with pytest.raises(ConfigError, match=f"WbcConfig.{name} must be between"):
        replace(WbcConfig(), **{name: value})


def test_a_body_task_may_be_switched_off_but_a_leg_in_the_air_needs_a_goal(ways: Ways) -> None:
    for legs in (FOUR_FEET, (ST, SW, JO, ST), (SW, SW, SW, SW)):
        snapshot, reference = moving(legs)
        ours = WholeBodyController(MODEL, config=WITHOUT_BODY).solve(snapshot, reference)
        theirs = WholeBodyController(MODEL, "full", replace(WITHOUT_BODY, solver="daqp"))
        np.testing.assert_allclose(
            ours.tau, theirs.solve(snapshot, reference).tau, atol=AGREEMENT, rtol=0
        )
    for name in ("swing_weight", "posture_weight"):
        with pytest.raises(ConfigError, match=name):
            replace(WbcConfig(), **{name: 0.0})


@pytest.mark.parametrize("value", [*NOT_FINITE, -1.0, 2 * GREATEST_GAIN])
@pytest.mark.parametrize("place", ["kp", "kd"])
def test_a_gain_that_no_loop_could_follow_is_refused_when_it_is_set(
    place: str, value: float
) -> None:
    with pytest.raises(ConfigError, match=f"Gains.{place} must be between"):
        replace(Gains.uniform(1.0, 1.0), **{place: (1.0, value, 1.0)})


@pytest.mark.parametrize("low", [0, 1, 2])
def test_at_the_ends_of_the_weights_ranges_the_solvers_still_agree(low: int) -> None:
    """Beyond them one solver's success is 9 N m from another's."""
    weights = dict.fromkeys(WEIGHT_NAMES, GREATEST)
    weights.update(dict.fromkeys(WEIGHT_NAMES[low : low + 2], LEAST))
    config = replace(WbcConfig(), **weights, force_weight=FORCE_WEIGHTS[0])
    compiled = WholeBodyController(MODEL, config=config)
    others = [
        WholeBodyController(MODEL, "full", config),
        WholeBodyController(MODEL, config=replace(config, solver="daqp")),
    ]
    for snapshot, reference in cases(MODEL, 13, seed=6):
        try:
            tau = compiled.solve(snapshot, reference).tau
        except QpInfeasible:
            continue
        for other in others:
            theirs = other.solve(snapshot, reference).tau
            np.testing.assert_allclose(tau, theirs, atol=CORNER_AGREEMENT, rtol=0)


@pytest.mark.parametrize("weight", [*NOT_FINITE, -1.0, 2 * GREATEST_EXTRA_WEIGHT])
def test_a_task_of_ones_own_with_such_a_weight_is_refused(weight: float) -> None:
    with pytest.raises(ConfigError, match="weight of the task 'own' must be between 0 and"):
        WholeBodyController(MODEL, extra_tasks=[OwnTask(weight=weight)])


@pytest.mark.parametrize("solver", ["active_set", "daqp"])
@pytest.mark.parametrize(
    "shape", [((1, 12), (1,)), ((2, SIZE), (1,)), ((1, SIZE), (1, 1)), ((SIZE,), (1,))], ids=str
)
def test_a_task_of_ones_own_with_rows_of_another_shape_is_refused(
    solver: str, shape: tuple[tuple[int, ...], ...]
) -> None:
    rows = Rows(np.zeros(shape[0]), np.zeros(shape[1]))
    wbc = WholeBodyController(
        MODEL, config=WbcConfig(solver=solver), extra_tasks=[OwnTask(rows_given=rows)]
    )
    with pytest.raises(ConfigError, match="'own' has rows of the shapes"):
        wbc.solve(*standing(MODEL), relax=True)


@pytest.mark.parametrize(
    ("rows", "told"),
    [
        (None, "None"),
        ((np.zeros((1, SIZE)), np.zeros(1)), r"\(array\(\[\[0"),
        (Rows(np.full((1, SIZE), None), np.zeros(1)), r"Rows\(A=array\(\[\[None, None"),
        (Rows(np.zeros((1, SIZE)), np.zeros(1, complex)), r"Rows\(A=array\(\[\[0"),
        (Rows(cast("np.ndarray", [[1.0, 2.0], [3.0]]), np.zeros(2)), r"Rows\(A=\[\[1.0, 2.0\]"),
    ],
)
@pytest.mark.parametrize("solver", ["active_set", "proxqp"])
def test_a_task_of_ones_own_that_gives_no_rows_is_refused(
    solver: str, rows: object, told: str
) -> None:
    wbc = WholeBodyController(
        MODEL, config=WbcConfig(solver=solver), extra_tasks=[OwnTask(rows_given=cast("Rows", rows))]
    )
    with pytest.raises(ConfigError, match=rf"rows\(\) of 'own' must give Rows\(A, b\), got {told}"):
        wbc.solve(*standing(MODEL), relax=True)


@pytest.mark.parametrize("solver", ["active_set", "daqp", "quadprog", "proxqp"])
@pytest.mark.parametrize("part", ["A", "b"])
@pytest.mark.parametrize("value", [*NOT_FINITE, -1e101])
def test_a_task_of_ones_own_that_is_not_finite_is_refused_by_name(
    solver: str, part: str, value: float
) -> None:
    rows = Rows(np.zeros((2, SIZE)), np.zeros(2))
    getattr(rows, part)[1] = value
    wbc = WholeBodyController(
        MODEL, config=WbcConfig(solver=solver), extra_tasks=[OwnTask(rows_given=rows)]
    )
    expect_refusal({"own": wbc}, standing(MODEL), "the rows of 'own' are not finite")
