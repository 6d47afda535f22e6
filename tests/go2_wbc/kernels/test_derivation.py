"""The snapshot's kernel is held to Pinocchio's own functions."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from go2_wbc.kernels.layout import SNAPSHOT
from go2_wbc.robot.model import RobotModel
from go2_wbc.robot.snapshot import Snapshot
from tests.engine_helpers import random_state

ROUNDING = 1e-12  # [SI] of values up to 1000; measured 3e-14
STATES = 1000
NAMES = list(SNAPSHOT.start)[2:]


def difference(a: Snapshot, b: Snapshot) -> float:
    """Largest difference of any number of two snapshots."""
    return max(float(np.abs(getattr(a, n) - getattr(b, n)).max()) for n in NAMES)


@pytest.mark.parametrize("foot_radius", [0.022, 0.0])
def test_every_quantity_is_what_pinocchio_says(foot_radius: float) -> None:
    model = RobotModel(foot_radius=foot_radius)
    rng = np.random.default_rng(3)
    for _ in range(STATES):
        state = random_state(rng, tilt=0.7)
        assert difference(model.snapshot(state), model.readable_snapshot(state)) < ROUNDING


def test_the_comparison_notices_a_wrong_number() -> None:
    model = RobotModel()
    snapshot = model.snapshot(random_state(np.random.default_rng(0)))
    drift = snapshot.drift_contacts + 1e-9
    assert difference(snapshot, replace(snapshot, drift_contacts=drift)) > ROUNDING


def test_a_snapshot_stays_as_it_was_when_the_next_one_is_made() -> None:
    """Pinocchio's arrays are overwritten by its next call; nothing of them may be kept."""
    model, rng = RobotModel(), np.random.default_rng(1)
    first = model.snapshot(random_state(rng))
    before = first.row.copy()
    model.snapshot(random_state(rng))
    model.forward_kinematics(random_state(rng).q)
    np.testing.assert_array_equal(first.row, before)


def test_states_of_any_memory_layout_are_taken() -> None:
    model = RobotModel()
    state = random_state(np.random.default_rng(2))
    strided = replace(state, q=np.repeat(state.q, 2)[::2], v=np.repeat(state.v, 3)[::3])
    frozen = replace(state, q=state.q.copy(), v=state.v.copy())
    frozen.q.flags.writeable = frozen.v.flags.writeable = False
    for other in (strided, frozen):
        np.testing.assert_array_equal(model.snapshot(other).row, model.snapshot(state).row)


def test_the_row_follows_an_array_that_was_replaced() -> None:
    snapshot = RobotModel().snapshot(random_state(np.random.default_rng(4)))
    lifted = replace(snapshot, p_world_feet=snapshot.p_world_feet + 1.0)
    start = SNAPSHOT.start["p_world_feet"]
    assert lifted.row[start] == snapshot.row[start] + 1.0


def test_a_nan_in_the_state_is_seen_in_the_snapshot() -> None:
    state = random_state(np.random.default_rng(5))
    q = state.q.copy()
    q[8] = np.nan
    assert np.isnan(RobotModel().snapshot(replace(state, q=q)).p_world_feet).any()
