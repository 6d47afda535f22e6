"""The plane through the places where feet came down."""

import numpy as np
import pytest

from go2_wbc.robot.footprints import EACH, FAR, plane_near

SLOPES = 0.36, -0.1
AT = 3.0, -2.0  # m


def prints(rng: np.random.Generator, ahead: float = 0.0) -> np.ndarray:
    """Those on a plane, from 0.3 m behind to 0.3 m before ``ahead`` [m] from the place."""
    x, y = rng.uniform(-0.3, 0.3, EACH) + AT[0] + ahead, rng.uniform(-0.2, 0.2, EACH) + AT[1]
    return np.column_stack([x, y, 0.5 + SLOPES[0] * x + SLOPES[1] * y])


def test_a_plane_is_found_and_those_that_were_never_made_count_for_nothing() -> None:
    rng = np.random.default_rng(1)
    places = np.concatenate([prints(rng), np.full((EACH, 3), FAR)])
    height, *slopes, deviation, leverage = plane_near(places, 0, 2 * EACH, *AT)
    assert height == pytest.approx(0.5 + np.dot(SLOPES, AT), abs=1e-3)
    assert slopes == pytest.approx(SLOPES, abs=5e-3)
    assert deviation < 2e-3
    assert 1.0 / EACH < leverage < 0.6
    assert plane_near(places, EACH, 2 * EACH, *AT)[-1] > 1e6


def test_it_is_the_one_of_weighted_least_squares() -> None:
    rng = np.random.default_rng(2)
    places = prints(rng) + np.array([0.0, 0.0, 0.02]) * rng.standard_normal((EACH, 1))
    off = places[:, :2] - AT
    weights = np.exp(-0.5 * (off**2).sum(axis=1) / 0.2**2)
    columns = np.column_stack([np.ones(EACH), off])
    normal = columns.T @ (weights[:, None] * columns) + np.diag([0.0, 1e-4, 1e-4])
    expected = np.linalg.solve(normal, columns.T @ (weights * places[:, 2]))
    *found, deviation, leverage = plane_near(places, 0, EACH, *AT)
    np.testing.assert_allclose(found, expected, rtol=1e-6)
    assert leverage == pytest.approx(np.linalg.inv(normal)[0, 0], rel=1e-6)
    left = places[:, 2] - columns @ expected
    assert deviation == pytest.approx(np.sqrt(weights @ left**2 / weights.sum()), rel=0.02)


def test_beyond_the_prints_it_is_unsure() -> None:
    between, beyond = (
        plane_near(prints(np.random.default_rng(3), a), 0, EACH, *AT)[-1] for a in (0.0, 0.55)
    )
    assert beyond > 1.0 > between
