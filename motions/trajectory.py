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
from scipy.spatial.transform import Rotation

from go2_wbc.errors import MotionError
from go2_wbc.legs import LEGS
from go2_wbc.reference import LegTask, MotionPlan, Reference, TrackedPoint
from go2_wbc.robot.leg_kinematics import LegGeometry, leg_angles
from go2_wbc.robot.model import RobotModel
from go2_wbc.robot.rotations import angular_velocity_from_rpy, rpy_from_rotation
from motions.tracks import attitudes, sample_times, standing_feet

CENTRING_STEPS = 5
"""Steps that put the CoM in its place; each leaves an eighth of the error (measured).

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

    def placed(self, p_base: Float[np.ndarray, "n 3"]) -> Float[np.ndarray, "n 3"]:
        """Points of the base [m], one an instant, in the frame of the motion."""
        return self.q[:, :3] + attitudes(self.rpy).apply(p_base)


def trajectory_of(plan: MotionPlan, model: RobotModel) -> Trajectory:
    """The trajectory of ``plan``; the feet stand below the hips, and land where they stood.

    Raises:
        MotionError: if the plan is not finite.
    """
    times = sample_times(plan.duration)
    references = [plan.at(float(t)) for t in times]
    for t, reference in zip(times, references, strict=True):
        parts = (reference.body.p_world, reference.body.R_world_base.ravel(), reference.q_joints)
        if not np.isfinite(np.concatenate(parts)).all():
            raise MotionError(f"the plan is not finite at t={t:.2f} s")
    R = [reference.body.R_world_base for reference in references]
    rpy = np.unwrap(np.array([rpy_from_rotation(rotation) for rotation in R]), axis=0)
    attitude, p_feet = attitudes(rpy), standing_feet(model)
    q, miss = _configurations(references, attitude, p_feet, model)
    v, a = _rates(times, q, rpy, attitude)
    greatest = np.array([reference.normal_force_max for reference in references])
    return Trajectory(
        times=times,
        q=q,
        v=v,
        a=a,
        rpy=rpy,
        p_com=np.array([model.center_of_mass(row) for row in q]),
        stance=np.array([reference.stance for reference in references]),
        load_share=greatest / max(float(greatest.max()), 1e-9),
        p_feet=p_feet,
        miss=miss,
    )


def _configurations(
    references: list[Reference],
    attitude: Rotation,
    p_feet: Float[np.ndarray, "4 3"],
    model: RobotModel,
) -> tuple[Float[np.ndarray, "n 19"], Float[np.ndarray, "n 4"]]:
    """Configurations whose CoM is as asked, and what standing legs miss [m].

    With the feet in their places and the attitude given, the CoM c is a function of the base's
    place p alone; p <- p + (c* - c(p)) converges, since the legs follow the base only in part.
    """
    wanted = np.array([reference.body.p_world for reference in references])
    is_com = np.array([[r.body.point is TrackedPoint.COM] for r in references])
    raised = np.array([[task is LegTask.JOINTS for task in r.legs] for r in references])
    q = np.hstack([wanted, attitude.as_quat(), np.array([r.q_joints for r in references])])
    base, joints = q[:, :3], q[:, 7:]  # views: q follows them
    miss = np.zeros((len(references), 4))
    for step in range(CENTRING_STEPS + 1):
        for leg in LEGS:
            places = attitude.apply(p_feet[leg] - base, inverse=True)
            found = leg_angles(LegGeometry.of(model, leg), places)
            stands = ~raised[:, leg]
            joints[stands, leg.joints] = found.q[stands]
            miss[:, leg] = np.where(stands, found.miss, 0.0)
        if step < CENTRING_STEPS:
            com = np.array([model.center_of_mass(row) for row in q])
            base += np.where(is_com, wanted - com, 0.0)
    return q, miss


def _rates(
    times: Float[np.ndarray, " n"],
    q: Float[np.ndarray, "n 19"],
    rpy: Float[np.ndarray, "n 3"],
    attitude: Rotation,
) -> tuple[Float[np.ndarray, "n 18"], Float[np.ndarray, "n 18"]]:
    """Velocity and acceleration (n, 18) as Pinocchio counts them: the base's in its own frame.

    With v_b = R' v_w, the acceleration is the derivative of these very components,
    dv_b/dt = R' a_w - w_b x v_b (Featherstone 2008, ch. 2: spatial, not classical); so that of
    w_b = R' w_w is R' dw_w.
    """
    spline = CubicSpline(times, np.hstack([q[:, :3], rpy, q[:, 7:]]), bc_type="clamped")
    rate, acceleration = spline(times, 1), spline(times, 2)
    turns = zip(rpy, rate[:, 3:6], acceleration[:, 3:6], strict=True)
    w_world, dw_world = np.swapaxes([angular_velocity_from_rpy(*turn) for turn in turns], 0, 1)
    worlds = (rate[:, :3], w_world, acceleration[:, :3], dw_world)
    v, w, a, dw = (attitude.apply(vectors, inverse=True) for vectors in worlds)
    return np.hstack([v, w, rate[:, 6:]]), np.hstack([a - np.cross(w, v), dw, acceleration[:, 6:]])
