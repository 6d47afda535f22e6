"""Blind over boxes the QP contradicts itself now and then; the robot is not damped for that."""

from __future__ import annotations

import pytest

from controller import GO2Controller, Mode
from go2_wbc.plant import MujocoPlant
from go2_wbc.plant.terrain import Boxes

SEEDS = (1, 2)  # the trot stays up there, and the hard QP has no solution in 26 and 28 ticks


@pytest.mark.slow
@pytest.mark.parametrize("seed", SEEDS)
def test_a_trot_over_boxes_is_never_damped_while_it_is_upright(seed: int) -> None:
    plant = MujocoPlant(terrain=Boxes(height=0.08, seed=seed), seed=seed)
    with GO2Controller(plant=plant) as go2:
        assert go2.stand()
        assert go2.walk()
        go2.move(1.0)
        go2.wait(8.0)
        assert go2.mode is Mode.WALKING
        assert go2.telemetry.qp_failures == 0
        assert go2.telemetry.relaxed_ticks > 0, "or the test would say nothing"
        assert go2.telemetry.grave_ticks == 0
