"""What is learned of the joints' friction, and by what a trunk is held to its plan."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra import numpy as arrays

from go2_wbc.reference import Target
from go2_wbc.robot.model import RobotModel
from go2_wbc.tracking.trunk_firmness import (
    DAMPING,
    IN_STRIDE,
    LEARNING,
    MOST_TURN,
    MOST_WAY,
    STIFFNESS,
    hold_firmly,
)
from tests.engine_helpers import random_state

TICK = 0.002
FAST = 10.0  # [m/s], [rad/s]; tanh of it is 1
NOW = RobotModel().snapshot(random_state(np.random.default_rng(4)))
MOST = np.repeat([MOST_WAY, MOST_TURN], 3)
vectors = arrays.arrays(float, 6, elements=st.floats(-0.2, 0.2))


def in_world(parts: np.ndarray) -> np.ndarray:
    """Components along the axes of the base, of place and attitude, in the world."""
    return (parts.reshape(2, 3) @ NOW.R_world_base.T).ravel()


def moving(rates: np.ndarray, *, is_com: bool = True) -> Target:
    """A target that moves along the axes of the base."""
    v = in_world(rates)
    return Target(is_com=is_com, v_world=v[:3], w_world=v[3:])


def held(
    target: Target, error: np.ndarray, learned: np.ndarray, *, in_stride: bool = False
) -> np.ndarray:
    lead = hold_firmly(NOW, in_world(error), np.zeros(6), TICK, learned, target, in_stride)
    return np.array(lead)


@given(vectors, vectors)
def test_a_trunk_that_is_to_rest_gets_nothing_of_what_was_learned(
    error: np.ndarray, learned: np.ndarray
) -> None:
    learned = np.clip(learned, -MOST, MOST)
    before = learned.copy()
    assert not held(moving(np.zeros(6)), error, learned).any()
    np.testing.assert_array_equal(learned, before)


@pytest.mark.parametrize("way", [1.0, -1.0])
@pytest.mark.parametrize("axis", range(6))
def test_what_a_stuck_trunk_teaches_turns_round_with_the_plan(axis: int, way: float) -> None:
    behind, learned, lead = np.zeros((3, 6))
    behind[axis] = way * 0.001
    for _ in range(50):
        lead = held(moving(np.sign(behind) * FAST), behind, learned)
    expected = np.zeros(6)
    expected[axis] = 50 * LEARNING * TICK * behind[axis]
    np.testing.assert_allclose(lead, in_world(expected), atol=1e-12)
    back = held(moving(-np.sign(behind) * FAST), np.zeros(6), learned)
    np.testing.assert_allclose(back, -lead, atol=1e-12)
    for _ in range(200):
        held(moving(np.sign(behind) * FAST), 10.0 * behind, learned)
    assert learned[axis] == MOST[axis], "no more is stored up"


@pytest.mark.parametrize("in_stride", [True, False])
@pytest.mark.parametrize("is_com", [True, False])
def test_a_trunk_off_its_plan_is_pulled_by_gains_along_its_own_axes(
    *, is_com: bool, in_stride: bool
) -> None:
    rng = np.random.default_rng(2)
    error, rates = rng.uniform(-0.1, 0.1, (2, 6))
    target, learned = moving(rates, is_com=is_com), np.zeros(6)
    lead = held(target, error, learned, in_stride=in_stride).reshape(2, 3) @ NOW.R_world_base
    v = NOW.state.v[:6].copy()
    if is_com:
        v[:3] = NOW.R_world_base.T @ NOW.v_world_com
    a = np.array(STIFFNESS) * (error + lead.ravel()) + np.array(DAMPING) * (rates - v)
    wanted = in_world(IN_STRIDE * a if in_stride else a)
    np.testing.assert_allclose(target.a_world, wanted[:3], atol=1e-9)
    np.testing.assert_allclose(target.dw_world, wanted[3:], atol=1e-9)


def test_in_stride_nothing_is_learned_and_nothing_of_it_is_added() -> None:
    learned = 0.5 * MOST
    lead = held(moving(np.full(6, FAST)), np.full(6, 0.1), learned, in_stride=True)
    assert not lead.any()
    np.testing.assert_array_equal(learned, 0.5 * MOST)
