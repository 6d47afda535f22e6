"""A plan as a trajectory of the whole robot: the motion of every joint under perfect tracking.

The references give the CoM, the trunk's attitude and the raised legs. The rest follows: stance feet
stay at their footholds, so the trunk's position is the one that puts the CoM on its reference, and
the stance legs' angles come from closed-form inverse kinematics. Velocities and accelerations are
those of a cubic spline through the samples. Dynamic spans have their own states.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
import pinocchio as pin
from jaxtyping import Bool, Float

from go2_wbc.brief import brief
from go2_wbc.errors import MotionError
from go2_wbc.motion_plan import MotionPlan
from go2_wbc.recording import true_runs
from go2_wbc.robot.model import RobotModel
from motions import batch_kinematics
from motions.dynamics.solver import PlanTarget
from motions.memory import Memory
from motions.plan.compiled_plan import CompiledPlan, DynamicSpan, PlanSamples
from motions.plan.tracks import anchored_times
from motions.postures import standing_feet

LEAST_SHARE = 1e-6
"""Share of its load below which a foot bears nothing: at the instant of a touchdown it is 0 but for
rounding, and a foot more among which the load is shared changes the shares of the others."""
CENTRING_STEPS = 5  #: Steps that put the CoM in its place; see ``place``


@dataclass(frozen=True, slots=True)
class Trajectory:
    """A motion of the whole robot, in the frame of the motion."""

    times: Float[np.ndarray, " n"]  #: (n,) [s]
    q: Float[np.ndarray, "n 19"]  #: (n, 19) position, quaternion, joints
    v: Float[np.ndarray, "n 18"]  #: (n, 18) its velocity, of the base in its own frame
    a: Float[np.ndarray, "n 18"]  #: (n, 18) its acceleration, likewise
    rpy: Float[np.ndarray, "n 3"]  #: (n, 3) roll, pitch, yaw [rad] of the trunk
    p_com: Float[np.ndarray, "n 3"]  #: (n, 3) CoM [m]
    stance: Bool[np.ndarray, "n 4"]  #: (n, 4) feet that stand
    swings: Bool[np.ndarray, "n 4"]
    """(n, 4) feet in the air that follow their places; the others follow their joints."""
    load_share: Float[np.ndarray, "n 4"]  #: (n, 4) share of its load that each may bear
    p_feet: Float[np.ndarray, "n 4 3"]
    """(n, 4, 3) where the feet are [m] of legs that do not follow their joints."""
    miss: Float[np.ndarray, "n 4"]
    """(n, 4) distance [m] by which such a foot is out of its leg's reach."""
    is_dynamic: Bool[np.ndarray, " n"]
    """(n,) instants in spans that obey the whole robot's dynamics, of which they are."""

    __repr__ = brief


def samples_of(plan: MotionPlan, model: RobotModel) -> PlanSamples:
    """What ``plan`` asks for; of one that does not say where, the feet stand below the hips.

    Raises:
        MotionError: if the plan is not finite.
    """
    times = anchored_times(plan.duration)
    is_compiled = isinstance(plan, CompiledPlan)
    p_feet = standing_feet(model)
    asked = plan.samples(times) if is_compiled else PlanSamples.one_by_one(plan, times, p_feet)
    _require_finite(asked)
    return asked


def trajectory_of(
    plan: MotionPlan,
    model: RobotModel,
    memory: Memory | None = None,
    asked: PlanSamples | None = None,
    near: Float[np.ndarray, "3"] | None = None,
) -> Trajectory:
    """The trajectory of ``plan``.

    Args:
        plan, model: what moves.
        memory: of plans that are like it.
        asked: what it asks for, or a part of that, which is in no dynamic span where it ends.
        near: roll, pitch, yaw [rad] of that part at first but for whole turns.

    Raises:
        MotionError: if the plan is not finite.
    """
    asked = samples_of(plan, model) if asked is None else asked
    times = asked.times
    rpy = np.unwrap(batch_kinematics.angles_of(asked.R), axis=0)
    if near is not None:
        rpy += 2.0 * np.pi * np.round((near - rpy[0]) / (2.0 * np.pi))
    placed = batch_kinematics.place(
        replace(asked, R=batch_kinematics.attitudes(rpy)), CENTRING_STEPS, model, memory
    )
    q = batch_kinematics.configurations(np.hstack([placed.p_base, rpy]), placed.q_joints)
    spans = plan.dynamic if isinstance(plan, CompiledPlan) else ()
    is_dynamic = are_within(times, spans)
    v, a = np.zeros((len(times), 18)), np.zeros((len(times), 18))
    for rows in true_runs(~is_dynamic):
        if rows.stop - rows.start > 1:
            v[rows], a[rows] = batch_kinematics.rates(times[rows], q[rows], rpy[rows])
    greatest = asked.normal_force_max
    share = greatest / max(float(greatest.max()), 1e-9)
    path = Trajectory(
        times=times,
        q=q,
        v=v,
        a=a,
        rpy=rpy,
        p_com=placed.p_com,
        stance=asked.stance,
        swings=~(asked.stance | asked.raised),
        load_share=np.where(share < LEAST_SHARE, 0.0, share),
        p_feet=asked.p_feet,
        miss=placed.miss,
        is_dynamic=is_dynamic,
    )
    for span in spans:
        _fill(path, span, model)
    return path


def as_written(plan: MotionPlan, path: Trajectory) -> Float[np.ndarray, "n 19"]:
    """Configurations along ``path``, the trajectory of ``plan``, as they were written.

    They differ where the robot could not do what was written, and the nearest motion that it can do
    was planned.
    """
    q = path.q.copy()
    for span in plan.dynamic if isinstance(plan, CompiledPlan) else ():
        if isinstance(span.asked, PlanTarget):
            inside = (path.times >= span.start) & (path.times <= span.end)
            q[inside] = span.written(path.times[inside])
    return q


def are_within(
    times: Float[np.ndarray, " n"], spans: Sequence[DynamicSpan]
) -> Bool[np.ndarray, " n"]:
    """Which of ``times`` [s] are in one of ``spans``."""
    within = np.zeros(len(times), dtype=bool)
    for span in spans:
        within |= (times >= span.start) & (times < span.end)
    return within


def _fill(path: Trajectory, span: DynamicSpan, model: RobotModel) -> None:
    """Put the span's own states into its rows of ``path``."""
    rows = are_within(path.times, [span])
    if not rows.any():
        return
    found = span.at(path.times[rows], model)
    path.q[rows], path.v[rows], path.a[rows] = found.q, found.v, found.a
    turns = np.array([pin.Quaternion(q[3:7]).toRotationMatrix() for q in found.q])
    own = np.unwrap(batch_kinematics.angles_of(turns), axis=0)
    path.rpy[rows] = own + 2.0 * np.pi * np.round((path.rpy[rows][:1] - own[:1]) / (2.0 * np.pi))
    poses = np.hstack([found.q[:, :3], path.rpy[rows]])
    path.p_com[rows] = batch_kinematics.centres_of_mass(poses, found.q[:, 7:], model)
    path.miss[rows] = 0.0


def _require_finite(asked: PlanSamples) -> None:
    parts = (asked.p, asked.R, asked.q_joints, asked.p_feet)
    if not all(np.isfinite(part).all() for part in parts):
        is_finite = np.isfinite(np.hstack([part.reshape(len(part), -1) for part in parts])).all(
            axis=1
        )
        t = float(asked.times[int(np.argmin(is_finite))])
        raise MotionError(f"the plan is not finite at t={t:.2f} s")
