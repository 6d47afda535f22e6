"""Coming to rest: on which feet a walk ends, where its trunk goes then, and why it does not."""

from collections.abc import Iterator
from itertools import pairwise

import numpy as np
import pytest

from go2_wbc.contacts import GAITS
from go2_wbc.geometry import support_margin
from go2_wbc.legs import LEGS
from go2_wbc.planning.command import ZERO_COMMAND, VelocityCommand
from go2_wbc.planning.locomotion import LocomotionPlanner
from go2_wbc.planning.rest import (
    PATIENCE,
    REST_MARGIN,
    REST_REACH,
    SHIFT,
    SHIFT_SPEED,
    capture_inside,
)
from go2_wbc.planning.walk import Walk
from go2_wbc.records import packed
from go2_wbc.robot.leg_kinematics import LegGeometry, leg_angles
from go2_wbc.robot.state import Snapshot
from tests.go2_wbc.planning.squared import CONFIG, MODEL, at, moving, resting

TROT = GAITS["trot"]
TICK = 0.002
HALF_STRIDE = round(TROT.period / 2 / TICK)
WALK = packed(Walk.of(MODEL, TROT, CONFIG))
EXACT = 1e-9  # rounding


def stepped(snapshot: Snapshot) -> tuple[LocomotionPlanner, int]:
    """A planner that has walked and stands like this since; ticks until it rests, 2 s at most."""
    planner = LocomotionPlanner(MODEL, TROT, CONFIG)
    planner.start(snapshot)
    planner.update(at(snapshot, TICK), VelocityCommand(0.002))
    for tick in range(2, 1000):
        planner.update(at(snapshot, tick * TICK), ZERO_COMMAND)
        if not planner.is_stepping:
            return planner, tick
    return planner, 1000


def beside(offset: float) -> Snapshot:
    """Two feet of a diagonal that stand beside their places, opposite ways."""
    start = resting()
    feet = start.p_world_feet.copy()
    feet[0, 0] += offset
    feet[3, 0] -= offset
    return start.replaced(p_world_feet=feet)


def test_a_square_robot_rests_at_its_first_landing() -> None:
    _, ticks = stepped(resting())
    assert ticks <= HALF_STRIDE + 2


def test_feet_that_step_does_not_bring_nearer_are_stood_on_after_a_few_landings() -> None:
    """Other people's robots came down 20 to 28 mm beside for ever: 22 of 60 stops failed."""
    _, ticks = stepped(beside(0.028))
    assert PATIENCE * HALF_STRIDE < ticks <= (PATIENCE + 1) * HALF_STRIDE + 2


def test_a_command_is_another_walk_with_its_own_patience() -> None:
    start = beside(0.028)
    planner = LocomotionPlanner(MODEL, TROT, CONFIG)
    planner.start(start)
    tick = 0
    for _ in range(2):
        for command, count in ((VelocityCommand(0.002), 1), (ZERO_COMMAND, 4 * HALF_STRIDE)):
            for _ in range(count):
                tick += 1
                planner.update(at(start, tick * TICK), command)
    assert planner.is_stepping


@pytest.mark.parametrize("speed", [0.1, 0.3])
def test_a_robot_that_drifts_steps_on_at_first_and_rests_where_its_feet_hold_it(
    speed: float,
) -> None:
    _, ticks = stepped(moving(resting(), np.array([speed, 0.0, 0.0])))
    assert PATIENCE * HALF_STRIDE < ticks < 1000


@pytest.mark.parametrize(
    ("snapshot", "reason"),
    [
        (beside(REST_REACH + 0.05), "a foot is 130 mm beside its place (at most 80)"),
        (moving(resting(), np.array([0.9, 0.0, 0.0])), "mm inside the feet (at least 50)"),
    ],
    ids=["feet", "speed"],
)
def test_it_steps_on_where_its_feet_do_not_hold_it_and_says_why(
    snapshot: Snapshot, reason: str
) -> None:
    planner, ticks = stepped(snapshot)
    assert ticks == 1000
    assert reason in planner.why_not_resting(snapshot)


def test_a_robot_that_rests_or_slows_down_says_so() -> None:
    start = resting()
    planner = LocomotionPlanner(MODEL, TROT, CONFIG)
    planner.start(start)
    assert planner.why_not_resting(start) == ""
    for tick in range(1, 100):
        planner.update(at(start, tick * TICK), VelocityCommand(0.5))
    planner.update(at(start, 100 * TICK), ZERO_COMMAND)
    assert planner.why_not_resting(start) == "it still slows down"


def test_the_capture_point_is_as_far_inside_the_feet_as_geometry_says() -> None:
    rng = np.random.default_rng(5)
    omega = np.sqrt(MODEL.gravity / WALK.height)
    for _ in range(50):
        start, v = resting(yaw=rng.uniform(-3.0, 3.0)), np.array([*rng.normal(size=2), 0.0])
        feet = start.p_world_feet + np.array([*rng.uniform(-0.05, 0.05, 2), 0.0])
        feet[:, :2] += rng.uniform(-0.05, 0.05, (4, 2))
        snapshot = moving(start.replaced(p_world_feet=feet), v)
        expected = support_margin(feet[:, :2], (snapshot.p_world_com + v / omega)[:2])
        found = capture_inside(snapshot, WALK)
        if expected > 0.0:
            assert found == pytest.approx(expected, abs=EXACT)
        else:
            assert found < EXACT


@pytest.mark.parametrize("leg", LEGS)
def test_legs_bear_every_stance_on_which_a_walk_may_end(leg: int) -> None:
    angle = np.linspace(0.0, 2.0 * np.pi, 60)
    for height in (0.26, 0.34):
        places = MODEL.p_base_feet_nominal[leg] + np.zeros((60, 3))
        places[:, :2] += (REST_REACH + SHIFT) * np.column_stack([np.cos(angle), np.sin(angle)])
        places[:, 2] = MODEL.foot_radius - height
        found = leg_angles(LegGeometry.of(MODEL, LEGS[leg]), places)
        joints = slice(3 * leg, 3 * leg + 3)
        assert np.all(found.q > MODEL.q_lower[joints])
        assert np.all(found.q < MODEL.q_upper[joints])


def references(offset: float, v: float, seconds: float) -> Iterator[np.ndarray]:
    """Where the trunk is wanted, tick by tick, of a robot that rests aside of its reference."""
    start = moving(resting(), np.array([0.0, v, 0.0]))
    planner, ticks = stepped(start.replaced(p_world_com=start.p_world_com + [0.0, offset, 0.0]))
    still = moving(start, np.zeros(3))
    for tick in range(ticks, ticks + round(seconds / TICK)):
        yield planner.update(at(still, tick * TICK), ZERO_COMMAND).body.p_world[:2]


def test_the_trunk_goes_slowly_to_where_it_shall_rest() -> None:
    """At rest it was pulled to the reference of the walk at 40 mm/s, after ``stop`` said True."""
    ways = list(references(0.0, 0.04, 4.0))
    assert ways[0][1] > 0.006  # where it comes to rest by itself
    steps = [np.linalg.norm(b - a) for a, b in pairwise(ways)]
    assert max(steps) <= SHIFT_SPEED * TICK + EXACT
    middle = resting().p_world_feet[:, :2].mean(axis=0)
    assert np.linalg.norm(ways[-1] - middle) < SHIFT + EXACT


def test_what_a_resting_robot_is_asked_stays_with_its_feet_when_the_estimate_moves() -> None:
    """Its trunk sank by 9 mm, at 20 mm/s, as its estimator learnt that it rests."""
    jump = np.array([0.004, -0.003, 0.009])
    start = resting()
    planner, ticks = stepped(start)
    before = planner.update(at(start, ticks * TICK), ZERO_COMMAND).body.p_world
    moved = start.replaced(
        p_world_feet=start.p_world_feet + jump, p_world_com=start.p_world_com + jump
    )
    after = planner.update(at(moved, (ticks + 1) * TICK), ZERO_COMMAND).body.p_world
    np.testing.assert_allclose(after - before, jump, atol=SHIFT_SPEED * TICK)


def test_margins_leave_room_for_a_square_stance() -> None:
    assert capture_inside(resting(), WALK) > 2.0 * REST_MARGIN
