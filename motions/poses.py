"""Named poses of the trunk, as offsets [m, rad] from the posture in which the motion is."""

from __future__ import annotations

import math
from collections.abc import Mapping

POSES: Mapping[str, Mapping[str, float]] = {
    "home": {"x": 0.0, "y": 0.0, "z": 0.0, "roll": 0.0, "pitch": 0.0, "yaw": 0.0},
    "low": {"z": -0.10},
    "high": {"z": 0.03},
    "bow": {"pitch": math.radians(18.0), "z": -0.05},
    "look_up": {"pitch": math.radians(-18.0)},
    "look_down": {"pitch": math.radians(15.0)},
    "look_left": {"yaw": math.radians(18.0)},
    "look_right": {"yaw": math.radians(-18.0)},
    "lean_left": {"roll": math.radians(-12.0), "y": 0.02},
    "lean_right": {"roll": math.radians(12.0), "y": -0.02},
}
"""Poses that every library motion may use by name; all are reached from standing."""
