"""Terrains are as high, where they say, as their numbers say."""

import math
from collections.abc import Callable

import numpy as np
import pytest

from go2_wbc.errors import ConfigError
from go2_wbc.plant.terrain import (
    BOTH,
    DOWN,
    TREAD,
    Blocks,
    Boxes,
    Course,
    Gap,
    Patch,
    Ramp,
    Slope,
    Stairs,
    Stones,
    Terrain,
    Waves,
)
from tests.go2_wbc.planning.seen import true_heights

NEAR_EDGE = 1e-3  #: m; no place so near to a jump of the height is looked at


def steps(*ends: float) -> Callable[[float], float]:
    """Of places and heights in turn: 0, x1, z1, x2, z2, ..."""
    return lambda x: [0.0, *ends[1::2]][sum(x >= end for end in ends[::2])]


def lines(*points: tuple[float, float]) -> Callable[[float], float]:
    return lambda x: float(np.interp(x, *np.transpose(points)))


WAVES = [0.04 * (1.0 - math.cos(2.0 * math.pi * n / 16)) for n in range(17)]
RISE = 1.5 * math.tan(0.3)
STONES = [(0.8 + 0.1 + 0.35 * n, 0.8 + 0.35 * (n + 1)) for n in range(6)]


@pytest.mark.parametrize(
    ("terrain", "height", "end"),
    [
        (Stairs(), steps(0.8, 0.08, 1.1, 0.16, 1.4, 0.24, 1.7, 0.32, 11.7, 0.0), math.inf),
        (Stairs(0.1, 2, start=0.5, is_open=True), steps(0.5, 0.1, 0.8, 0.2), math.inf),
        (Stairs(0.1, 3, way=DOWN), steps(0.8, -0.1, 1.1, -0.2, 1.4, -0.3), math.inf),
        (
            Stairs(0.1, 3, 0.25, way=BOTH, landing=1.0),
            steps(0.8, 0.1, 1.05, 0.2, 1.3, 0.3, 2.3, 0.2, 2.55, 0.1, 2.8, 0.0),
            2.8,
        ),
        (Blocks(count=2), steps(0.8, 0.1, 1.8, 0.0, 2.8, 0.1, 3.8, 0.0), 3.8),
        (
            Blocks(0.2, 0.3, 0.4, 3, 0.5),
            lambda x: 0.2 * (0.5 < x < 2.2 and (x - 0.5) % 0.7 < 0.3),
            2.2,
        ),
        (Slope(0.3), lambda x: x * math.tan(0.3), math.inf),
        (Ramp(0.3), lines((0.8, 0), (2.3, RISE), (3.8, RISE), (5.3, 0)), 5.3),
        (Waves(), lines(*((0.8 + n / 16, WAVES[n % 16]) for n in range(81))), 5.8),
        (Stones(), lambda x: 0.0 if any(a < x < b for a, b in STONES) or x < 0.8 else -0.4, 3.0),
        (Gap(), steps(0.8, -0.4, 1.0, 0.0), 1.0),
        (Patch(), steps(1.0, 0.002, 1.5, 0.0), math.inf),
        (
            Course((Blocks(0.2, count=1), Gap())),
            steps(0.8, 0.2, 1.8, 0.0, 2.6, -0.4, 2.8, 0.0),
            2.8,
        ),
    ],
    ids=lambda value: type(value).__name__ if isinstance(value, Terrain) else "",
)
def test_the_ground_is_as_high_as_is_said_and_ends_where_it_does(
    terrain: Terrain, height: Callable[[float], float], end: float
) -> None:
    x = np.linspace(-1.03, 2.47, 353)
    around = [np.array([height(a) for a in x + off]) for off in (-NEAR_EDGE, 0.0, NEAR_EDGE)]
    is_edge = np.ptp(around, axis=0) > 5 * NEAR_EDGE
    assert is_edge.mean() < 0.1
    for y in (0.01, 0.3 if isinstance(terrain, Stones) else 2.0):
        found = true_heights(terrain, np.column_stack([x, np.full(len(x), y)]))
        assert found[~is_edge] == pytest.approx(around[1][~is_edge], abs=1e-9)
    assert terrain.end == pytest.approx(end)


def test_stones_lie_in_rows_and_may_be_lower_and_open_stairs_have_nothing_below() -> None:
    level = Stones().blocks()
    assert sorted({round(one.centre[1], 6) for one in level}) == pytest.approx(
        0.35 * np.arange(-3, 4)
    )
    assert len(level) == 6 * 7
    assert Stones(uneven=0.1, seed=6).blocks() != Stones(uneven=0.1, seed=5).blocks()
    tops = [one.centre[2] + one.half_size[2] for one in Stones(uneven=0.1).blocks()]
    assert -0.1 < min(tops) < -0.08
    assert -0.02 < max(tops) < 0.0
    for one, plain in zip(Stones(uneven=0.1).blocks(), level, strict=True):
        assert one.centre[2] - one.half_size[2] == pytest.approx(-0.4)
        assert one.half_size[:2] == plain.half_size[:2] == (0.125, 0.125)
    for step in Stairs(is_open=True).blocks():
        assert 2.0 * step.half_size[2] == pytest.approx(TREAD)


@pytest.mark.parametrize("kind", [Boxes, Stairs, Blocks, Waves, Stones])
def test_a_million_of_something_is_refused(kind: Callable[..., Terrain]) -> None:
    with pytest.raises(ConfigError, match=r"\.count must be between . and 10000, got 1000000"):
        kind(count=10**6)


def test_boxes_are_strewn_evenly_but_for_where_the_robot_starts() -> None:
    rows, blocks = Boxes(count=2000).layout(), Boxes(count=2000).blocks()
    assert np.abs(rows[:, :2]).max(axis=0) == pytest.approx(4.0, abs=0.05)
    assert np.abs(rows[:, 2]).max() == pytest.approx(math.pi, abs=0.05)
    assert 0.0 < rows[:, 3].min() < 0.001
    assert 0.059 < rows[:, 3].max() <= 0.06
    assert np.abs(rows[:, :2].mean(axis=0)).max() < 0.2
    assert np.hypot(*rows[:, :2].T).min() == pytest.approx(0.55 + 0.25 / math.sqrt(2), abs=0.05)
    for (x, y, yaw, height), block in zip(rows.tolist(), blocks, strict=True):
        assert (block.centre, block.yaw) == ((x, y, height / 2), yaw)
        assert block.half_size == (0.125, 0.125, height / 2)


def test_a_drawn_course_is_long_enough_and_no_higher_and_steeper_than_is_said() -> None:
    assert Course.drawn(3) != Course.drawn(4)
    with pytest.raises(ConfigError, match="end"):
        Course((Stairs(),))
    kinds = set[type[Terrain]]()
    for seed in range(20):
        course = Course.drawn(seed)
        kinds |= {*map(type, course.parts)}
        assert course.end >= 12.0 > course.end - course.parts[-1].end
        heights = [p.height for p in course.parts if isinstance(p, Stairs | Blocks | Waves)]
        angles = [part.angle for part in course.parts if isinstance(part, Ramp)]
        assert all(0.06 <= height <= 0.12 for height in heights)
        assert all(0.15 <= angle <= 0.3 for angle in angles)
        assert repr(Course.drawn(seed)) == repr(course)
    assert kinds == {Stairs, Blocks, Ramp, Waves}


def test_the_ground_between_pits_reaches_from_behind_the_robot_to_behind_the_last() -> None:
    course = Course((Gap(), Gap(0.3, 0.6)))
    assert np.ravel(course.pits) == pytest.approx([0.8, 1.0, 1.8, 2.1])
    assert course.floor_height == -0.6
    spans = [(-10.0, 0.8), (1.0, 1.8), (2.1, 12.1)]
    for bank, (begin, end) in zip(course.banks(), spans, strict=True):
        x, half = bank.centre[0], bank.half_size[0]
        assert (x - half, x + half) == pytest.approx((begin, end))
        assert bank.centre[2] + bank.half_size[2] == pytest.approx(0.0)
        assert bank.centre[2] - bank.half_size[2] == pytest.approx(-0.6)
    assert Blocks().banks() == ()
