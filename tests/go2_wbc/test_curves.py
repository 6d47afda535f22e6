"""Curves: their derivatives, their ends, and what is refused."""

import math
from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from go2_wbc.curves import Curve, Ease
from go2_wbc.errors import CommandError

STEP = 1e-5  # [s] of the central differences
SLOPE_TOLERANCE = 1e-7  # their error is step^2 times the third derivative, some 100; measured 2e-8
CURVATURE_TOLERANCE = 1e-3  # rounding of a second difference, 1e-16 / step^2; measured 2e-5
EXACT = 1e-12  # rounding of numbers of order one
SMOOTH = [Ease.MINIMUM_JERK, Ease.CUBIC]
SYMMETRIC = [*SMOOTH, Ease.LINEAR]


def random_curve(seed: int, ease: Ease) -> Curve:
    rng = np.random.default_rng(seed)
    times = np.concatenate([[0.0], np.cumsum(rng.uniform(0.3, 1.5, size=4))])
    return Curve([float(t) for t in times], list(rng.normal(size=(5, 6))), ease)


@pytest.mark.parametrize("ease", list(Ease))
@pytest.mark.parametrize("seed", range(3))
def test_rate_and_acceleration_are_the_derivatives(ease: Ease, seed: int) -> None:
    curve = random_curve(seed, ease)
    rng = np.random.default_rng(100 + seed)
    for start, end in pairwise(curve.times):
        for share in rng.uniform(0.02, 0.98, size=8):
            t = start + share * (end - start)
            before, now, after = (curve.at(t + d) for d in (-STEP, 0.0, STEP))
            slope = (after.value - before.value) / (2 * STEP)
            curvature = (after.value - 2 * now.value + before.value) / STEP**2
            np.testing.assert_allclose(now.rate, slope, atol=SLOPE_TOLERANCE)
            np.testing.assert_allclose(now.acceleration, curvature, atol=CURVATURE_TOLERANCE)


@pytest.mark.parametrize("ease", list(Ease))
def test_every_key_is_passed_at_its_time(ease: Ease) -> None:
    times, values = [0.0, 0.4, 1.0, 2.5], list(np.random.default_rng(1).normal(size=(4, 3)))
    curve = Curve(times, values, ease)
    for time, value in zip(times, values, strict=True):
        np.testing.assert_allclose(curve.at(time).value, value, atol=EXACT)


def test_a_curve_counts_from_its_first_key_and_is_not_moved_by_what_it_hands_out() -> None:
    curve = Curve([5.0, 6.0], [np.zeros(1), np.ones(1)])
    assert curve.duration == 1.0
    assert curve.at(0.0).value[0] == 0.0
    assert curve.at(1.0).value[0] == 1.0
    curve = Curve((0.0, 1.0), (np.zeros(2), np.ones(2)))
    curve.at(0.5).value[:] = 7.0
    np.testing.assert_allclose(curve.at(0.5).value, 0.5)


@pytest.mark.parametrize("ease", list(Ease))
@pytest.mark.parametrize("outside", [0.0, 1e-12, 10.0])
def test_outside_its_duration_a_curve_rests_at_its_ends(ease: Ease, outside: float) -> None:
    curve = random_curve(7, ease)
    first, last = curve.values[0], curve.values[-1]
    for t, value in ((-outside, first), (curve.duration + outside, last)):
        point = curve.at(t)
        np.testing.assert_allclose(point.value, value, atol=EXACT)
        if outside > 0.0 and ease in {*SMOOTH, Ease.HOLD}:
            np.testing.assert_allclose(point.rate, 0.0, atol=1e-9)


@pytest.mark.parametrize("ease", list(Ease))
def test_before_the_start_and_after_the_end_nothing_moves(ease: Ease) -> None:
    curve = random_curve(8, ease)
    for t in (-1.0, 0.0, curve.duration + 1e-6, curve.duration + 1.0):
        assert not curve.at(t).rate.any()
        assert not curve.at(t).acceleration.any()


@pytest.mark.parametrize("ease", SMOOTH)
def test_smooth_curves_come_to_rest_at_every_key(ease: Ease) -> None:
    curve = random_curve(9, ease)
    for start in curve.times[1:-1]:
        for t in (start - 1e-9, start, start + 1e-9):
            np.testing.assert_allclose(curve.at(t).rate, 0.0, atol=1e-6)


def test_minimum_jerk_also_starts_and_ends_without_acceleration() -> None:
    curve = random_curve(10, Ease.MINIMUM_JERK)
    for start in curve.times[1:-1]:
        for t in (start - 1e-9, start + 1e-9):
            np.testing.assert_allclose(curve.at(t).acceleration, 0.0, atol=1e-5)


@given(st.floats(0.0, 1.0), st.sampled_from(list(Ease)))
def test_progress_is_monotonic_and_bounded(s: float, ease: Ease) -> None:
    value, slope, _ = ease.progress(s)
    assert -EXACT <= value <= 1.0 + EXACT
    assert slope >= -EXACT


@given(st.floats(0.0, 1.0), st.sampled_from(SYMMETRIC))
def test_progress_is_symmetric_about_the_middle(s: float, ease: Ease) -> None:
    value, _, _ = ease.progress(s)
    assert value + ease.progress(1.0 - s)[0] == pytest.approx(1.0, abs=EXACT)


@given(st.floats(0.0, 1.0))
def test_easing_out_is_easing_in_backwards(s: float) -> None:
    value, slope, bend = Ease.IN.progress(s)
    assert Ease.OUT.progress(1.0 - s) == pytest.approx((1.0 - value, slope, -bend), abs=EXACT)


def test_easing_in_joins_a_linear_piece_and_hold_stays_until_its_end() -> None:
    assert Ease.IN.progress(0.0) == (0.0, 0.0, 0.0)
    assert Ease.IN.progress(1.0) == pytest.approx((1.0, 2.0, 0.0), abs=EXACT)
    assert [Ease.HOLD.progress(s)[0] for s in (0.0, 0.5, 0.999, 1.0)] == [0.0, 0.0, 0.0, 1.0]


@pytest.mark.parametrize(
    ("times", "count"),
    [([], 0), ([0.0], 1), ([0.0, 1.0], 3), ([0.0, 1.0, 2.0], 2)],
    ids=["none", "one", "more values", "more times"],
)
def test_a_curve_needs_two_times_and_as_many_values(times: list[float], count: int) -> None:
    with pytest.raises(CommandError, match="two or more times and as many values"):
        Curve(times, [np.zeros(2)] * count)


@pytest.mark.parametrize("times", [[0.0, 1.0, 1.0], [0.0, 2.0, 1.0], [0.0, math.nan, 1.0]])
def test_key_times_must_increase(times: list[float]) -> None:
    with pytest.raises(CommandError, match="duration must be > 0"):
        Curve(times, [np.zeros(2)] * 3)
