"""The terms of the reward, by name: tracking gives up to 1, penalties are below 0.

Tracking with an error e gives exp(-e^2 / 0.25), as in legged_gym (Rudin et al., Learning to walk in
minutes, 2022, table 1); all other terms are negative squares. Weights are per second.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float32

from go2_wbc.records import Array3
from go2_wbc.robot.state import RobotState

SPREAD = 0.25
"""Square of the error [m^2/s^2], [rad^2/s^2] at which following is worth 1/e (legged_gym)."""

KNOCK = 1.0  #: Force [N] on trunk or legs from which on they knock against the ground


@dataclass(frozen=True, slots=True)
class Moment:
    """What a step has led to."""

    state: RobotState  #: in truth
    command: Array3  #: that was asked, ahead, left [m/s], turning left [rad/s]
    action: Float32[np.ndarray, "12"]  #: of this step, within 1
    last_action: Float32[np.ndarray, "12"]  #: of the one before
    body_force: float  #: normal force [N] of the ground on all but the feet
    has_fallen: bool  #: whether the episode ends with it
    period: float  #: of a step [s]


def terms(moment: Moment) -> dict[str, float]:
    """Each term, without its weight."""
    v, tau = moment.state.v, moment.state.tau
    ahead, left, turn = moment.command - v[[0, 1, 5]]
    change = moment.action - moment.last_action
    return {
        "velocity": math.exp(-(ahead**2 + left**2) / SPREAD),
        "turn": math.exp(-(turn**2) / SPREAD),
        "bounce": -float(v[2] ** 2),
        "roll_and_pitch": -float(v[3] ** 2 + v[4] ** 2),
        "tilt": -(math.sin(moment.state.tilt) ** 2),
        "effort": -float(tau @ tau),
        "change": -float(change @ change),
        "knock": -float(moment.body_force > KNOCK),
        "fall": -float(moment.has_fallen) / moment.period,
    }
