"""A motion plan made of keyframed curves."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from go2_wbc.contacts import ContactPhase, ContactSchedule
from go2_wbc.curves import Curve, CurvePoint
from go2_wbc.reference import (
    BodyTarget,
    LegTask,
    MotionPlan,
    Posture,
    Reference,
    TrackedPoint,
)
from go2_wbc.robot.rotations import angular_velocity_from_rpy, rotation_from_rpy

NORMAL_FORCE_MIN = 0.0
"""Least normal force [N] asked of a foot: none, so that a pushed robot may tip and come back."""
NORMAL_FORCE_MAX = 400.0
"""Greatest normal force [N]: 2.5 times the robot's weight, never active in slow motions."""


@dataclass(frozen=True, slots=True)
class KeyframePlan(MotionPlan):
    """Body, joints and contacts as functions of time, in the motion's frame.

    Attributes:
        name, entry, exit: see ``MotionPlan``.
        point: which point the first three components of ``body`` move.
        body: curve (6,) of x, y, z [m] and roll, pitch, yaw [rad].
        joints: curve (12,) of joint angles [rad]; legs off the ground follow it.
        contacts: who stands when.
        ramp: time [s] over which a foot is unloaded before lift-off and loaded after touchdown.
    """

    name: str
    entry: Posture
    exit: Posture
    point: TrackedPoint
    body: Curve
    joints: Curve
    contacts: ContactSchedule
    ramp: float = 0.3

    @property
    def duration(self) -> float:  # type: ignore[override]
        """Length of the motion [s]."""
        return self.body.duration

    def at(self, t: float) -> Reference:
        """The reference at ``t``; see ``MotionPlan.at``."""
        body = body_target(self.point, self.body.at(t))
        return reference(body, self.joints.at(t), self.contacts.at(t), self.ramp)


def reference(body: BodyTarget, joints: CurvePoint, phase: ContactPhase, ramp: float) -> Reference:
    """The reference of feet that stand and of raised legs that follow their joints.

    Args:
        body: what the trunk does.
        joints: angles [rad] (12,) with their derivatives.
        phase: who stands, and for how long.
        ramp: time [s] over which a foot is unloaded before lift-off and loaded after touchdown.
    """
    share, zeros = phase.load_share(ramp), np.zeros((4, 3))
    return Reference(
        body=body,
        legs=tuple(LegTask.STANCE if s else LegTask.JOINTS for s in phase.stance),
        normal_force_min=NORMAL_FORCE_MIN * share,
        normal_force_max=NORMAL_FORCE_MAX * share,
        p_world_feet=zeros,
        v_world_feet=zeros,
        a_world_feet=zeros,
        q_joints=joints.value,
        v_joints=joints.rate,
        a_joints=joints.acceleration,
    )


def body_target(point: TrackedPoint, body: CurvePoint) -> BodyTarget:
    """Body target from a curve point (6,) of position [m] and roll, pitch, yaw [rad]."""
    w, dw = angular_velocity_from_rpy(body.value[3:], body.rate[3:], body.acceleration[3:])
    roll, pitch, yaw = body.value[3:]
    return BodyTarget(
        point=point,
        p_world=body.value[:3],
        v_world=body.rate[:3],
        a_world=body.acceleration[:3],
        R_world_base=rotation_from_rpy(float(roll), float(pitch), float(yaw)),
        w_world=w,
        dw_world=dw,
    )
