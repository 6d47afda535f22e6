"""Convex hull and signed distance to it."""

import numpy as np
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st
from hypothesis.extra import numpy as npst

from go2_wbc.geometry import convex_hull, moving_support_margins, support_margin, support_margins

ROUNDING = 1e-9  # coordinates are at most 1 m
SQUARE = np.array([[1.0, 1.0], [1.0, -1.0], [-1.0, -1.0], [-1.0, 1.0]])
RIGHT_TRIANGLE = np.array([[0.0, 0.0], [4.0, 0.0], [0.0, 3.0]])

coordinates = st.floats(-1.0, 1.0).map(lambda x: round(x, 6))
clouds = npst.arrays(np.float64, st.tuples(st.integers(3, 9), st.just(2)), elements=coordinates)
places = npst.arrays(np.float64, 2, elements=coordinates)
angles = st.floats(-np.pi, np.pi)


def area(hull: np.ndarray) -> float:
    x, y = hull.T
    return 0.5 * float(np.sum(x * np.roll(y, -1) - y * np.roll(x, -1)))


@pytest.mark.parametrize(
    ("p", "margin"),
    [
        ((0.0, 0.0), 1.0),
        ((0.9, 0.0), 0.1),
        ((1.0, 0.5), 0.0),
        ((1.5, 0.0), -0.5),
        ((4.0, 5.0), -5.0),
    ],
    ids=["centre", "near an edge", "on an edge", "beside an edge", "beyond a corner"],
)
def test_the_margin_of_a_square_is_the_distance_to_its_border(
    p: tuple[float, float], margin: float
) -> None:
    assert support_margin(SQUARE, np.array(p)) == pytest.approx(margin, abs=ROUNDING)


def test_the_incentre_is_1_from_every_edge_and_points_on_edges_are_no_corners() -> None:
    assert support_margin(RIGHT_TRIANGLE, np.array([1.0, 1.0])) == pytest.approx(1.0)
    points = np.concatenate([SQUARE, [[0.0, 0.0], [1.0, 0.0], [0.3, -0.2]], SQUARE])
    hull = convex_hull(points)
    assert {tuple(corner) for corner in hull} == {tuple(corner) for corner in SQUARE}
    assert area(hull) == pytest.approx(4.0)
    with pytest.raises(ValueError, match="at least one point"):
        support_margin(np.zeros((0, 2)), np.zeros(2))


@pytest.mark.parametrize("points", [[[2.0, 0.0]], [[-1.0, 0.0], [1.0, 0.0], [0.0, 0.0]]])
def test_nothing_is_inside_a_hull_without_area(points: list[list[float]]) -> None:
    assert support_margin(np.array(points), np.array([1.0, 0.0])) <= 0.0
    assert support_margin(np.array(points), np.array([2.0, 3.0])) < -2.9


@given(clouds)
def test_a_hull_runs_counter_clockwise_around_every_point(points: np.ndarray) -> None:
    hull = convex_hull(points)
    assume(area(hull) > 1e-6)
    assert all(support_margin(points, p) >= -ROUNDING for p in points)


@given(clouds, places, places, places)
def test_the_margin_grows_with_feet_and_never_faster_than_the_point_moves(
    points: np.ndarray, p: np.ndarray, q: np.ndarray, extra: np.ndarray
) -> None:
    change = abs(support_margin(points, p) - support_margin(points, q))
    assert change <= np.linalg.norm(p - q) + ROUNDING
    more = np.concatenate([points, extra[None]])
    assert support_margin(more, p) >= support_margin(points, p) - ROUNDING


def test_many_points_at_once_have_the_margins_that_they_have_alone() -> None:
    rng = np.random.default_rng(5)
    feet, points = rng.normal(size=(4, 2)), rng.normal(size=(50, 2))
    alone = [support_margin(feet, point) for point in points]
    np.testing.assert_array_equal(support_margins(feet, points), alone)
    assert min(alone) < 0.0 < max(alone)


@given(
    npst.arrays(
        np.float64, st.tuples(st.just(5), st.integers(2, 4), st.just(2)), elements=coordinates
    ),
    npst.arrays(np.float64, (5, 2), elements=coordinates),
)
def test_moving_feet_have_the_margins_of_every_instant(points: np.ndarray, p: np.ndarray) -> None:
    assume(all(area(convex_hull(feet)) > 1e-3 or len(convex_hull(feet)) < 3 for feet in points))
    alone = [support_margin(feet, place) for feet, place in zip(points, p, strict=True)]
    np.testing.assert_allclose(moving_support_margins(points, p), alone, rtol=0.0, atol=ROUNDING)
