"""A robot that carries something beside its middle stands and walks level, and knows what it is."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from controller import GO2Controller
from controller.behaviours.plans import PlayPlan
from go2_wbc.config import Config
from go2_wbc.plant import MujocoPlant
from go2_wbc.robot.payload import NO_PAYLOAD
from go2_wbc.robot.payload_estimation import PayloadConfig
from motions.postures import STAND_POSE, lean

LEVEL = np.radians(1.5)  # in the mean; measured 0.4 deg, without the estimate 17
MASS_ERROR = 0.3  # [kg]; measured 0.15
PLACE_ERROR = 0.03  # [m]; measured 0.015


def walk_and_stand(go2: GO2Controller, speed: float, seconds: float) -> float:
    """Stand, walk, stand; returns the mean roll [rad] of the last second of walking."""
    assert go2.stand(), go2.last_outcome
    assert go2.walk(), go2.last_outcome
    go2.move(speed)
    go2.wait(seconds - 1.0)
    rolls = []
    for _ in range(50):
        go2.wait(0.02)
        rolls.append(go2.state.rpy[0])
    assert go2.stand(), go2.last_outcome
    return float(np.mean(rolls))


@pytest.mark.slow
@pytest.mark.parametrize("side", [1.0, -1.0], ids=["left", "right"])
def test_four_kilograms_aside_are_carried_level(side: float) -> None:
    plant = MujocoPlant(payload=4.0, payload_place=(0.0, 0.08 * side, 0.1))
    with GO2Controller(plant=plant) as go2:
        assert abs(walk_and_stand(go2, 0.5, 4.0)) < LEVEL
        found = go2.telemetry.payload
        assert found.mass == pytest.approx(4.0, abs=MASS_ERROR)
        assert found.place[:2] == pytest.approx((0.0, 0.08 * side), abs=PLACE_ERROR)
        for call in (go2.high_five, go2.stand, go2.lie_down, go2.stand):
            assert call(), go2.last_outcome


def test_a_motion_is_played_without_the_payload() -> None:
    plant = MujocoPlant(payload=6.0, payload_place=(0.0, 0.06, 0.05))
    with GO2Controller(plant=plant) as go2:
        assert go2.stand()
        go2.wait(1.0)
        loop = go2._runner.loop
        assert loop.snapshot.payload[0] > 3.0
        loop.engage(PlayPlan(lean(STAND_POSE, np.zeros(3))))
        for _ in range(3):
            assert loop.snapshot.payload[0] == 0.0
            loop.tick()
        assert go2.telemetry.payload.mass > 3.0
        assert go2.stand(), go2.last_outcome
        assert loop.snapshot.payload[0] > 3.0


@pytest.mark.parametrize("mass_scale", [0.9, 1.1])
def test_without_a_payload_everything_is_the_same_to_the_bit(mass_scale: float) -> None:
    ends = []
    for enabled in (True, False):
        config = replace(Config(), payload=PayloadConfig(enabled=enabled))
        with GO2Controller(plant=MujocoPlant(mass_scale=mass_scale), config=config) as go2:
            walk_and_stand(go2, 1.0, 2.0)
            assert go2.telemetry.payload is NO_PAYLOAD
            ends.append(go2.state.q)
    np.testing.assert_array_equal(*ends)
