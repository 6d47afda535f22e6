"""Getting onto the belly after a fall, by joint servos alone."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from jaxtyping import Float

from controller.behaviours.base import Behaviour
from controller.behaviours.joints import ServoJoints
from controller.loop import ControlLoop
from motions.postures import TUCKED_JOINTS

ON_BELLY = 0.6
"""Tilt [rad] below which the robot lies on its belly."""
TRIES = 4


def roll_over(loop: ControlLoop) -> Iterator[Behaviour]:
    """Behaviours that bring the robot onto its belly, one after the other, looking in between."""
    for _ in range(TRIES):
        if loop.state.tilt < ON_BELLY:
            return
        yield _fold()
        yield _push_off(float(loop.state.rpy[0]))


def _fold() -> ServoJoints:
    return ServoJoints("fold legs", ((0.6, TUCKED_JOINTS),), kp=40.0, kd=1.5)


def _push_off(roll: float) -> ServoJoints:
    lower_side = 1 if roll < 0 else -1
    pushed: Float[np.ndarray, "12"] = TUCKED_JOINTS.copy()
    return ServoJoints("push off", ((0.35, pushed), (0.3 * abs(lower_side), TUCKED_JOINTS)), kp=60.0)
