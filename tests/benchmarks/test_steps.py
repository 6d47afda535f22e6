"""The benchmark of steps: what is walked is what the table says, and how frames go on."""

import numpy as np
import pytest

from benchmarks.steps import onwards, walk_with_paws
from go2_wbc.reference import Anchor
from motions.language.keys import LegKey, StepKey


@pytest.mark.parametrize("gait", ["walk", "trot"])
def test_the_walk_is_2_m_long_with_two_turns_and_three_paws(gait: str) -> None:
    line = walk_with_paws(gait)
    assert line.end_pose == pytest.approx((1.4, 0.6, 0.0), abs=1e-9)
    assert sum(not key.target.is_on_ground for key in line.in_order(LegKey)) == 3
    assert line.in_order(StepKey)


def test_a_frame_goes_on_in_its_own_heading() -> None:
    start = Anchor(np.array([1.0, 2.0, 0.0]), np.pi / 2)
    there = onwards(start, (0.5, 0.1, 0.2))
    assert there.p_world == pytest.approx([0.9, 2.5, 0.0])
    assert there.yaw == pytest.approx(np.pi / 2 + 0.2)
