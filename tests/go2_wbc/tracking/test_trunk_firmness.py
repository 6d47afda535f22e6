"""What is learned of the joints' friction, and by what a trunk is held to its plan."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra import numpy as arrays

from go2_wbc.reference import Target
from go2_wbc.robot.model import RobotModel
from go2_wbc.robot.state import Snapshot
from go2_wbc.tracking.trunk_firmness import (
    DAMPING,
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


def held(target: Target, error: np.ndarray, learned: np.ndarray, now: Snapshot = NOW) -> np.ndarray:
    return np.array(hold_firmly(now, in_world(error), np.zeros(6), TICK, learned, target))


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


@pytest.mark.parametrize("is_com", [True, False])
def test_a_trunk_off_its_plan_is_pulled_by_gains_along_its_own_axes(*, is_com: bool) -> None:
    rng = np.random.default_rng(2)
    error, rates = rng.uniform(-0.1, 0.1, (2, 6))
    target, learned = moving(rates, is_com=is_com), np.zeros(6)
    lead = held(target, error, learned).reshape(2, 3) @ NOW.R_world_base
    v = NOW.state.v[:6].copy()
    if is_com:
        v[:3] = NOW.R_world_base.T @ NOW.v_world_com
    a = np.array(STIFFNESS) * (error + lead.ravel()) + np.array(DAMPING) * (rates - v)
    wanted = in_world(a)
    np.testing.assert_allclose(target.a_world, wanted[:3], atol=1e-9)
    np.testing.assert_allclose(target.dw_world, wanted[3:], atol=1e-9)
