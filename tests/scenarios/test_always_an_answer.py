"""Blind over boxes the QP contradicts itself now and then; the robot is not damped for that."""

from __future__ import annotations

import pytest

from controller import GO2Controller, Mode
from go2_wbc.plant import MujocoPlant
from go2_wbc.plant.terrain import Boxes

LAYOUTS = ((0.08, 3), (0.10, 305))
"""Height [m] and seed of boxes where the trot stays up, and the hard QP has no solution in 3 and 13
ticks."""


@pytest.mark.slow
@pytest.mark.parametrize(("height", "seed"), LAYOUTS)
def test_a_trot_over_boxes_is_never_damped_while_it_is_upright(height: float, seed: int) -> None:
    plant = MujocoPlant(terrain=Boxes(height=height, seed=seed), seed=seed)
    with GO2Controller(plant=plant) as go2:
        assert go2.stand()
        assert go2.walk()
        go2.move(1.0)
        go2.wait(8.0)
        assert go2.mode is Mode.WALKING
        assert go2.telemetry.qp_failures == 0
        assert go2.telemetry.relaxed_ticks > 0, "or the test would say nothing"
        assert go2.telemetry.grave_ticks == 0
