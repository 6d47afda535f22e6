"""What a seed varies, and a simulated robot under these conditions: those of the sweeps."""

from __future__ import annotations

from controller.sweeps.trials import (
    FRICTION_RANGE,
    JOINT_NOISE,
    MASS_RANGE,
    NOMINAL_FRICTION,
    YAW_RANGE,
    Trial,
    TrialFailed,
    TrialRobot,
)

__all__ = [
    "FRICTION_RANGE",
    "JOINT_NOISE",
    "MASS_RANGE",
    "NOMINAL_FRICTION",
    "YAW_RANGE",
    "Trial",
    "TrialFailed",
    "TrialRobot",
]
