"""The integral correction: it grows at its rate, stays in its bounds, and finds the offset."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from go2_wbc.planning.correction import (
    CorrectionConfig,
    SteadyStateCorrection,
    tracked_position,
)
from go2_wbc.reference import TrackedPoint
from go2_wbc.robot.model import RobotModel
from go2_wbc.robot.rotations import exp_rotation, log_rotation
from tests.engine_helpers import holding_reference, random_state

MODEL = RobotModel()
CONFIG = CorrectionConfig()
TICK = 0.002
LIMITS = np.repeat([CONFIG.position_limit, CONFIG.angle_limit], 3)
WINDOWS = np.repeat([CONFIG.position_window, CONFIG.angle_window], 3)
errors = st.lists(st.floats(-0.6, 0.6), min_size=6, max_size=6).map(np.array)


def test_it_starts_without_any_correction() -> None:
    assert not SteadyStateCorrection().update(np.zeros(6), TICK).any()


@given(errors, st.floats(1e-4, 1e-2))
def test_an_error_is_integrated_at_the_rate_and_a_large_one_counts_as_the_window(
    error: np.ndarray, dt: float
) -> None:
    offset = SteadyStateCorrection().update(error, dt)
    expected = CONFIG.rate * dt * np.clip(error, -WINDOWS, WINDOWS)
    np.testing.assert_allclose(offset, expected, atol=1e-12)


@given(st.lists(errors, min_size=1, max_size=20), st.floats(1e-3, 10.0))
def test_the_correction_never_leaves_its_bounds(history: list[np.ndarray], dt: float) -> None:
    correction = SteadyStateCorrection()
    for error in history:
        assert (np.abs(correction.update(error, dt)) <= LIMITS).all()


def test_a_bounded_correction_comes_back_at_once() -> None:
    """The integral is bounded itself, so it does not wind up behind the bound."""
    correction, error = SteadyStateCorrection(), np.full(6, 0.03)
    for _ in range(10_000):
        correction.update(error, TICK)
    np.testing.assert_allclose(correction.update(error, TICK), LIMITS)
    assert (correction.update(-error, TICK) < LIMITS).all()


def test_a_body_that_sags_is_brought_to_where_it_was_asked_to_be() -> None:
    """The measured body stands ``sag`` off the corrected target, as under an unknown payload."""
    rng = np.random.default_rng(5)
    sag, turn = rng.uniform(-0.03, 0.03, size=3), rng.uniform(-0.05, 0.05, size=3)
    snapshot = MODEL.snapshot(random_state(rng))
    target = holding_reference(snapshot).body
    correction = SteadyStateCorrection()
    given_target, measured = target, snapshot
    for _ in range(4000):
        measured = snapshot.replaced(
            p_world_com=given_target.p_world + sag,
            R_world_base=exp_rotation(turn) @ given_target.R_world_base,
        )
        given_target = correction.corrected(target, measured, TICK)
    np.testing.assert_allclose(measured.p_world_com, target.p_world, atol=1e-6)
    error = log_rotation(target.R_world_base @ measured.R_world_base.T)
    np.testing.assert_allclose(error, 0.0, atol=1e-3)
    np.testing.assert_array_equal(given_target.v_world, target.v_world)


@pytest.mark.parametrize("lean", [0.11, 0.25])
def test_a_body_held_far_off_its_attitude_is_brought_back_too(lean: float) -> None:
    """Errors above 0.1 rad used to be dropped: a robot that leaned further leaned for good."""
    correction, offset = SteadyStateCorrection(), np.zeros(6)
    held = np.array([0.0, 0.0, 0.0, lean, 0.0, 0.0])
    for _ in range(4000):
        offset = correction.update(held - offset, TICK)
    np.testing.assert_allclose(offset, held, atol=1e-6)


@pytest.mark.parametrize("point", list(TrackedPoint))
def test_the_tracked_position_is_that_of_the_named_point(point: TrackedPoint) -> None:
    snapshot = MODEL.snapshot(random_state(np.random.default_rng(6)))
    com, base = snapshot.p_world_com, snapshot.state.p_world_base
    expected = {TrackedPoint.COM: com, TrackedPoint.BASE: base}
    np.testing.assert_array_equal(tracked_position(snapshot, point), expected[point])
    assert not np.allclose(com, base)


def test_a_base_target_is_compared_with_the_base() -> None:
    snapshot = MODEL.snapshot(random_state(np.random.default_rng(7)))
    body = holding_reference(snapshot).body
    at_base = replace(body, point=TrackedPoint.BASE, p_world=snapshot.state.p_world_base)
    corrected = SteadyStateCorrection().corrected(at_base, snapshot, TICK)
    np.testing.assert_array_equal(corrected.p_world, at_base.p_world)
