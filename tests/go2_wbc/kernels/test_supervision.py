"""The kernels that notice a fall say what the plain formulas say."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from go2_wbc.kernels.supervision import heights, is_plausible, sag_and_lean
from go2_wbc.planning.correction import tracked_position
from go2_wbc.robot.model import FOOT_RADIUS, RobotModel
from go2_wbc.robot.safety import TRUNK_UNDERSIDE, trunk_clearance
from tests.engine_helpers import cases, random_state

MODEL = RobotModel()
TOLERANCE = 0.01


def test_heights_and_angles_are_those_of_the_formulas() -> None:
    for snapshot, reference in cases(MODEL, 50, seed=11):
        lowest = float(snapshot.p_world_feet[:, 2].min())
        height, clearance = heights(snapshot.row, TRUNK_UNDERSIDE, FOOT_RADIUS)
        assert height == pytest.approx(snapshot.state.q[2] - lowest, abs=1e-12)
        expected = trunk_clearance(snapshot, lowest - FOOT_RADIUS)
        assert clearance == pytest.approx(expected, abs=1e-12)
        body = reference.body
        sag, lean = sag_and_lean(reference.row, snapshot.row)
        wanted = body.p_world - tracked_position(snapshot, body.point)
        assert sag == pytest.approx(wanted[2], abs=1e-12)
        verticals = body.R_world_base[2] @ snapshot.R_world_base[2]
        assert lean == pytest.approx(np.arccos(verticals), abs=1e-12)


@pytest.mark.parametrize("bad", [np.nan, np.inf, -np.inf])
@pytest.mark.parametrize("name", ["q", "v", "tau", "foot_forces"])
def test_every_number_of_a_state_must_be_finite(name: str, bad: float) -> None:
    state = random_state(np.random.default_rng(12))
    for index in range(len(getattr(state, name))):
        values = getattr(state, name).copy()
        values[index] = bad
        broken = replace(state, **{name: values})
        rows = (broken.q, broken.v, broken.tau, broken.foot_forces)
        assert not is_plausible(*rows, TOLERANCE)
    assert is_plausible(state.q, state.v, state.tau, state.foot_forces, TOLERANCE)


def test_a_quaternion_must_be_of_length_one() -> None:
    state = random_state(np.random.default_rng(13))
    for factor, expected in ((0.985, False), (0.995, True), (1.005, True), (1.015, False)):
        q = state.q.copy()
        q[3:7] *= factor
        assert is_plausible(q, state.v, state.tau, state.foot_forces, TOLERANCE) is expected
