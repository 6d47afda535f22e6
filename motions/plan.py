"""References of a trunk that moves over feet that stand.

``reference`` says what they are; ``reference_row`` is its compiled form.
"""

from __future__ import annotations

import numpy as np
from jaxtyping import Bool, Float

from go2_wbc.curves import CurvePoint
from go2_wbc.kernels.layout import REFERENCE
from go2_wbc.reference import BodyTarget, LegTask, Reference, TrackedPoint
from go2_wbc.robot.rotations import angular_velocity_from_rpy, rotation_from_rpy

NORMAL_FORCE_MIN = 0.0
"""Least normal force [N] asked of a foot: none, so that a pushed robot may tip and come back."""
NORMAL_FORCE_MAX = 400.0
"""Greatest normal force [N]: 2.5 times the robot's weight, never active in slow motions."""


def reference(
    point: TrackedPoint,
    body: CurvePoint,
    joints: CurvePoint,
    stance: Bool[np.ndarray, "4"],
    load_share: Float[np.ndarray, "4"],
) -> Reference:
    """The reference of feet that stand and of raised legs that follow their joints.

    Args:
        point: which point the first three components of ``body`` move.
        body: x, y, z [m] and roll, pitch, yaw [rad] (6,) with their derivatives.
        joints: angles [rad] (12,) with their derivatives.
        stance: feet that stand.
        load_share: share of its load that a foot may bear.
    """
    w, dw = angular_velocity_from_rpy(body.value[3:], body.rate[3:], body.acceleration[3:])
    roll, pitch, yaw = body.value[3:]
    zeros = np.zeros((4, 3))
    return Reference(
        body=BodyTarget(
            point=point,
            p_world=body.value[:3],
            v_world=body.rate[:3],
            a_world=body.acceleration[:3],
            R_world_base=rotation_from_rpy(float(roll), float(pitch), float(yaw)),
            w_world=w,
            dw_world=dw,
        ),
        legs=tuple(LegTask.STANCE if stands else LegTask.JOINTS for stands in stance),
        normal_force_min=NORMAL_FORCE_MIN * load_share,
        normal_force_max=NORMAL_FORCE_MAX * load_share,
        p_world_feet=zeros,
        v_world_feet=zeros,
        a_world_feet=zeros,
        q_joints=joints.value,
        v_joints=joints.rate,
        a_joints=joints.acceleration,
    )


def reference_row(point: TrackedPoint, body: CurvePoint) -> Float[np.ndarray, " size"]:
    """The row of ``reference`` for four feet that stand, by a kernel."""
    from go2_wbc.kernels.playing import planned

    row, curves = np.empty(REFERENCE.size), np.zeros((3, 18))
    curves[0, :6], curves[1, :6], curves[2, :6] = body.value, body.rate, body.acceleration
    is_com = 1.0 if point is TrackedPoint.COM else 0.0
    planned(is_com, curves, _ALL, _ALL, NORMAL_FORCE_MIN, NORMAL_FORCE_MAX, row)
    return row


_ALL = np.ones(4)
