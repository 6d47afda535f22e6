"""Resting postures and the ways between them, all on four feet that stay where they are."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from go2_wbc.curves import CurvePoint, Segment
from go2_wbc.reference import LegTask, MotionPlan, Posture, Reference, TrackedPoint
from motions.plan import reference, reference_row

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
_STILL = CurvePoint(*(np.zeros(12) for _ in range(3)))
_STANDING = (LegTask.STANCE,) * 4


@dataclass(frozen=True, slots=True)
class PosturePlan(MotionPlan):
    """The trunk goes from one pose to another by minimum jerk.

    Attributes:
        name, entry, exit: see ``MotionPlan``.
        point: which point the first three components of ``body`` move.
        body: from x, y, z [m] and roll, pitch, yaw [rad] (6,) to others.
    """

    name: str
    entry: Posture
    exit: Posture
    point: TrackedPoint
    body: Segment

    @property
    def duration(self) -> float:  # type: ignore[override]
        """Length of the motion [s]."""
        return self.body.duration

    def at(self, t: float) -> Reference:
        """The reference at ``t``; see ``MotionPlan.at``."""
        return Reference.of_row(self.row_at(t))

    def row_at(self, t: float) -> Float[np.ndarray, " size"]:
        """Its numbers, by a kernel; see ``MotionPlan.row_at``."""
        return reference_row(self.point, self.body.at(t))

    def readable_at(self, t: float) -> Reference:
        """The same as ``at``, step by step: what the kernel is held to."""
        return reference(self.point, self.body.at(t), _STILL, _STILL, _STANDING, np.ones(4))


def rise(start: Float[np.ndarray, "6"], entry: Posture, duration: float = 1.2) -> PosturePlan:
    """From a CoM pose (6,) to standing."""
    way = Segment(start, STAND_POSE, duration)
    return PosturePlan("stand", entry, Posture.STAND, TrackedPoint.COM, way)


def lean(
    start: Float[np.ndarray, "6"], rpy: Float[np.ndarray, "3"], duration: float = 1.0
) -> PosturePlan:
    """From a standing CoM pose (6,) to standing with the trunk at roll, pitch, yaw [rad]."""
    way = Segment(start, np.concatenate([STAND_POSE[:3], rpy]), duration)
    return PosturePlan("lean", Posture.STAND, Posture.STAND, TrackedPoint.COM, way)


def sit_down(start: Float[np.ndarray, "6"], duration: float = 1.5) -> PosturePlan:
    """From a standing base pose (6,) to the dog-like sit."""
    way = Segment(start, SIT_POSE, duration)
    return PosturePlan("sit", Posture.STAND, Posture.SIT, TrackedPoint.BASE, way)


def lie_down(start: Float[np.ndarray, "6"], duration: float = 1.5) -> PosturePlan:
    """From a standing base pose (6,) down to the ground."""
    way = Segment(start, LIE_POSE, duration)
    return PosturePlan("lie down", Posture.STAND, Posture.LIE, TrackedPoint.BASE, way)
