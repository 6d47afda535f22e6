"""Planes, ways, footholds and swings on terrains that are known exactly."""

import math
from typing import Any

import numpy as np
import pytest

from go2_wbc.contacts import GAITS
from go2_wbc.planning.command import VelocityCommand
from go2_wbc.planning.ground import Ground
from go2_wbc.planning.height_map import CELL, HeightMap, cells
from go2_wbc.planning.locomotion import LocomotionConfig, LocomotionPlanner
from go2_wbc.planning.sight import (
    AGAIN,
    DROP,
    FAR,
    FLIGHT_SPEED,
    LIFT,
    RISE,
    SPEED,
    STOP,
    Sight,
    fitted_plane,
    steps_by_sight,
    way_ahead,
)
from go2_wbc.planning.sighted_steps import (
    BEHIND,
    CLEARANCE,
    HIGHER,
    LANDED,
    LANDS,
    NEAR,
    NEAR_ENOUGH,
    OVER,
    POINTS,
    STEP,
    WAIT,
    WAITS,
    calf_miss,
    choose,
    edge_cost,
    height_to_land,
    hip_of,
    shape,
    swing_by_sight,
)
from go2_wbc.plant.terrain import DOWN, Blocks, Gap, Ramp, Slope, Stairs, Stones, Terrain
from go2_wbc.reference import SWING
from go2_wbc.robot.model import RobotModel
from go2_wbc.robot.state import Snapshot
from tests.engine_helpers import standing_q, state_of
from tests.go2_wbc.planning.seen import exact_map, true_heights

MODEL, CONFIG = RobotModel(), LocomotionConfig()
FOOT = MODEL.foot_radius
AHEAD = (1.0, 0.0, 0.9)
EXACT = 1e-9  # rounding


@pytest.mark.parametrize(
    ("terrain", "ends"),
    [
        (None, 0.0),
        (Blocks(0.6, start=0.9), RISE),
        (Stairs(0.30, start=0.9), RISE),
        (Stairs(0.20, 6, 0.31, start=0.5), 0.0),
        (Stairs(0.20, 6, 0.31, start=0.5, way=DOWN), 0.0),
        (Stairs(0.30, 1, 0.31, start=0.7, way=DOWN), DROP),
        (Gap(0.30, start=0.6), 0.0),
        (Gap(0.60, start=0.6), DROP),
        (Ramp(0.6, start=0.5), 0.0),
        (Stones(start=0.4), 0.0),
    ],
    ids=str,
)
def test_a_way_ends_in_front_of_what_is_too_high_too_deep_or_too_wide(
    terrain: Terrain | None, ends: float
) -> None:
    what, end = way_ahead(exact_map(terrain), 0.0, 0.0, AHEAD, 0.0)
    assert what == ends
    if ends and terrain is not None:
        start: float = getattr(terrain, "start")  # noqa: B009  # every one of these has it
        assert end == pytest.approx(start, abs=0.06)


def level(*, aside: float = 0.35) -> HeightMap:
    """A map of known ground at 0."""
    heights = exact_map(None, aside=aside)
    heights.height[:] = 0.0
    return heights


def raised(
    heights: HeightMap, by: float, x: tuple[float, float], y: tuple[float, float]
) -> HeightMap:
    """With the known cells raised whose middles lie between these; nan: they are unknown."""
    known, middle = heights.name != 0.0, cells(heights)
    is_there = (middle[:, 0] > x[0]) & (middle[:, 0] < x[1])
    is_there &= (middle[:, 1] > y[0]) & (middle[:, 1] < y[1])
    heights.height[known] += np.where(is_there, by, 0.0)
    heights.name[np.isnan(heights.height)] = 0.0
    return heights


@pytest.mark.parametrize("left", [-0.3, -0.15, 0.0, 0.15, 0.3])
def test_a_post_ends_the_way_of_the_trunk_and_of_the_feet_and_none_beside_them(left: float) -> None:
    heights = raised(level(aside=0.5), 0.4, (0.7, 0.8), (left - 0.03, left + 0.03))
    what, end = way_ahead(heights, 0.0, 0.0, AHEAD, 0.0)
    assert (what, end) == ((RISE, pytest.approx(0.7)) if abs(left) < 0.2 else (0.0, FAR))


@pytest.mark.parametrize("yaw", [0.0, 2.0])
def test_the_plane_of_even_ground_is_found_wherever_the_robot_is(yaw: float) -> None:
    """A pit leaves it as it is."""
    heights, slope, at = level(aside=1.0), np.array([0.5, -0.3]), np.array([0.4, 0.2])
    heights.height[heights.name != 0.0] = cells(heights)[:, :2] @ slope
    raised(heights, -1.0, (0.3, 0.4), (0.0, 0.1))
    feet = np.zeros((4, 3))
    feet[:, :2] = at + [[0.2, 0.1], [0.2, -0.1], [-0.2, 0.1], [-0.2, -0.1]]
    feet[:, 2] = FOOT + feet[:, :2] @ slope
    ground, plane = Ground(p_met=feet), np.zeros(3)
    assert fitted_plane(ground, heights, at[0], at[1], yaw, FOOT, plane)
    np.testing.assert_allclose(plane, [at @ slope, *slope], atol=0.01)
    assert not fitted_plane(ground, heights, 2.4, 2.2, yaw, FOOT, plane)


@pytest.mark.parametrize(
    ("height", "cells_off", "distance"),
    [
        (0.0, 1, NEAR_ENOUGH),
        (STEP, 1, NEAR_ENOUGH),  # no edge yet
        (-STEP, 1, NEAR_ENOUGH),
        (1.01 * STEP, 1, CELL + HIGHER),
        (-1.01 * STEP, 1, CELL),
        (-1.01 * STEP, 3, 3.0 * CELL),
        (math.nan, 2, 2.0 * CELL),
        (1.01 * STEP, 3, NEAR_ENOUGH),
    ],
)
@pytest.mark.parametrize("way", [(1, 0), (-1, 0), (0, 1), (0, -1)])
def test_an_edge_costs_by_its_distance_and_a_step_by_its_height(
    height: float, cells_off: int, distance: float, way: tuple[int, int]
) -> None:
    here = 0.5 * CELL
    (x, y), off = (here + CELL * cells_off * np.array(way)).tolist(), 0.01
    heights = raised(level(), height, (x - off, x + off), (y - off, y + off))
    near, spread = edge_cost(heights, here, here, 0.0)
    assert near == pytest.approx(((NEAR_ENOUGH - distance) / (NEAR_ENOUGH - NEAR)) ** 2)
    assert spread == (abs(height) if abs(height) <= STEP else 0.0)


@pytest.mark.parametrize("seed", range(4))
def test_the_calf_lies_between_the_foot_and_a_knee_that_both_links_reach(seed: int) -> None:
    rng, ground = np.random.default_rng(seed), level()
    walk = planner(ground)._walk
    d, phi, yaw = rng.uniform(0.15, 0.4), rng.uniform(1.0, 2.1), rng.uniform(-3.0, 3.0)
    ahead, along = (math.cos(yaw), math.sin(yaw)), d * math.cos(phi)
    foot = (0.1, 0.0, 0.05)
    hip = (foot[0] + along * ahead[0], foot[1] + along * ahead[1], foot[2] + d * math.sin(phi))
    knee = foot[2] + walk.link * math.sin(phi + math.acos(0.5 * d / walk.link))  # it is behind
    lowest = foot[2] + (knee - foot[2]) / POINTS
    for height, missing in ((0.3, 0.3 + CLEARANCE - lowest), (lowest - CLEARANCE - 0.01, 0.0)):
        ground.shift = height
        assert calf_miss(ground, hip, foot, ahead, 0.0, walk) == pytest.approx(missing)


@pytest.mark.parametrize(
    ("x", "z", "above"), [(0.0, 0.31, 0.01), (0.0, 0.31 + LANDS, 0.0), (9.0, 0.31, 0.0)]
)
def test_a_foot_lands_near_the_map_only(x: float, z: float, above: float) -> None:
    heights = level()
    heights.shift = 0.3
    assert height_to_land(heights, x, 0.0, z) == pytest.approx(above)


def swinging(heights: HeightMap) -> tuple[LocomotionPlanner, Any]:
    """A planner whose front left foot swings ahead by 0.31 m, and the foot."""
    walking = planner(heights)
    foot, y = walking._state.feet[0], MODEL.p_base_feet_nominal[0, 1]
    foot.swing.start[:], foot.step.goal[:] = (0.0, y, FOOT), (0.31, y, FOOT)
    foot.step.chosen[:], foot.step.is_sighted, foot.step.end = foot.step.goal, True, LANDED
    return walking, foot


@pytest.mark.parametrize(
    ("wall", "from_above", "begin", "end"),
    [
        ((2.0, 2.1), 0.0, 0.0, LANDED),
        ((0.02, 0.06), 0.0, (WAITS - 1) * WAIT, LANDED),
        ((0.24, 0.28), 0.1, 0.0, LANDED - WAITS * WAIT),
    ],
    ids=["none", "before the foot", "before its goal, which is lower"],
)
def test_a_foot_rises_before_it_goes_over_a_wall_and_is_over_it_before_it_comes_down(
    wall: tuple[float, float], from_above: float, begin: float, end: float
) -> None:
    heights = raised(level(), 0.15, wall, (-1.0, 1.0))
    walking, foot = swinging(heights)
    foot.swing.start[2] += from_above
    q = standing_q(0.3)
    q[0] = 0.35  # so far ahead that no calf comes near the wall
    now = MODEL.snapshot(state_of(q))
    shape(0, now, walking._state, walking._walk, heights, (0.0, 0.4))
    assert (foot.step.begin, foot.step.end) == pytest.approx((begin, end))


@pytest.mark.parametrize(("elapsed", "moved"), [(0.1, 0.05), (0.2, 0.05), (0.23, 0.025)])
def test_a_foothold_moves_the_less_the_later_it_is(elapsed: float, moved: float) -> None:
    """The blind one is 0.1 m farther: half of the way costs least, if it may be gone."""
    heights, rows = level(), np.zeros((3, 3))
    walking, foot = swinging(heights)
    before, spans = foot.step.goal.copy(), (elapsed, 0.4 - elapsed)
    blind = before + [0.1, 0.0, 0.0]
    walk, state = walking._walk, walking._state
    swing_by_sight(0, standing(), state, walk, heights, spans, blind, 0.0, *rows)
    np.testing.assert_allclose(foot.step.chosen - before, [moved, 0.0, 0.0], atol=EXACT)


@pytest.mark.parametrize("y", [-0.05, 0.0, 0.04, 0.1])
def test_pits_that_are_hardly_seen_between_stones_do_not_end_a_way(y: float) -> None:
    heights = exact_map(Stones(start=0.25), aside=0.6)
    x = np.round((heights.name - 0.5) / 2.0**20) * 0.025
    is_hidden = np.random.default_rng(0).random(x.shape) < 0.85
    heights.name[(heights.height < -0.1) & (x > 0.35) & is_hidden] = 0.0
    for yaw in (-0.063, 0.0, 0.063):
        what, _ = way_ahead(heights, 0.0, y, (math.cos(yaw), math.sin(yaw), 0.9), 0.0)
        assert what == 0.0


def standing(height: float = 0.3) -> Snapshot:
    state = state_of(standing_q(height))
    state.feet_in_contact[:] = True
    return MODEL.snapshot(state)


def planner(heights: HeightMap) -> LocomotionPlanner:
    made = LocomotionPlanner(MODEL, GAITS["trot"], CONFIG, heights)
    made.start(standing(), 0.6)
    return made


@pytest.mark.parametrize("angle", [-0.3, 0.0, 0.2, 0.38])
def test_the_trunk_follows_a_slope_before_a_foot_has_met_it(angle: float) -> None:
    """All feet still stand on a level: the map alone knows of the slope."""
    heights = exact_map(None)
    known = heights.name != 0.0
    x = np.round((heights.name[known] - 0.5) / 2.0**20) * 0.025
    heights.height[known] += math.tan(angle) * x
    walking = planner(heights)
    now = standing()
    for n in range(200):
        state = state_of(now.state.q, time=0.002 * n)
        state.feet_in_contact[:] = True
        walking.update(MODEL.snapshot(state), VelocityCommand())
    slope = walking._state.ground.slope
    np.testing.assert_allclose(
        slope, [math.tan(angle), 0.0], atol=0.1 * abs(math.tan(angle)) + 0.01
    )


def test_between_two_looks_the_plane_is_carried_along_with_the_robot() -> None:
    """A height that is 20 ms old would be 8 mm off."""
    walking, looks, before = planner(exact_map(Slope(0.38))), 0, 0.0
    q, v = standing_q(), np.zeros(18)
    v[0], v[2] = 1.0, math.tan(0.38)
    for n in range(200):
        q[:3] = standing_q()[:3] + 0.002 * n * v[:3]
        walking.update(MODEL.snapshot(state_of(q, v, 0.002 * n)), VelocityCommand(0.5))
        height, slope = walking.sight.plane[:2]
        if walking.sight.since == 0.0:
            looks += 1
        else:
            assert height - before == pytest.approx(0.002 * slope)
        assert slope == pytest.approx(math.tan(0.38), abs=0.03)
        before = height
    assert looks == round(200 * 0.002 / AGAIN)


@pytest.mark.parametrize(
    ("terrain", "most"),
    [
        (None, 0.8),
        (Slope(0.3), 0.8),
        (Blocks(0.10, start=0.6, count=1), SPEED),
        (Stairs(0.16, 6, 0.31, start=0.4), FLIGHT_SPEED),
        (Blocks(0.5, start=STOP + 0.05), 0.22),
        (Blocks(0.5, start=STOP - 0.10), 0.0),
    ],
    ids=str,
)
def test_the_speed_is_what_the_ground_ahead_permits(terrain: Terrain | None, most: float) -> None:
    walking, command = planner(exact_map(terrain)), VelocityCommand(0.8)
    for n in range(1, 600):
        state = state_of(standing_q(), time=0.002 * n)
        walking.update(MODEL.snapshot(state), command)
    assert walking.velocity[0] == pytest.approx(most, abs=0.06)
    assert walking.sight.is_slowed == (most < 0.8)
    assert bool(walking.sight.why_blocked) == (most == 0.0)


@pytest.mark.parametrize("start", np.linspace(0.10, 0.40, 7))
@pytest.mark.parametrize("kind", ["up", "down", "gap"])
def test_feet_are_put_beside_edges_and_swing_over_them(start: float, kind: str) -> None:
    terrain: Terrain = {
        "up": Stairs(0.16, 4, 0.31, start=start + 0.05),
        "down": Stairs(0.16, 4, 0.31, start=start + 0.25, way=DOWN),
        "gap": Gap(0.15, start=start + 0.15),
    }[kind]
    heights = exact_map(terrain)
    walking, command, landed, swung = planner(heights), VelocityCommand(0.3), 0, 0
    walking._state.ground.p_met[:, 2] = FOOT
    q = standing_q(0.30)
    for n in range(1, 900):
        v = np.zeros(18)
        v[0], q[0] = 0.3, 0.3 * 0.002 * n - 0.3
        reference = walking.update(MODEL.snapshot(state_of(q, v, 0.002 * n)), command)
        for leg in range(4):
            step = walking._state.feet[leg].step
            if reference.legs[leg] != SWING or not step.is_sighted:
                continue
            p, swing = reference.p_world_feet[leg], walking._state.feet[leg].swing
            ends = np.array([swing.start[:2], step.goal[:2]])
            is_on_ground = swing.start[2] > true_heights(terrain, swing.start[None, :2])[0]
            if is_on_ground and np.linalg.norm(p[:2] - ends, axis=1).min() > 0.04:
                below = true_heights(terrain, p[None, :2])[0]
                assert p[2] - FOOT > below + 0.5 * OVER
                swung += 1
            if n % 50 == 0:
                landed += 1
                assert distance_to_edge(terrain, step.chosen) > NEAR - 0.015
    assert landed > 10
    assert swung > 100


@pytest.mark.parametrize(("gone_on", "waits"), [(0.02, True), (0.06, True), (0.12, False)])
@pytest.mark.parametrize("leg", [0, 2])
def test_a_foot_waits_on_a_high_step_until_its_hip_has_gone_on(
    leg: int, gone_on: float, waits: bool
) -> None:
    """The hip is 21 cm over the step: if it is no farther, the calf comes down on the edge."""
    edge, hip = 0.20, MODEL.p_base_hips[leg]
    heights = exact_map(Stairs(0.20, 1, 0.31, start=edge, way=DOWN))
    walking, q = planner(heights), standing_q(0.21)
    state = walking._state
    state.trunk.velocity[0] = 0.3
    q[0] = edge + gone_on - 0.3 * 0.25 - hip[0]  # touchdown is in 0.25 s
    state.feet[leg].swing.start[:] = edge - 0.05, 1.7 * hip[1], FOOT
    blind = np.array([edge + gone_on + 0.04, 1.7 * hip[1], FOOT - 0.1])
    now = MODEL.snapshot(state_of(q))
    choose(leg, now, state, walking._walk, heights, (0.0, 0.25), blind, math.inf)
    assert (state.feet[leg].step.chosen[0] < edge) == waits


@pytest.mark.parametrize("beyond", [0.15, 0.17])
@pytest.mark.parametrize("leg", [0, 2])
def test_the_calf_passes_the_edge_of_the_step_that_its_foot_comes_down_from(
    leg: int, beyond: float
) -> None:
    """It lay on the edge of a block; the foot hung above the ground, and the robot fell."""
    edge, speed, duration, y = 0.20, 0.43, 0.25, 1.7 * MODEL.p_base_hips[leg][1]
    heights = exact_map(Stairs(0.20, 1, 0.31, start=edge, way=DOWN))
    walking, q = planner(heights), standing_q(0.25)
    q[0] = edge + 0.06 - speed * duration - MODEL.p_base_hips[leg][0]
    state, now = walking._state, MODEL.snapshot(state_of(q))
    step, state.trunk.velocity[0] = state.feet[leg].step, speed
    state.feet[leg].swing.start[:] = edge - 0.10, y, FOOT
    step.chosen[:] = step.goal[:] = edge + beyond, y, FOOT - 0.20
    step.is_sighted, step.next = True, math.inf
    shape(leg, now, state, walking._walk, heights, (0.0, duration))
    hip, rooms = np.array(hip_of(leg, now, walking._walk)), []
    for elapsed in np.arange(0.0, duration, 0.01).tolist():
        spans, rows = (elapsed, duration - elapsed), np.zeros((3, 3))
        swing_by_sight(leg, now, state, walking._walk, heights, spans, step.chosen, 0.0, *rows)
        to_hip = hip + [speed * elapsed, 0.0, 0.0] - rows[0]
        rooms.append(room_at_calf(to_hip[[0, 2]], np.array([edge, 0.0]) - rows[0][[0, 2]]))
    assert min(rooms) > 0.016  # a calf is 1.2 cm thick to either side


@pytest.mark.parametrize("height", [0.21, 0.25])
def test_no_edge_lies_between_the_points_of_a_calf_that_are_looked_at(height: float) -> None:
    """Of three points none was near the edge of a block that the calf lay on."""
    heights = exact_map(Stairs(0.20, 1, 0.31, start=0.2, way=DOWN))
    hip, near = (0.25, 0.0, height), 0
    walk = planner(heights)._walk
    for beyond in np.arange(0.06, 0.20, 0.01).tolist():
        for lowered in (1 / 3, 0.5, 2 / 3):
            foot = (0.2 + beyond, 0.0, FOOT - 0.2 * lowered)
            x, _, z = np.subtract(hip, foot).tolist()
            if room_at_calf(np.array([x, z]), np.array([-beyond, -foot[2]])) < 0.02:
                assert calf_miss(heights, hip, foot, (1.0, 0.0), BEHIND, walk) > 0.02
                near += 1
    assert near > 10


def room_at_calf(to_hip: np.ndarray, to_edge: np.ndarray) -> float:
    """How far [m] behind a calf's axis an edge is; hip and edge from the foot, ahead and up."""
    far, link = float(np.linalg.norm(to_hip)), 0.213
    bend = math.sqrt(max(link**2 - 0.25 * far**2, 0.0)) / far
    knee = 0.5 * to_hip + bend * np.array([-to_hip[1], to_hip[0]])
    along, aside = knee @ to_edge / link, (knee[0] * to_edge[1] - knee[1] * to_edge[0]) / link
    return float(aside) if 0.0 < along < link else math.inf


@pytest.mark.parametrize("speed", [-0.2, 0.0, 0.2])
def test_the_calf_has_room_behind_the_foot_whichever_way_the_robot_walks(speed: float) -> None:
    """All knees bend back, to the step behind the foot, also of one that steps in place."""
    edge, hip = 0.20, MODEL.p_base_hips[0]
    heights = exact_map(Stairs(0.12, 1, 0.31, start=edge, way=DOWN))
    walking, q = planner(heights), standing_q(0.28 - 0.12)
    state, step = walking._state, walking._state.feet[0].step
    state.trunk.velocity[0] = speed
    blind = np.array([edge + 0.09, 1.7 * hip[1], FOOT - 0.12])
    q[0] = blind[0] - hip[0] - 0.25 * speed  # touchdown is in 0.25 s
    state.feet[0].swing.start[:] = blind
    choose(
        0, MODEL.snapshot(state_of(q)), state, walking._walk, heights, (0.0, 0.25), blind, math.inf
    )
    assert step.chosen[0] > blind[0] + 0.02


def test_a_swing_by_sight_has_the_speed_and_acceleration_of_its_places() -> None:
    heights, blind = exact_map(None), np.array([0.3, -0.1, FOOT])
    walking, now, h = planner(heights), standing(), 1e-6
    foot = walking._state.feet[1]
    foot.swing.start[:], foot.step.goal[:], foot.step.chosen[:] = (0.1, -0.15, 0.05), blind, blind
    foot.step.is_sighted, foot.step.next = True, math.inf
    foot.step.begin, foot.step.end, foot.step.peak, foot.step.top = 0.2, 0.85, 0.45, 0.15

    def moved(elapsed: float) -> np.ndarray:
        rows, spans = np.zeros((3, 3)), (elapsed, 0.4 - elapsed)
        swing_by_sight(1, now, walking._state, walking._walk, heights, spans, blind, 0.0, *rows)
        return rows

    for elapsed in np.arange(0.015, 0.4, 0.03).tolist():  # it jumps at 0.08, 0.18, 0.34
        change = (moved(elapsed + h) - moved(elapsed - h)) / (2.0 * h)
        np.testing.assert_allclose(moved(elapsed)[1:], change[:2], atol=1e-4)
    assert moved(0.0)[0] == pytest.approx(foot.swing.start)
    assert moved(0.4)[0] == pytest.approx([0.3, -0.1, FOOT - CONFIG.swing.touchdown_depth])


@pytest.mark.parametrize("sees", [False, True])
@pytest.mark.parametrize("uneven_way", [0.0, 0.5])
def test_feet_are_placed_by_a_map_of_uneven_ground_only(sees: bool, uneven_way: float) -> None:
    assert steps_by_sight(Sight(sees=sees, uneven_way=uneven_way)) == (sees and uneven_way > 0.0)


def test_a_trunk_that_sways_drags_no_foot_over_an_edge() -> None:
    """The blind foothold of each swing moves aside by 8 cm: over the gap between two stones."""
    terrain = Stones(start=0.05, count=6)
    walking, chosen = planner(exact_map(terrain, aside=0.6)), []
    for n in range(1, 2000):
        q, v = standing_q(0.30), np.zeros(18)
        v[0], v[1] = 0.3, 0.2 * math.cos(2.0 * math.pi * 0.002 * n / 0.25)
        q[0] = 0.3 * 0.002 * n - 0.3
        walking.update(MODEL.snapshot(state_of(q, v, 0.002 * n)), VelocityCommand(0.3))
        feet = [foot for foot in walking._state.feet if foot.step.is_sighted]
        chosen += [foot.step.goal[:2].copy() for foot in feet if n % 20 == 0 and q[0] > 0.3]
    around = 0.02 * np.array([(x, y) for x in (-1, 1) for y in (-1, 1)])
    assert len(chosen) > 40
    for place in chosen:
        assert true_heights(terrain, place + around).min() > -0.01


@pytest.mark.parametrize(("height", "lift"), [(0.02, 0.0), (0.16, LIFT)])
def test_down_steps_the_trunk_is_carried_higher(height: float, lift: float) -> None:
    walking = planner(exact_map(Stairs(height, 4, 0.31, start=0.3, way=DOWN)))
    q = standing_q()
    q[0], q[2] = 0.5, q[2] - height
    for n in range(1, 500):
        walking.update(MODEL.snapshot(state_of(q, time=0.002 * n)), VelocityCommand(0.3))
    assert walking.sight.lift == pytest.approx(lift, abs=1e-3)


def distance_to_edge(terrain: Terrain, place: np.ndarray) -> float:
    """How far [m] along x the ground stays as high as it is at a place."""
    x = np.arange(-0.08, 0.08, 0.005)
    z = true_heights(terrain, np.column_stack([place[0] + x, np.full(len(x), place[1])]))
    level = true_heights(terrain, place[None, :2])[0]
    off = np.abs(x[np.abs(z - level) > 0.03])
    return float(off.min()) if len(off) else math.inf


def test_who_sees_expects_no_steps_from_what_its_feet_have_met() -> None:
    walking = planner(exact_map(None))
    walking._state.ground.rise_way = 0.5
    walking.update(standing(), VelocityCommand(0.3))
    assert walking._state.ground.rise_way == 0.0
