"""When a measured state counts as a fall, and what is said of it."""

from __future__ import annotations

import numpy as np
import pinocchio as pin
import pytest

from go2_wbc.robot.rotations import rotation_from_rpy
from go2_wbc.robot.safety import SafetyConfig, fall_reason
from go2_wbc.robot.state import RobotState
from tests.engine_helpers import standing_q, state_of

CONFIG = SafetyConfig()
SLIGHTLY = 1e-6


def tilted(roll: float, pitch: float, height: float = 0.3) -> RobotState:
    q = standing_q(height)
    q[3:7] = pin.Quaternion(rotation_from_rpy(roll, pitch, 0.7)).coeffs()
    return state_of(q, time=1.5)


@pytest.mark.parametrize(("roll", "pitch"), [(1.0, 0.0), (-1.0, 0.0), (0.0, 1.0), (0.0, -1.0)])
@pytest.mark.parametrize("may_lie", [False, True])
def test_a_tilt_beyond_its_limit_is_a_fall_whatever_way_it_goes(
    roll: float, pitch: float, may_lie: bool
) -> None:
    within, beyond = ((CONFIG.tilt_limit + d) * np.array([roll, pitch]) for d in (-1e-6, 1e-6))
    assert fall_reason(tilted(*within), 0.0, CONFIG, may_lie=may_lie) is None
    said = f"fell at t=1.50 s: roll {60 * roll:.0f} deg, pitch {60 * pitch:.0f} deg"
    reason = fall_reason(tilted(*beyond), 0.0, CONFIG, may_lie=may_lie)
    assert reason == said.replace("-0 ", "0 ")


@pytest.mark.parametrize("lowest_foot", [0.0, -0.4, 0.7])
def test_a_trunk_too_near_to_the_feet_is_a_fall_unless_it_may_lie(lowest_foot: float) -> None:
    limit = lowest_foot + CONFIG.height_limit
    assert fall_reason(tilted(0.0, 0.0, limit + SLIGHTLY), lowest_foot, CONFIG) is None
    low = tilted(0.0, 0.0, limit - SLIGHTLY)
    assert fall_reason(low, lowest_foot, CONFIG, may_lie=True) is None
    assert fall_reason(low, lowest_foot, CONFIG) == "fell at t=1.50 s: base 7 cm above the feet"


@pytest.mark.parametrize("value", [np.nan, np.inf])
@pytest.mark.parametrize(("part", "index"), [("q", 2), ("q", 18), ("v", 0), ("v", 17)])
def test_a_state_that_is_not_finite_is_a_fall(part: str, index: int, value: float) -> None:
    q, v = standing_q(), np.zeros(18)
    {"q": q, "v": v}[part][index] = value
    reason = fall_reason(state_of(q, v, 1.5), 0.0, CONFIG, may_lie=True)
    assert reason == "state is not finite at t=1.50 s"
