"""Getting onto the belly after a fall, by joint servos alone.

The trunk is round: with its legs folded the robot comes to rest on its belly or on its back. The
thighs turn far enough to point past the back, so from there the legs of one side push against the
ground and roll the robot over to the other side, onto its belly.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from jaxtyping import Float

from controller.behaviours.base import Behaviour
from controller.behaviours.joints import ServoJoints
from controller.loop import ControlLoop
from go2_wbc.legs import LEGS
from motions.postures import TUCKED_JOINTS

ON_BELLY = 0.6
"""Tilt [rad] below which the robot lies on its belly."""
TRIES = 4
"""How often it rolls before it gives up."""
REACHED_BACK = (-0.3, 3.4, -2.66)
"""Joint angles [rad] of a left leg folded past the back, and inwards."""
PUSHING = (0.8, 3.4, -0.9)
"""Joint angles [rad] of a left leg stretched past the back and outwards: it lifts its side."""


def roll_over(loop: ControlLoop) -> Iterator[Behaviour]:
    """Behaviours that bring the robot onto its belly, one after the other, looking in between."""
    yield _fold()
    for _ in range(TRIES):
        if loop.state.tilt < ON_BELLY:
            return
        side = 1 if loop.state.rpy[0] >= 0 else -1
        reach, push = _one_side(side, REACHED_BACK), _one_side(side, PUSHING)
        yield ServoJoints("reach back", ((0.5, reach), (0.1, reach)), kp=80.0)
        yield ServoJoints("push over", ((0.24, push), (0.4, push)), kp=80.0)
        yield _fold()


def _fold() -> ServoJoints:
    return ServoJoints("fold legs", ((0.6, TUCKED_JOINTS), (0.3, TUCKED_JOINTS)), kp=60.0)


def _one_side(side: int, joints: tuple[float, float, float]) -> Float[np.ndarray, "12"]:
    target = TUCKED_JOINTS.copy()
    for leg in LEGS:
        if leg.side == side:
            target[leg.joints] = np.array(joints) * (side, 1.0, 1.0)
    return target
