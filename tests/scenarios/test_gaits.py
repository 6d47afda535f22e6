"""Every gait that has a name walks at the edge of its envelope, rests, and does what comes next."""

from __future__ import annotations

import numpy as np
import pytest

from controller import GO2Controller
from go2_wbc.contacts import GAITS
from go2_wbc.plant import MujocoPlant
from go2_wbc.plant.mujoco.ground_truth import GroundTruth

FRICTION = 0.7
SLOW = 0.05
"""Share of the command by which the mean speed may be off."""
CHANGES = ("pace", "walk", "pronk", "flying_trot", "trot")
"""One after the other, the robot walking all the time."""
FAST = 9.0
"""m/s, rad/s: beyond every envelope, so that it is clipped to it."""


@pytest.mark.slow
@pytest.mark.parametrize("name", sorted(GAITS.keys() - {"trot"}))
def test_a_gait_walks_at_the_edge_of_its_envelope_and_comes_to_rest(name: str) -> None:
    truth = GroundTruth(MujocoPlant(friction=FRICTION, seed=41))
    with GO2Controller(plant=truth) as go2:
        assert go2.stand()
        assert go2.walk(name)
        go2.move(FAST)
        wanted = go2.command.linear_x
        assert wanted == pytest.approx(1.5 * GAITS[name].envelope_share)
        go2.wait(2.0)
        truth.clear()
        go2.wait(2.0)
        speed = float(truth.recording().com_velocity[:, 0].mean())
        assert speed == pytest.approx(wanted, rel=SLOW)
        for aside, turning in ((FAST, 0.0), (0.0, -FAST)):
            go2.move(0.0, turning, linear_y=aside)
            go2.wait(1.5)
        go2.stop()
        assert go2.stand()
        assert truth.fall() is None
        assert np.abs(go2.state.v).max() < 0.1
    truth.close()


@pytest.mark.slow
def test_gaits_pass_over_into_one_another_while_the_robot_walks() -> None:
    # It came to rest before every change.
    truth = GroundTruth(MujocoPlant(friction=FRICTION, seed=43))
    with GO2Controller(plant=truth) as go2:
        assert go2.stand()
        assert go2.walk()
        go2.move(FAST)
        go2.wait(2.0)
        for name in CHANGES:
            truth.clear()
            assert go2.walk(name)
            go2.wait(1.0)
            envelope = 1.5 * GAITS[name].envelope_share
            assert go2.command.linear_x <= envelope * (1.0 + 1e-9)
            assert truth.recording().com_velocity[:, 0].min() > 0.15
        assert go2.command.linear_x > 0.0
        go2.stop()
        assert go2.stand()
        assert truth.fall() is None
    truth.close()
