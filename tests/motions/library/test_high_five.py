"""The high five leads back the way it came."""

from __future__ import annotations

import pytest

from motions import load_motion
from motions.language.keys import BODY_CHANNELS, BodyKey


@pytest.mark.parametrize("side", ["left", "right"])
def test_the_trunk_comes_back_through_the_poses_by_which_it_went(side: str) -> None:
    keys = load_motion("high_five", side=side).in_order(BodyKey)
    for channel in BODY_CHANNELS:
        goals = [0.0, *(key.value for key in keys if key.channel == channel)]
        assert goals == goals[::-1], channel
