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
from go2_wbc.reference import MotionPlan
from go2_wbc.robot.model import RobotModel
from motions.compiled_plan import CompiledPlan
from motions.placement import Wanted, attitudes, configurations, place, turned, turned_back
from motions.samples import PlanSamples
from motions.tracks import sample_times, standing_feet

CENTRING_STEPS = 5
"""Steps that put the CoM in its place; see ``place``."""


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
        p_feet: (n, 4, 3) where the feet are [m] of legs that do not follow their joints.
        miss: (n, 4) distance [m] by which such a foot is out of its leg's reach.
    """

    times: Float[np.ndarray, " n"]
    q: Float[np.ndarray, "n 19"]
    v: Float[np.ndarray, "n 18"]
    a: Float[np.ndarray, "n 18"]
    rpy: Float[np.ndarray, "n 3"]
    p_com: Float[np.ndarray, "n 3"]
    stance: Bool[np.ndarray, "n 4"]
    load_share: Float[np.ndarray, "n 4"]
    p_feet: Float[np.ndarray, "n 4 3"]
    miss: Float[np.ndarray, "n 4"]

    def placed(self, p_base: Float[np.ndarray, "n 3"]) -> Float[np.ndarray, "n 3"]:
        """Points of the base [m], one an instant, in the frame of the motion."""
        return self.q[:, :3] + turned(attitudes(self.rpy), p_base)


def trajectory_of(plan: MotionPlan, model: RobotModel) -> Trajectory:
    """The trajectory of ``plan``; of one that does not say where, the feet stand below the hips.

    Raises:
        MotionError: if the plan is not finite.
    """
    times = sample_times(plan.duration)
    is_compiled = isinstance(plan, CompiledPlan)
    p_feet = standing_feet(model)
    asked = plan.samples(times) if is_compiled else PlanSamples.one_by_one(plan, times, p_feet)
    _require_finite(asked)
    rpy = np.unwrap(_rpy_of(asked.R_world_base), axis=0)
    R = attitudes(rpy)
    wanted = Wanted(
        p=asked.p_world,
        is_com=asked.is_com,
        R=R,
        q_joints=asked.q_joints,
        raised=asked.raised,
        p_feet=asked.p_feet,
    )
    placed = place(wanted, CENTRING_STEPS, model)
    q = configurations(np.hstack([placed.p_base, rpy]), placed.q_joints)
    v, a = _rates(times, q, rpy, R)
    greatest = asked.normal_force_max
    return Trajectory(
        times=times,
        q=q,
        v=v,
        a=a,
        rpy=rpy,
        p_com=placed.p_com,
        stance=asked.stance,
        load_share=greatest / max(float(greatest.max()), 1e-9),
        p_feet=asked.p_feet,
        miss=placed.miss,
    )


def _require_finite(asked: PlanSamples) -> None:
    count = len(asked.times)
    turns, p_feet = asked.R_world_base.reshape(count, 9), asked.p_feet.reshape(count, 12)
    parts = (asked.p_world, turns, asked.q_joints, p_feet)
    is_finite = np.isfinite(np.hstack(parts)).all(axis=1)
    if not is_finite.all():
        t = float(asked.times[int(np.argmin(is_finite))])
        raise MotionError(f"the plan is not finite at t={t:.2f} s")


def _rpy_of(R: Float[np.ndarray, "n 3 3"]) -> Float[np.ndarray, "n 3"]:
    """Roll, pitch, yaw [rad] of every rotation, the pitch within a quarter turn.

    The roll is that of Rz(-yaw) R, which is well defined where the trunk stands on its end and yaw
    and roll are not told apart.
    """
    yaw = np.arctan2(R[:, 1, 0], R[:, 0, 0])
    pitch = np.arctan2(-R[:, 2, 0], np.hypot(R[:, 0, 0], R[:, 1, 0]))
    s, c = np.sin(yaw), np.cos(yaw)
    roll = np.arctan2(s * R[:, 0, 2] - c * R[:, 1, 2], c * R[:, 1, 1] - s * R[:, 0, 1])
    return np.column_stack([roll, pitch, yaw])


def _rates(
    times: Float[np.ndarray, " n"],
    q: Float[np.ndarray, "n 19"],
    rpy: Float[np.ndarray, "n 3"],
    R: Float[np.ndarray, "n 3 3"],
) -> tuple[Float[np.ndarray, "n 18"], Float[np.ndarray, "n 18"]]:
    """Velocity and acceleration (n, 18) as Pinocchio counts them: the base's in its own frame.

    With v_b = R' v_w, the acceleration is the derivative of these very components,
    dv_b/dt = R' a_w - w_b x v_b (Featherstone 2008, ch. 2: spatial, not classical); so that of
    w_b = R' w_w is R' dw_w.
    """
    spline = CubicSpline(times, np.hstack([q[:, :3], rpy, q[:, 7:]]), bc_type="clamped")
    rate, acceleration = spline(times, 1), spline(times, 2)
    turning = _angular_rates(rpy, rate[:, 3:6], acceleration[:, 3:6])
    v, a = turned_back(R, rate[:, :3]), turned_back(R, acceleration[:, :3])
    w, dw = (turned_back(R, vectors) for vectors in turning)
    return np.hstack([v, w, rate[:, 6:]]), np.hstack([a - np.cross(w, v), dw, acceleration[:, 6:]])


def _angular_rates(
    rpy: Float[np.ndarray, "n 3"],
    rate: Float[np.ndarray, "n 3"],
    acceleration: Float[np.ndarray, "n 3"],
) -> tuple[Float[np.ndarray, "n 3"], Float[np.ndarray, "n 3"]]:
    """World-frame w [rad/s] and dw [rad/s^2] of every row; see ``angular_velocity_from_rpy``."""
    _, p, y = rpy.T
    cp, sp, cy, sy = np.cos(p), np.sin(p), np.cos(y), np.sin(y)
    ahead, aside = np.column_stack([cy, sy, 0.0 * y]), np.column_stack([-sy, cy, 0.0 * y])
    up, (dr, dp, dy) = np.array([0.0, 0.0, 1.0]), rate.T[:, :, None]
    cp, sp = cp[:, None], sp[:, None]
    # w = dr e_roll + dp e_pitch + dy e_yaw; the first two axes turn
    roll_axis, d_roll_axis = cp * ahead - sp * up, cp * dy * aside - sp * dp * ahead - cp * dp * up
    w = roll_axis * dr + aside * dp + up * dy
    ddr, ddp, ddy = acceleration.T[:, :, None]
    dw = roll_axis * ddr + aside * ddp + up * ddy + d_roll_axis * dr - ahead * dy * dp
    return w, dw
