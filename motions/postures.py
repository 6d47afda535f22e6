"""Resting postures and the ways between them, all on four feet that stay where they are."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from jaxtyping import Float

from go2_wbc.contacts import standing
from go2_wbc.curves import Curve, keyframes
from go2_wbc.reference import Posture, TrackedPoint
from motions.plan import KeyframePlan

STAND_HEIGHT = 0.29
"""Height [m] of the CoM above the ground when standing."""
STAND_POSE = np.array([0.0, 0.0, STAND_HEIGHT, 0.0, 0.0, 0.0])
"""CoM position [m] in the motion's frame, then roll, pitch, yaw [rad]."""
SIT_POSE = np.array([0.0, 0.0, 0.235, 0.0, np.radians(-38.0), 0.0])
"""Base position [m] and roll, pitch, yaw [rad] of the dog-like sit: rump down, front legs up.

The rear feet stay 9 cm below their hips' axes: much further down the rear legs cross a singularity
and rattle, unless the feet happen to be splayed (own simulation).
"""
LIE_POSE = np.array([0.0, 0.0, 0.085, 0.0, 0.0, 0.0])
"""Base position [m] and angles [rad] just above the ground, from which the robot goes limp."""
TUCKED_JOINTS = np.tile([0.0, 1.30, -2.66], 4)
"""Joint angles [rad] with the feet under the hips and the belly on the ground."""
SPLAYED_JOINTS = TUCKED_JOINTS + np.tile([0.3, 0.0, 0.0, -0.3, 0.0, 0.0], 2)
"""Joint angles [rad] with the feet beside the hips, so that the folded legs carry nothing."""


def rise(start: Float[np.ndarray, "6"], entry: Posture, duration: float = 1.2) -> KeyframePlan:
    """From a CoM pose (6,) to standing."""
    return _posture_plan(
        "stand", entry, Posture.STAND, TrackedPoint.COM, (start, STAND_POSE), duration
    )


def lean(
    start: Float[np.ndarray, "6"], rpy: Float[np.ndarray, "3"], duration: float = 1.0
) -> KeyframePlan:
    """From a standing CoM pose (6,) to standing with the trunk at roll, pitch, yaw [rad]."""
    poses = (start, np.concatenate([STAND_POSE[:3], rpy]))
    return _posture_plan("lean", Posture.STAND, Posture.STAND, TrackedPoint.COM, poses, duration)


def sit_down(start: Float[np.ndarray, "6"], duration: float = 1.5) -> KeyframePlan:
    """From a standing base pose (6,) to the dog-like sit."""
    poses = (start, SIT_POSE)
    return _posture_plan("sit", Posture.STAND, Posture.SIT, TrackedPoint.BASE, poses, duration)


def lie_down(start: Float[np.ndarray, "6"], duration: float = 1.5) -> KeyframePlan:
    """From a standing base pose (6,) down to the ground."""
    poses = (start, LIE_POSE)
    return _posture_plan("lie down", Posture.STAND, Posture.LIE, TrackedPoint.BASE, poses, duration)


def _posture_plan(
    name: str,
    entry: Posture,
    exit_posture: Posture,
    point: TrackedPoint,
    poses: Sequence[Float[np.ndarray, "6"]],
    duration: float,
) -> KeyframePlan:
    times = np.linspace(0.0, duration, len(poses)).tolist()
    return KeyframePlan(
        name, entry, exit_posture, point, keyframes(times, poses), _no_joints(), standing()
    )


def _no_joints() -> Curve:
    zeros = np.zeros(12)
    return keyframes((0.0, 1.0), (zeros, zeros))
