"""A robot in a few letters: the same for models whose numbers are the same."""

from __future__ import annotations

import hashlib

import numpy as np

from go2_wbc.legs import FOOT_NAMES
from go2_wbc.robot.model import RobotModel

DECIMALS = 9
"""Decimals of the numbers [SI units] that count: what a file was computed for stays the same robot
if another Pinocchio rounds its last digits differently."""
LENGTH = 16
"""Letters of a fingerprint."""


def fingerprint(model: RobotModel) -> str:
    """What tells the robot of ``model`` from others: masses, lengths, limits and motors.

    Comments and order of its URDF, meshes and colours do not count.
    """
    pin_model = model.pin_model
    feet = [pin_model.frames[pin_model.getFrameId(name)].placement for name in FOOT_NAMES]
    numbers = [
        *(placement.homogeneous for placement in pin_model.jointPlacements),
        *(inertia.matrix() for inertia in pin_model.inertias),
        *(placement.homogeneous for placement in feet),
        pin_model.armature,
        model.q_lower,
        model.q_upper,
        model.torque_limits,
        model.speed_limits,
        np.array([model.foot_radius, model.gravity]),
    ]
    digest = hashlib.sha256()
    for array in numbers:
        digest.update((np.round(array, DECIMALS) + 0.0).tobytes())  # no -0
    return digest.hexdigest()[:LENGTH]
