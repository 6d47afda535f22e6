"""A plan as a trajectory of the whole robot: what every joint would do if all went as planned.

The references say where the CoM, the trunk's attitude and the raised legs shall be. The rest
follows: standing feet stay in their places, so the trunk's place is the one that puts the CoM where
it is wanted, and the standing legs' angles come from closed-form inverse kinematics. Velocities and
accelerations are those of a cubic spline through the samples.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Float
from scipy.interpolate import CubicSpline

from go2_wbc.errors import MotionError
from go2_wbc.legs import LEGS
from go2_wbc.reference import LegTask, MotionPlan, Reference, TrackedPoint
from go2_wbc.robot.leg_kinematics import LegGeometry, leg_angles
from go2_wbc.robot.model import RobotModel
from go2_wbc.robot.rotations import quaternion_from_rpy, rpy_from_rotation
from motions.tracks import standing_feet

SAMPLE_PERIOD = 0.01
"""Time [s] between the instants that are looked at."""
CENTRING_STEPS = 5
"""Steps that put the CoM in its place; the error shrinks by a factor of 8 in each.

The legs are solved once more after the last one, so that the feet are exactly in theirs."""


@dataclass(frozen=True, slots=True)
class Trajectory:
    """A motion of the whole robot, in the frame of the motion.

    Attributes:
        times: (n,) [s].
        q: (n, 19) position, quaternion, joints. v, a: (n, 18) its velocity and acceleration, both
            of the base in its own frame.
        rpy: (n, 3) roll, pitch, yaw [rad] of the trunk.
        p_com: (n, 3) CoM [m].
        stance: (n, 4) feet that stand.
        load_share: (n, 4) share of its load that a foot may bear.
        p_feet: (4, 3) where the feet stand [m].
        miss: (n, 4) distance [m] by which a standing foot is out of its leg's reach.
    """

    times: Float[np.ndarray, " n"]
    q: Float[np.ndarray, "n 19"]
    v: Float[np.ndarray, "n 18"]
    a: Float[np.ndarray, "n 18"]
    rpy: Float[np.ndarray, "n 3"]
    p_com: Float[np.ndarray, "n 3"]
    stance: Bool[np.ndarray, "n 4"]
    load_share: Float[np.ndarray, "n 4"]
    p_feet: Float[np.ndarray, "4 3"]
    miss: Float[np.ndarray, "n 4"]


def trajectory_of(plan: MotionPlan, model: RobotModel) -> Trajectory:
    """The trajectory of ``plan``; the feet stand below the hips, and land where they stood.

    Raises:
        MotionError: if the plan is not finite.
    """
    count = max(round(plan.duration / SAMPLE_PERIOD), 2) + 1
    times = np.linspace(0.0, plan.duration, count)
    references = [plan.at(float(t)) for t in times]
    for t, reference in zip(times, references, strict=True):
        parts = (reference.body.p_world, reference.body.R_world_base.ravel(), reference.q_joints)
        if not np.isfinite(np.concatenate(parts)).all():
            raise MotionError(f"the plan is not finite at t={t:.2f} s")
    R = np.array([reference.body.R_world_base for reference in references])
    rpy = np.unwrap(np.array([rpy_from_rotation(rotation) for rotation in R]), axis=0)
    p_feet = standing_feet(model)
    base, joints, miss = _posed(references, R, rpy, p_feet, model)
    p_com = np.array([_com(model, row) for row in zip(base, rpy, joints, strict=True)])
    q, v, a = _motion(times, base, rpy, R, joints)
    greatest = np.array([reference.normal_force_max for reference in references])
    return Trajectory(
        times=times,
        q=q,
        v=v,
        a=a,
        rpy=rpy,
        p_com=p_com,
        stance=np.array([reference.stance for reference in references]),
        load_share=greatest / max(float(greatest.max()), 1e-9),
        p_feet=p_feet,
        miss=miss,
    )


def _posed(
    references: list[Reference],
    R: Float[np.ndarray, "n 3 3"],
    rpy: Float[np.ndarray, "n 3"],
    p_feet: Float[np.ndarray, "4 3"],
    model: RobotModel,
) -> tuple[Float[np.ndarray, "n 3"], Float[np.ndarray, "n 12"], Float[np.ndarray, "n 4"]]:
    """Base places, joint angles and what standing legs miss, such that the CoM is as asked."""
    wanted = np.array([reference.body.p_world for reference in references])
    is_com = np.array([r.body.point is TrackedPoint.COM for r in references])
    raised = np.array([[task is LegTask.JOINTS for task in r.legs] for r in references])
    base, joints = wanted.copy(), np.array([r.q_joints for r in references])
    miss = np.zeros((len(references), 4))
    for step in range(CENTRING_STEPS + 1):
        for leg in LEGS:
            places = np.einsum("nij,ni->nj", R, p_feet[leg] - base)
            found = leg_angles(LegGeometry.of(model, leg), places)
            stands = ~raised[:, leg]
            joints[stands, leg.joints] = found.q[stands]
            miss[:, leg] = np.where(stands, found.miss, 0.0)
        if step == CENTRING_STEPS:
            break
        com = np.array([_com(model, row) for row in zip(base, rpy, joints, strict=True)])
        base = base + np.where(is_com[:, None], wanted - com, 0.0)
    return base, joints, miss


def _com(model: RobotModel, pose: tuple[np.ndarray, np.ndarray, np.ndarray]) -> np.ndarray:
    base, rpy, joints = pose
    roll, pitch, yaw = rpy.tolist()
    q = np.concatenate([base, quaternion_from_rpy(roll, pitch, yaw), joints])
    return model.center_of_mass(q)


def _motion(
    times: Float[np.ndarray, " n"],
    base: Float[np.ndarray, "n 3"],
    rpy: Float[np.ndarray, "n 3"],
    R: Float[np.ndarray, "n 3 3"],
    joints: Float[np.ndarray, "n 12"],
) -> tuple[Float[np.ndarray, "n 19"], Float[np.ndarray, "n 18"], Float[np.ndarray, "n 18"]]:
    spline = CubicSpline(times, np.hstack([base, rpy, joints]), bc_type="clamped")
    rate, acceleration = spline(times, 1), spline(times, 2)
    quaternions = np.array([quaternion_from_rpy(*row) for row in rpy.tolist()])
    w, dw = _body_rates(rpy, rate[:, 3:6], acceleration[:, 3:6])
    v_base = np.einsum("nij,ni->nj", R, rate[:, :3])
    a_base = np.einsum("nij,ni->nj", R, acceleration[:, :3]) - np.cross(w, v_base)
    return (
        np.hstack([base, quaternions, joints]),
        np.hstack([v_base, w, rate[:, 6:]]),
        np.hstack([a_base, dw, acceleration[:, 6:]]),
    )


def _body_rates(
    rpy: Float[np.ndarray, "n 3"], rate: Float[np.ndarray, "n 3"], second: Float[np.ndarray, "n 3"]
) -> tuple[Float[np.ndarray, "n 3"], Float[np.ndarray, "n 3"]]:
    """Angular velocity and its derivative in the base frame (Diebel 2006, eq. 67 and 74)."""
    (roll, pitch, _), (d_roll, d_pitch, d_yaw) = rpy.T, rate.T
    sr, cr, sp, cp = np.sin(roll), np.cos(roll), np.sin(pitch), np.cos(pitch)
    w = np.column_stack(
        [d_roll - d_yaw * sp, d_pitch * cr + d_yaw * cp * sr, -d_pitch * sr + d_yaw * cp * cr]
    )
    dd_roll, dd_pitch, dd_yaw = second.T
    dw = np.column_stack(
        [
            dd_roll - dd_yaw * sp - d_yaw * d_pitch * cp,
            dd_pitch * cr
            - d_pitch * d_roll * sr
            + dd_yaw * cp * sr
            + d_yaw * (d_roll * cp * cr - d_pitch * sp * sr),
            -dd_pitch * sr
            - d_pitch * d_roll * cr
            + dd_yaw * cp * cr
            - d_yaw * (d_roll * cp * sr + d_pitch * sp * cr),
        ]
    )
    return w, dw
