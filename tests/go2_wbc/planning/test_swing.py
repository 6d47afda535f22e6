"""Swing feet: where they start, how high they go, where they land, and when they stand."""

from dataclasses import dataclass, replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from go2_wbc.contacts import GAITS, ContactPhase
from go2_wbc.planning.command import VelocityCommand
from go2_wbc.planning.gait_clock import WAITING, Clock
from go2_wbc.planning.ground import EARLIER
from go2_wbc.planning.locomotion import LocomotionConfig, LocomotionPlanner
from go2_wbc.planning.swing import (
    ABOVE,
    BEYOND,
    EARLIEST,
    FootContact,
    Swing,
    SwingConfig,
    follow_contact,
    loaded_time,
    swing_foot,
)
from go2_wbc.reference import SWING as SWINGS
from go2_wbc.reference import Reference
from tests import engine_helpers as helpers

EXACT = 1e-12  # rounding of numbers of order one
STEP = 1e-5  # [s] of the central differences
SLOPE_TOLERANCE = 1e-6  # [m/s] their error: step^2 times the third derivative; measured 4e-9
CURVATURE_TOLERANCE = 1e-4  # [m/s^2] rounding, 1e-16 / step^2; measured 3e-6
DURATION = 0.18
CONFIG = SwingConfig(apex=0.06, touchdown_depth=0.008)
LAST = 1.0 - 1e-12

coordinates = st.floats(-0.5, 0.5)
points = st.tuples(coordinates, coordinates, st.floats(-0.1, 0.1)).map(np.array)
TROT, TICK, RAMP = GAITS["trot"].schedule(), 0.002, 0.03
SWING = GAITS["trot"].swing_time


def swing(
    start: np.ndarray,
    goal: np.ndarray,
    progress: float,
    duration: float = DURATION,
    delay: float = 0.0,
    peak: float = 0.5,
    land: float | None = None,
) -> tuple[np.ndarray, ...]:
    begun = Swing(start=start, delay=delay, peak=peak)
    clock = Clock(period=2.0 * duration, duty=0.5)
    p, v, a = np.empty((3, 3))
    to = float(goal[2]) if land is None else land
    swing_foot(begun, clock, CONFIG, progress, goal, to, p, v, a)
    return p, v, a


@given(points, points)
def test_a_swing_starts_at_rest_where_the_foot_left_the_ground(
    start: np.ndarray, goal: np.ndarray
) -> None:
    p, v, _ = swing(start, goal, 0.0)
    np.testing.assert_allclose(p, start, atol=EXACT)
    np.testing.assert_allclose(v, 0.0, atol=EXACT)


@given(points, points)
def test_it_ends_at_rest_at_the_goal_a_little_below_the_ground_less_after_a_long_way(
    start: np.ndarray, goal: np.ndarray
) -> None:
    p, v, _ = swing(start, goal, LAST)
    way = np.linalg.norm((goal - start)[:2])
    depth = CONFIG.touchdown_depth if way <= 0.4 else CONFIG.touchdown_depth * 0.16 / way**2
    np.testing.assert_allclose(p, goal - [0.0, 0.0, depth], atol=1e-9)
    np.testing.assert_allclose(v, 0.0, atol=1e-9)


@given(points, points)
def test_it_passes_its_apex_half_way(start: np.ndarray, goal: np.ndarray) -> None:
    apex = max(start[2], goal[2]) + CONFIG.apex
    p, v, _ = swing(start, goal, 0.5)
    assert p[2] == pytest.approx(apex, abs=EXACT)
    assert v[2] == pytest.approx(0.0, abs=EXACT)
    np.testing.assert_allclose(p[:2], (start[:2] + goal[:2]) / 2, atol=EXACT)
    heights = [swing(start, goal, s)[0][2] for s in np.linspace(0.0, LAST, 41)]
    assert max(heights) <= apex + EXACT
    assert (np.diff(heights[:21]) > 0).all()
    assert (np.diff(heights[20:]) < 0).all()


@pytest.mark.parametrize(("rise", "fall"), [(0.2, 0.0), (-0.1, 0.0), (0.1, 0.07)])
def test_on_rough_ground_it_speeds_up_no_more_on_the_higher_of_its_ways(
    rise: float, fall: float
) -> None:
    start, goal = np.zeros(3), np.array([0.1, 0.0, rise])
    land, apex = rise - fall, max(rise, 0.0) + CONFIG.apex
    up, down = np.sqrt([apex, apex - land + CONFIG.touchdown_depth])
    peak = up / (up + down)
    lifts = swing(start, goal, 0.0, peak=0.0, land=land)[2][2]
    assert lifts == pytest.approx(6.0 * apex / (peak * DURATION) ** 2)
    for settled, progress, z in ((0.0, LAST, land - CONFIG.touchdown_depth), (peak, peak, apex)):
        p, v, _ = swing(start, goal, progress, peak=settled, land=land)
        assert p[2] == pytest.approx(z, abs=1e-9)
        assert v[2] == pytest.approx(0.0, abs=1e-9)
    falls = swing(start, goal, peak, peak=peak, land=land)[2][2]
    assert falls == pytest.approx(-lifts)


@pytest.mark.parametrize("seed", range(10))
def test_velocity_and_acceleration_are_the_derivatives_for_a_fixed_goal(seed: int) -> None:
    rng = np.random.default_rng(seed)
    start, goal = rng.uniform(-0.2, 0.2, size=(2, 3))
    for progress in (*rng.uniform(0.01, 0.49, size=5), *rng.uniform(0.51, 0.99, size=5)):
        before, now, after = (
            swing(start, goal, progress + d / DURATION) for d in (-STEP, 0.0, STEP)
        )
        slope = (after[0] - before[0]) / (2 * STEP)
        curvature = (after[0] - 2 * now[0] + before[0]) / STEP**2
        np.testing.assert_allclose(now[1], slope, atol=SLOPE_TOLERANCE)
        np.testing.assert_allclose(now[2], curvature, atol=CURVATURE_TOLERANCE)


def test_position_and_velocity_are_continuous_at_the_apex() -> None:
    start, goal = np.random.default_rng(2).uniform(-0.2, 0.2, size=(2, 3))
    before, after = swing(start, goal, 0.5 - 1e-12), swing(start, goal, 0.5)
    np.testing.assert_allclose(before[0], after[0], atol=1e-9)
    np.testing.assert_allclose(before[1], after[1], atol=1e-9)


@pytest.mark.parametrize("delay", [0.2, 0.7])
def test_a_foot_that_waits_rises_first_and_then_moves_as_any_other(delay: float) -> None:
    # On its way ahead at once it rubbed along the face of a step that it stood close to.
    start, goal = np.random.default_rng(3).uniform(-0.2, 0.2, size=(2, 3))
    span = (1.0 - delay) * DURATION
    for progress in np.linspace(0.0, LAST, 24):
        p, v, a = swing(start, goal, progress, delay=delay)
        at_once = swing(start, goal, progress)
        np.testing.assert_allclose([p[2], v[2], a[2]], [part[2] for part in at_once])
        if progress < delay:
            np.testing.assert_array_equal([*p[:2], *v[:2], *a[:2]], [*start[:2], 0, 0, 0, 0])
            continue
        later = swing(start, goal, (progress - delay) / (1.0 - delay), span)
        for found, expected in zip((p, v, a), later, strict=True):
            np.testing.assert_allclose(found[:2], expected[:2], atol=1e-9)


@pytest.mark.parametrize(("apex", "expected"), [(0.04, 0.04), (0.5, SwingConfig().apex)])
def test_a_gait_may_swing_lower_than_the_others_but_not_higher(
    apex: float, expected: float
) -> None:
    model, tick, trot = helpers.symmetric_model(), 0.002, GAITS["trot"]
    start = model.snapshot(helpers.state_of(helpers.standing_q()))
    planner = LocomotionPlanner(model, replace(trot, apex=apex), LocomotionConfig())
    planner.start(start)
    heights = []
    for n in range(round(trot.period / tick)):
        now = start.replaced(state=replace(start.state, time=n * tick))
        heights.append(planner.update(now, VelocityCommand(0.5)).p_world_feet[:, 2])
    rise = np.max(heights) - start.p_world_feet[:, 2].max()
    assert rise == pytest.approx(expected, abs=2e-3)


SLOWER = 1e-3  # m in a tick: the robot is to speed up more slowly from then on
STUMBLE = 44  # tick at 0.49 of the first swing, whose middle is far from both of its ends


def references(*, stumbles: bool) -> list[Reference]:
    """Those of a first swing of front left and rear right, in which one may meet something."""
    model, tick, trot = helpers.symmetric_model(), 0.002, GAITS["trot"]
    start = model.snapshot(helpers.state_of(helpers.standing_q()))
    planner, found = LocomotionPlanner(model, trot, LocomotionConfig()), []
    planner.start(start)
    for n in range(round(trot.swing_time / tick)):
        contact = np.array([stumbles and n == STUMBLE, True, True, False])
        state = replace(start.state, time=n * tick, feet_in_contact=contact)
        found.append(planner.update(start.replaced(state=state), VelocityCommand(0.5)))
    return found


def test_a_foot_that_stumbles_begins_anew_where_it_is_and_leaves_the_other_swing_alone() -> None:
    # The ground that it tells is rough, for which swings rise higher and go ahead later. The curve
    # of its partner jumped back by 5 cm on the way, and 35 of 60 robots fell over a step of 12 cm.
    calm, stumbling = references(stumbles=False), references(stumbles=True)
    start = helpers.symmetric_model().snapshot(helpers.state_of(helpers.standing_q()))
    ways = [[one.p_world_feet[3] for one in run] for run in (calm, stumbling)]
    np.testing.assert_allclose(np.diff(ways[1], axis=0), np.diff(ways[0], axis=0), atol=SLOWER)
    anew = stumbling[STUMBLE]
    assert not np.allclose(calm[STUMBLE].p_world_feet[0], start.p_world_feet[0], atol=0.02)
    np.testing.assert_allclose(anew.p_world_feet[0], start.p_world_feet[0], atol=EXACT)
    np.testing.assert_allclose(anew.v_world_feet[0], 0.0, atol=EXACT)
    a_while = STUMBLE + 8
    np.testing.assert_allclose(stumbling[a_while].p_world_feet[0, 0], start.p_world_feet[0, 0])
    assert stumbling[a_while].p_world_feet[0, 2] > start.p_world_feet[0, 2] + 0.01
    off = calm[-1].p_world_feet[0] - stumbling[-1].p_world_feet[0]
    np.testing.assert_allclose(off[1:], 0.0, atol=0.01)  # but for the last tick


def test_a_foot_that_was_stopped_rises_well_above_and_comes_down_well_beyond_that_place() -> None:
    # Led to the edge of the step that had stopped it, it slipped off and the trunk dropped.
    begun = helpers.symmetric_model().snapshot(helpers.state_of(helpers.standing_q()))
    place = begun.p_world_feet[0]
    feet = np.array([one.p_world_feet[0] for one in references(stumbles=True)[STUMBLE:]])
    left = 1.0 - STUMBLE * 0.002 / SWING
    most = left * (LocomotionConfig().swing.apex + ABOVE)
    assert feet[:, 2].max() - place[2] == pytest.approx(most, abs=0.01)
    assert feet[-1, 0] - place[0] == pytest.approx(BEYOND, abs=0.01)


def first_swing(slope: tuple[float, float], **ground: float) -> list[Reference]:
    """Those of the first swing of front left, ahead at 0.5 m/s, over a ground that is learnt so."""
    model, trot = helpers.symmetric_model(), GAITS["trot"]
    start = model.snapshot(helpers.state_of(helpers.standing_q()))
    planner, found = LocomotionPlanner(model, trot, LocomotionConfig()), []
    planner.start(start)
    planner._state.ground.slope[:] = slope
    for name, value in ground.items():
        setattr(planner._state.ground, name, value)
    planner._state.trunk.velocity[0] = 0.5
    for n in range(round(2.0 * trot.period / TICK)):
        now = start.replaced(state=replace(start.state, time=n * TICK))
        asked = planner.update(now, VelocityCommand(0.5))
        if asked.legs[0] != SWINGS:
            break
        found.append(asked)
    return found


@pytest.mark.parametrize(("climbed", "comes_from_above"), [(0.26, True), (0.14, False)])
def test_up_stairs_a_foot_is_above_its_place_before_it_comes_down(
    climbed: float, *, comes_from_above: bool
) -> None:
    # Feet that still went ahead met the face of the next step and slid down along it. After a
    # single step, as of a block, they do.
    low = helpers.symmetric_model().snapshot(helpers.state_of(helpers.standing_q()))
    low = low.p_world_feet[0, 2] - climbed
    run = first_swing((0.43, 0.0), rough_way=1.0, low=low)
    found = [one.v_world_feet[0] for one in run]
    last = np.array(found)[-round((EARLIER - 0.02) * len(found)) : -1]
    assert (last[:, 2] < -0.1).all()
    assert (last[:, 0] == 0.0).all() == comes_from_above


@pytest.mark.parametrize(("slope", "peak"), [(-0.35, 41), (0.35, 51), (-0.1, 47), (0.1, 47)])
def test_on_a_slope_a_foot_speeds_up_no_more_on_its_way_down_than_up(
    slope: float, peak: int
) -> None:
    # Feet that went down by 0.22 m in half of the time took the load off those that stood. Where it
    # is nearly level each way takes half of the swing, of 95 ticks.
    found = [one.p_world_feet[0, 2] for one in first_swing((slope, 0.0))]
    assert np.argmax(found) == pytest.approx(peak, abs=1)


HIGH = 0.05  # m of a foot above the ground when it may have come onto a step


def stopped(
    speed: float, *, presses: bool = False, own: float = 0.0
) -> tuple[list[Reference], float]:
    """A first swing of a robot told to go at ``speed``, in which a foot is stopped.

    It goes at its ``own`` [m/s].

    Returns its references from there on, and the time [s] at which the foot stands. If it
    ``presses`` it touches the step again, high above the ground, as soon as others may land.
    """
    model = helpers.symmetric_model()
    moving = np.array([own, *np.zeros(17)])
    start = model.snapshot(helpers.state_of(helpers.standing_q(), moving))
    planner, found = LocomotionPlanner(model, GAITS["trot"], LocomotionConfig()), []
    planner.start(start, friction=0.6)
    planner._state.ground.height -= HIGH
    for n in range(2 * round(SWING / TICK)):
        touches = n == STUMBLE or (presses and n * TICK >= EARLIEST * SWING)
        contact = np.array([touches, True, True, False])
        state = replace(start.state, time=n * TICK, feet_in_contact=contact)
        reference = planner.update(start.replaced(state=state), VelocityCommand(speed))
        if n > STUMBLE and reference.stance[0]:
            break
        if n > STUMBLE:
            found.append(reference)
    return found, (STUMBLE + 1 + len(found)) * TICK


def test_the_gait_waits_for_a_foot_that_is_stopped_while_the_robot_is_fast() -> None:
    # At 1 m/s it had 40 ms to rise, and was still below the edge as the others lifted.
    _, slow = stopped(0.5)
    ways, fast = stopped(1.0)
    rise = 0.5 * (SWING - STUMBLE * TICK)
    assert slow == pytest.approx(SWING, abs=0.015)  # a little more of the stride on rough ground
    assert fast - slow == pytest.approx(rise / WAITING - rise, abs=0.01)
    heights = np.array([one.p_world_feet[[0, 3], 2] for one in ways[:20]])
    speeds = np.array([one.v_world_feet[[0, 3], 2] for one in ways[1:19]])
    found = (heights[2:] - heights[:-2]) / (2.0 * TICK)
    assert np.median(found / speeds) == pytest.approx(1.0, abs=0.25)  # the form changes meanwhile


def test_a_face_that_a_foot_touches_as_it_rises_along_it_is_no_landing() -> None:
    _, landed = stopped(1.0, presses=True)
    begun = STUMBLE * TICK
    risen = begun + 0.5 * (SWING - begun) / WAITING
    assert landed == pytest.approx(risen + (EARLIEST - 0.5) * (SWING - begun), abs=0.01)


@pytest.mark.parametrize(("told", "own"), [(1.0, 0.3), (1.0, 2.0), (0.5, 0.3)])
def test_a_fast_robot_that_was_stopped_is_asked_for_the_speed_that_it_has_left(
    told: float, own: float
) -> None:
    asked = [one.body.v_world[0] for one in stopped(told, own=own)[0]]
    if told > LocomotionConfig().rough.speed and own < told:
        assert asked[9] == pytest.approx(own, abs=0.02)
        assert asked[-1] > own + 0.01  # it speeds up again as it goes on
    else:
        assert asked[9] > 0.4


@dataclass
class Feet:
    """The feet of a trot, and what is planned."""

    phase: ContactPhase
    feet: list[FootContact]
    stance: np.ndarray

    @property
    def load_share(self) -> np.ndarray:
        phase, times = self.phase, np.zeros(4)
        for leg, foot in enumerate(self.feet):
            planned, elapsed, left = phase.stance[leg], phase.elapsed[leg], phase.remaining[leg]
            times[leg] = loaded_time(foot, planned, elapsed, left)
        return np.where(self.stance, np.clip(times / RAMP, 0.0, 1.0), 0.0)


def feet(until: float, *, touching: bool, above: float) -> Feet:
    """The feet ``until`` seconds into a trot; at first front left and rear right swing."""
    found = Feet(TROT.at(0.0), [FootContact(since=np.inf) for _ in range(4)], np.ones(4, bool))
    for tick in range(1, round(until / TICK) + 1):
        found.phase = TROT.at(tick * TICK)
        for leg, foot in enumerate(found.feet):
            planned, progress = found.phase.stance[leg], found.phase.progress[leg]
            found.stance[leg] = follow_contact(foot, above, touching, planned, progress, TICK)
    return found


@pytest.mark.parametrize(
    ("touching", "above", "share"),
    [
        (True, 0.0, 0.9),
        (False, 0.05, 0.9),
        (True, 0.05, EARLIEST - 0.1),
        (False, 0.05, 1.05),
        (True, 0.0, 1.5),
    ],
    ids=["on the ground", "in the air", "too soon", "just landed", "the others' turn"],
)
def test_feet_stand_when_it_is_planned(touching: bool, above: float, share: float) -> None:
    contacts = feet(share * SWING, touching=touching, above=above)
    phase = contacts.phase
    assert not phase.stance.all()
    np.testing.assert_array_equal(contacts.stance, phase.stance)
    np.testing.assert_array_equal(contacts.load_share, phase.load_share(RAMP))


def test_a_foot_that_finds_a_step_late_in_its_swing_stands_from_then_on() -> None:
    contacts = feet(0.8 * SWING, touching=True, above=0.05)
    assert contacts.stance.all()
    begun = (0.8 - EARLIEST) * SWING
    share = contacts.load_share[~contacts.phase.stance]
    np.testing.assert_allclose(share, begun / RAMP, atol=2 * TICK / RAMP)


def test_a_foot_that_has_found_a_step_keeps_its_load_at_the_planned_touchdown() -> None:
    contacts = feet(SWING + TICK, touching=True, above=0.05)
    landed = ~TROT.at(0.5 * SWING).stance
    assert (contacts.load_share[landed] == 1.0).all()
    assert (contacts.phase.load_share(RAMP)[landed] < 0.2).all()
