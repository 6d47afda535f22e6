"""The integral correction: it grows at its rate, stays in its bounds, and finds the offset."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.integrate import solve_ivp
from scipy.spatial.transform import Rotation

from go2_wbc.planning.correction import (
    ANGLE_LIMIT,
    ANGLE_WINDOW,
    HEIGHT_PER_WEIGHT,
    PITCH_PER_MOMENT,
    POSITION_LIMIT,
    POSITION_WINDOW,
    RATE,
    ROLL_PER_MOMENT,
    Correction,
    correct,
    integrated,
    tracked_position,
)
from go2_wbc.reference import Target, TrackedPoint
from go2_wbc.robot.model import RobotModel
from go2_wbc.robot.payload import Payload
from go2_wbc.robot.snapshot import Snapshot
from tests.engine_helpers import random_state

MODEL = RobotModel()
LIMITS = np.repeat([POSITION_LIMIT, ANGLE_LIMIT], 3)
WINDOWS = np.repeat([POSITION_WINDOW, ANGLE_WINDOW], 3)
TICK = 0.002
GRAVITY = 9.81
errors = st.lists(st.floats(-0.6, 0.6), min_size=6, max_size=6).map(np.array)


def snapshot_of(seed: int, payload: Payload | None = None) -> Snapshot:
    state = random_state(np.random.default_rng(seed))
    return MODEL.snapshot(state) if payload is None else MODEL.snapshot(state, payload)


NOW = snapshot_of(1)


def corrected(s: Correction, error: np.ndarray, dt: float, now: Snapshot = NOW) -> Target:
    """What is made of a target at the origin, turned by nothing."""
    target = Target(R_world_base=np.eye(3), v_world=np.ones(3))
    correct(now, error, dt, s, target)
    return target


@given(errors, st.floats(1e-4, 1e-2))
def test_an_error_is_integrated_at_the_rate_and_a_large_one_counts_as_the_window(
    error: np.ndarray, dt: float
) -> None:
    s = Correction()
    target = corrected(s, error, dt)
    expected = np.clip(np.clip(error, -WINDOWS, WINDOWS) * RATE * dt, -LIMITS, LIMITS)
    np.testing.assert_allclose(s.offset, expected, atol=1e-12)
    np.testing.assert_allclose(target.p_world, expected[:3], atol=1e-12)
    turn = Rotation.from_matrix(target.R_world_base).as_rotvec()
    np.testing.assert_allclose(turn, expected[3:], atol=1e-12)
    assert (target.v_world == 1.0).all()


@given(st.lists(errors, min_size=1, max_size=20), st.floats(1e-3, 10.0))
def test_the_correction_never_leaves_its_bounds(history: list[np.ndarray], dt: float) -> None:
    s = Correction()
    for error in history:
        corrected(s, error, dt)
        assert (np.abs(s.offset) <= LIMITS).all()


def test_a_bounded_correction_comes_back_at_once() -> None:
    """The integral is bounded itself, so it does not wind up behind the bound."""
    s, error = Correction(), np.full(6, 0.03)
    for _ in range(200):
        corrected(s, error, 10 * TICK)
    corrected(s, error, 100.0)
    np.testing.assert_array_equal(s.offset, LIMITS)
    corrected(s, -error, TICK)
    assert (s.offset < LIMITS).all()


@pytest.mark.parametrize("sag", [0.01, -0.012, 0.11, 0.4, -0.6])
def test_an_offset_goes_the_way_of_the_differential_equation(sag: float) -> None:
    """Of a body that always stands ``sag`` below its corrected reference: o' = rate clip(sag - o).

    Errors above 0.1 rad used to be dropped: a robot that leaned further leaned for good.
    """
    window, limit, times = 0.47, 0.11, np.arange(1, 1500) * TICK

    def rate(_: float, o: np.ndarray) -> np.ndarray:
        return RATE * np.clip(sag - o, -window, window)

    truth = solve_ivp(rate, (0.0, 3.0), [0.0], t_eval=times, rtol=1e-9, atol=1e-12).y[0]
    offset = 0.0
    for wanted in np.clip(truth, -limit, limit):
        offset = integrated(offset, sag - offset, TICK, RATE, window, limit)
        assert offset == pytest.approx(wanted, abs=2e-3 * abs(sag))


def test_a_target_is_turned_in_the_world_and_not_in_the_body() -> None:
    s, planned = Correction(), Rotation.from_euler("ZYX", [1.0, 0.2, -0.3])
    s.offset[:] = 0.01, -0.02, 0.03, 0.1, -0.2, 0.05
    target = Target(R_world_base=planned.as_matrix(), p_world=np.array([1.0, 2.0, 3.0]))
    correct(NOW, np.zeros(6), TICK, s, target)
    np.testing.assert_allclose(target.p_world, [1.01, 1.98, 3.03], atol=1e-12)
    turned = Rotation.from_rotvec([0.1, -0.2, 0.05]) * planned
    np.testing.assert_allclose(target.R_world_base, turned.as_matrix(), atol=1e-12)


def taken_over(now: Snapshot, bare: Snapshot, payload: Payload) -> np.ndarray:
    """Upward, about the heading's x and y: what holds the payload's weight, by its lever."""
    R = bare.R_world_base
    lever = bare.state.p_world_base + R @ payload.place - bare.p_world_com
    heading = Rotation.from_euler("z", np.arctan2(R[1, 0], R[0, 0])).as_matrix()
    ahead, left, _ = heading.T @ lever
    weight = payload.mass * GRAVITY
    roll, pitch = ROLL_PER_MOMENT * left * weight, -PITCH_PER_MOMENT * ahead * weight
    x, y, _ = heading @ [roll, pitch, 0.0]
    return np.array([HEIGHT_PER_WEIGHT * weight, x, y])


@pytest.mark.parametrize("seed", range(5))
def test_what_holds_a_payload_is_taken_out_once_it_is_known(seed: int) -> None:
    rng = np.random.default_rng(seed)
    payload = Payload(rng.uniform(0.2, 1.0), (*rng.uniform(-0.1, 0.1, 2), 0.05))
    bare, loaded = snapshot_of(seed), snapshot_of(seed, payload)
    known, s = taken_over(loaded, bare, payload), Correction()
    s.offset[:] = np.clip([0.01, -0.01, *(2.0 * known), 0.05], -LIMITS, LIMITS)
    held = s.offset.copy()
    corrected(s, np.zeros(6), 0.0, bare)
    np.testing.assert_array_equal(s.offset, held)
    corrected(s, np.zeros(6), 0.0, loaded)
    held[2:5] -= known
    np.testing.assert_allclose(s.offset, held, atol=1e-9)
    before = s.offset.copy()
    corrected(s, np.zeros(6), 0.0, loaded)
    np.testing.assert_array_equal(s.offset, before, "nothing more is known")


@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_no_more_is_taken_out_than_there_is(sign: float) -> None:
    """A correction that holds less than the payload asks for, or pulls the other way, ends at 0."""
    payload = Payload(4.0, (0.08, -0.06, 0.05))
    bare, loaded = snapshot_of(3), snapshot_of(3, payload)
    s = Correction()
    s.offset[2:5] = sign * 1e-4 * np.sign(taken_over(loaded, bare, payload))
    before = s.offset.copy()
    corrected(s, np.zeros(6), 0.0, bare)
    corrected(s, np.zeros(6), 0.0, loaded)
    np.testing.assert_array_equal(s.offset, before if sign < 0.0 else np.zeros(6))


def test_a_payload_that_is_known_from_the_start_takes_nothing() -> None:
    s = Correction()
    s.offset[2:5] = 0.05
    corrected(s, np.zeros(6), 0.0, snapshot_of(3, Payload(4.0, (0.08, -0.06, 0.05))))
    assert (s.offset[2:5] == 0.05).all()


@pytest.mark.parametrize("point", list(TrackedPoint))
def test_the_tracked_position_is_that_of_the_named_point(point: TrackedPoint) -> None:
    com, base = NOW.p_world_com, NOW.state.p_world_base
    expected = {TrackedPoint.COM: com, TrackedPoint.BASE: base}
    np.testing.assert_array_equal(tracked_position(NOW, point), expected[point])
    assert not np.allclose(com, base)
