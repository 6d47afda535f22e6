"""References of a trunk that moves over feet that stand or step.

``reference`` says what they are; ``reference_row`` is its compiled form.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from jaxtyping import Float

from go2_wbc.curves import CurvePoint
from go2_wbc.reference import BodyTarget, LegTask, Reference, TrackedPoint
from go2_wbc.robot.rotations import angular_velocity_from_rpy, rotation_from_rpy
from go2_wbc.tracking.plan_curves import standing_target

NORMAL_FORCE_MIN = 0.0
"""Least normal force [N] asked of a foot: none, so that a pushed robot may tip and come back."""
NORMAL_FORCE_MAX = 400.0
"""Greatest normal force [N]: 2.5 times the robot's weight, never active in slow motions."""


def reference(
    point: TrackedPoint,
    body: CurvePoint,
    joints: CurvePoint,
    feet: CurvePoint,
    tasks: Sequence[LegTask],
    load_share: Float[np.ndarray, "4"],
) -> Reference:
    """The reference of a trunk and four legs.

    Args:
        point: which point the first three components of ``body`` move.
        body: x, y, z [m] and roll, pitch, yaw [rad] (6,) with their derivatives.
        joints: angles [rad] (12,) with their derivatives.
        feet: places of the feet's centres [m] (12,) with their derivatives.
        tasks: what each of the four legs does.
        load_share: share of its load that a foot may bear.
    """
    w, dw = angular_velocity_from_rpy(body.value[3:], body.rate[3:], body.acceleration[3:])
    roll, pitch, yaw = body.value[3:]
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
        legs=tuple(tasks),
        normal_force_min=NORMAL_FORCE_MIN * load_share,
        normal_force_max=NORMAL_FORCE_MAX * load_share,
        p_world_feet=feet.value.reshape(4, 3),
        v_world_feet=feet.rate.reshape(4, 3),
        a_world_feet=feet.acceleration.reshape(4, 3),
        q_joints=joints.value,
        v_joints=joints.rate,
        a_joints=joints.acceleration,
    )


def reference_row(point: TrackedPoint, body: CurvePoint) -> Float[np.ndarray, " size"]:
    """The row of ``reference`` for four feet that stand, by a kernel."""
    curves = np.array([body.value, body.rate, body.acceleration])
    return standing_target(point, curves, NORMAL_FORCE_MIN, NORMAL_FORCE_MAX).row
