import numpy as np
import pytest

from go2_wbc.planning.height_map import (
    CELL,
    CELLS,
    DOWNS,
    LAYER,
    RATE,
    STOOD,
    HeightMap,
    cells,
    feel,
    fuse,
    heights_at,
)
from go2_wbc.plant import MujocoPlant
from go2_wbc.plant.terrain import BOTH, Boxes, Ramp, Stairs, Terrain
from go2_wbc.robot.model import RobotModel
from tests.compiled import assert_plain_is_compiled
from tests.engine_helpers import standing_q, state_of
from tests.go2_wbc.planning.seen import grid, true_heights

ORIGIN, LEVEL = np.zeros(3), np.eye(3)
MODEL = RobotModel()
STAIRS = Stairs(0.10, 2, 0.31, start=0.4, way=BOTH, landing=1.0)


def at(heights: HeightMap, *places: tuple[float, float]) -> np.ndarray:
    z = np.empty(len(places))
    heights_at(heights, np.array(places), z)
    return z


def seen(z: float, heights: HeightMap, scans: int = 1, deviation: float = 0.01) -> float:
    """What is known of a cell after scans that found it there."""
    for _ in range(scans):
        fuse(heights, np.array([[0.51, 0.01, z]]), ORIGIN, LEVEL, deviation)
    return float(at(heights, (0.51, 0.01))[0])


def test_a_cell_jumps_up_at_once_and_down_after_some_scans() -> None:
    heights = HeightMap()
    assert np.isnan(at(heights, (0.51, 0.01))[0])
    assert seen(0.0, heights) == 0.0
    assert seen(0.16, heights) == pytest.approx(0.16)
    assert seen(0.0, heights, DOWNS - 1) == pytest.approx(0.16)
    assert seen(0.0, heights) == pytest.approx(0.0)
    assert seen(0.16, heights) == pytest.approx(0.16)
    seen(0.0, heights, DOWNS - 1)
    seen(0.16, heights)  # one that is as before ends the row
    assert seen(0.0, heights, DOWNS - 1) == pytest.approx(0.16)


def test_noise_averages_out_as_the_variance_says() -> None:
    rng, sigma, many = np.random.default_rng(3), 0.015, 200
    heights, ends = HeightMap(), []
    for _ in range(many):
        heights.name[:] = 0.0
        ends.append([seen(z, heights, deviation=sigma) for z in rng.normal(0.0, sigma, 40)][-1])
    row, column = np.argwhere(heights.name)[0]
    told = float(np.sqrt(heights.variance[row, column]))
    assert told < 0.5 * sigma
    assert np.std(ends) == pytest.approx(told, rel=0.25)


def test_of_a_cell_with_an_edge_the_upper_side_is_kept() -> None:
    heights, x = HeightMap(), np.full(9, 0.51)
    z = np.array([0.0, 0.0, 0.01, 0.05, 0.10, 0.16, 0.15, 0.16, 0.16 - 1.01 * LAYER])
    fuse(heights, np.column_stack([x, np.full(9, 0.01), z]), ORIGIN, LEVEL, 0.01)
    assert at(heights, (0.51, 0.01))[0] == pytest.approx(np.mean([0.16, 0.15, 0.16]))


def test_what_lies_a_map_farther_takes_the_place_of_what_was() -> None:
    heights, length = HeightMap(), CELL * CELLS
    seen(0.1, heights)
    ahead = np.array([length, 0.0, 0.0])
    fuse(heights, np.array([[0.51, 0.01, 0.2], [1.95, 0.0, 0.3]]), ahead, LEVEL, 0.01)
    there = at(heights, (0.51, 0.01), (length + 0.51, 0.01), (length + 1.95, 0.0))
    np.testing.assert_allclose(there, [np.nan, 0.2, np.nan])  # the last one is too far away
    np.testing.assert_allclose(cells(heights), [[length + 0.5125, 0.0125, 0.2]])


def test_feet_move_the_map_and_write_what_is_not_known() -> None:
    heights, now = HeightMap(), MODEL.snapshot(state_of(standing_q()))
    stands, ground = np.ones(4, dtype=bool), now.p_world_feet[:, 2] - now.foot_radius + 0.004
    here = [(x, y) for x, y, _ in now.p_world_feet.tolist()]
    for _ in range(round(STOOD / 0.002) + 1):
        feel(heights, now, stands, 0.002)
    np.testing.assert_allclose(at(heights, *here), ground)
    assert len(cells(heights)) == 4 * 9
    heights.height[heights.name != 0.0] += 0.02  # what drift does
    lifted = np.array([True, False, False, True])
    feel(heights, now, lifted, 0.002)
    assert heights.shift == pytest.approx(-RATE * 0.002 * 0.02)
    for _ in range(2500):
        feel(heights, now, lifted, 0.002)
    np.testing.assert_allclose(at(heights, *here), ground, atol=0.001)
    heights.height[heights.name != 0.0] += 0.1  # on what is no ground a foot says nothing
    before = float(heights.shift)
    feel(heights, now, stands, 0.002)
    assert heights.shift == before
    assert_plain_is_compiled(feel, heights, now, stands, 0.002)


@pytest.mark.parametrize(
    "terrain",
    [None, STAIRS, Ramp(0.35, start=0.4), Boxes(0.12, seed=4, count=300)],
    ids=lambda t: type(t).__name__,
)
def test_what_a_lidar_sees_is_the_terrain(terrain: Terrain | None) -> None:
    plant = MujocoPlant(terrain=terrain, lidar=True, seed=6)
    heights, lidar, rng = HeightMap(), plant._ranges, np.random.default_rng(0)
    assert lidar is not None
    for n in range(41):
        q = standing_q(float(rng.uniform(0.29, 0.31)))
        q[0] = 0.02 * n - 0.5
        plant.place(q)
        state, scan = plant.truth(), lidar._take(0.0)
        pose = state.p_world_base, state.R_world_base
        fuse(heights, scan.p_base_points, *pose, scan.deviation)
    places = grid(0.1, 0.9, 0.25)
    around = [true_heights(terrain, places + CELL * np.array(way)) for way in _AROUND]
    is_even = np.ptp(around, axis=0) < 0.04
    off = (at(heights, *places) - around[0])[is_even]
    assert is_even.mean() > 0.3
    assert np.isfinite(off).mean() > 0.99
    assert abs(np.nanmean(off)) < 0.004
    assert np.nanstd(off) < 0.01
    state, scan = plant.truth(), lidar._take(0.0)
    pose = state.p_world_base, state.R_world_base
    assert_plain_is_compiled(fuse, heights, scan.p_base_points, *pose, scan.deviation)


_AROUND = [(0, 0), (1, 0), (-1, 0), (0, 1), (0, -1), (2, 0), (-2, 0)]
