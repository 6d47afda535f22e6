"""A solved dynamic block in a plan: where and when it takes place, and its curves."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
import pinocchio as pin
from jaxtyping import Float
from scipy.interpolate import CubicHermiteSpline, PPoly
from scipy.spatial.transform import Rotation

from go2_wbc.errors import MotionError
from go2_wbc.motion_plan import PlanFeedback
from go2_wbc.reference import Anchor
from go2_wbc.robot.model import RobotModel
from go2_wbc.robot.rotations import rpy_from_rotation, yaw_rotation
from motions.dynamics.curves import sampled
from motions.dynamics.dynamic_trajectory import BALANCING_FEET, DynamicTrajectory
from motions.dynamics.phases import PhaseProblem, Tolerance
from motions.dynamics.projection import PlanTarget


@dataclass(frozen=True, slots=True)
class DynamicSpan:
    """Part of a plan that obeys the whole robot's dynamics.

    Attributes:
        start: when [s] it starts in the plan.
        frame: where: the frame of its problem in that of the plan.
        asked: phases, or a motion that physics does not allow as it was written, in ``frame``.
        trajectory: states, torques, forces, gains and deviation; in the plan's frame.
        tolerance: how far it may be from what was asked.
    """

    start: float
    frame: Anchor
    asked: PhaseProblem | PlanTarget
    trajectory: DynamicTrajectory
    tolerance: Tolerance = Tolerance()

    @property
    def end(self) -> float:
        """When [s] it ends in the plan."""
        return self.start + self.trajectory.duration

    def written(self, times: Float[np.ndarray, " k"]) -> Float[np.ndarray, "k 19"]:
        """Configurations at ``times`` [s] of the plan as they were written, in its frame.

        Raises:
            MotionError: if phases were asked, not a whole motion.
        """
        if not isinstance(self.asked, PlanTarget):
            raise MotionError("of a span that was asked by phases no way was written")
        q = self.asked.at(times - self.start)
        turn = Rotation.from_euler("z", self.frame.yaw)
        q[:, :3] = turn.apply(q[:, :3]) + self.frame.p_world
        q[:, 3:7] = (turn * Rotation.from_quat(q[:, 3:7])).as_quat()
        return q

    def at(self, times: Float[np.ndarray, " k"], model: RobotModel) -> SpanSamples:
        """States, torques and forces at ``times`` [s] of the plan, within the span."""
        plan = self.trajectory
        rows = np.searchsorted(plan.times, times - self.start, side="right") - 1
        rows = np.clip(rows, 0, len(plan.tau) - 1)
        steps = np.diff(plan.times)[rows]
        share = np.clip((times - self.start - plan.times[rows]) / steps, 0.0, 1.0)[:, None]
        a = (plan.v[rows + 1] - plan.v[rows]) / steps[:, None]
        ways = share * steps[:, None] * plan.v[rows + 1]
        q = [
            pin.integrate(model.pin_model, plan.q[k], way)
            for k, way in zip(rows, ways, strict=True)
        ]
        return SpanSamples(
            q=np.array(q).reshape(-1, 19),
            v=(1.0 - share) * plan.v[rows] + share * plan.v[rows + 1],
            a=a,
            tau=plan.tau[rows],
            forces=plan.forces[rows],
            v_motors=np.where(
                plan.tau[rows] < 0.0,
                np.minimum(plan.v[rows, 6:], plan.v[rows + 1, 6:]),
                np.maximum(plan.v[rows, 6:], plan.v[rows + 1, 6:]),
            ),
        )

    def forces_at(self, t: float) -> Float[np.ndarray, "4 3"]:
        """Forces [N] on the feet that it was solved with, at ``t`` [s] of the plan."""
        return self.trajectory.forces[self._step_at(t)]

    def _step_at(self, t: float) -> int:
        plan = self.trajectory
        row = int(np.searchsorted(plan.times, t - self.start, side="right")) - 1
        return min(max(row, 0), len(plan.tau) - 1)

    def feedback_at(self, t: float) -> PlanFeedback | None:
        """The feedback at ``t`` [s] of the plan, if two feet or one stand then.

        The planned state is that of the curves that are played, for which see ``centred``.
        """
        plan, row = self.trajectory, self._step_at(t)
        if not 1 <= plan.stance[row].sum() <= BALANCING_FEET:
            return None
        step = float(plan.times[row + 1] - plan.times[row])
        share = (t - self.start - float(plan.times[row])) / step
        v = (1.0 - share) * plan.v[row] + share * plan.v[row + 1]
        way = step * (share * plan.v[row + 1] - 0.5 * v)
        base = pin.XYZQUATToSE3(plan.q[row, :7]) * pin.exp6(way[:6])
        q = np.concatenate([pin.SE3ToXYZQUAT(base), plan.q[row, 7:] + way[6:]])
        return PlanFeedback(q, v, plan.gains[row])


@dataclass(frozen=True, slots=True)
class SpanSamples:
    """A span at k instants.

    Attributes:
        q, v: (k, 19), (k, 18) states, between the knots as the solver steps.
        a: (k, 18) accelerations.
        tau: (k, 12) torques [N m].
        forces: (k, 4, 3) of the ground on the feet [N].
        v_motors: (k, 12) joint speeds [rad/s] at which the motors must give the torques: of those
            at both ends of the step, through which a torque holds, the one at which they give less.
    """

    q: Float[np.ndarray, "k 19"]
    v: Float[np.ndarray, "k 18"]
    a: Float[np.ndarray, "k 18"]
    tau: Float[np.ndarray, "k 12"]
    forces: Float[np.ndarray, "k 4 3"]
    v_motors: Float[np.ndarray, "k 12"]


def placed(trajectory: DynamicTrajectory, anchor: Anchor) -> DynamicTrajectory:
    """``trajectory`` with the frame of its problem put at ``anchor``."""
    R, turn = yaw_rotation(anchor.yaw), pin.Quaternion(yaw_rotation(anchor.yaw))
    q = trajectory.q.copy()
    q[:, :3] = anchor.p_world + q[:, :3] @ R.T
    q[:, 3:7] = [(turn * pin.Quaternion(xyzw)).coeffs() for xyzw in q[:, 3:7]]
    return replace(
        trajectory,
        q=q,
        forces=trajectory.forces @ R.T,
        p_feet=anchor.p_world + trajectory.p_feet @ R.T,
    )


def curves_of(
    trajectory: DynamicTrajectory, model: RobotModel, end: Float[np.ndarray, "30"]
) -> PPoly:
    """The curves of ``CompiledPlan`` that play ``trajectory``, from its start to rest at ``end``.

    What is left to ``end``, some millimetres, is made up for while the last phase stands.
    """
    times = trajectory.times
    values, rates = sampled(trajectory, model)
    moves = ~trajectory.stance.all(axis=1)
    first = int(np.flatnonzero(moves)[-1]) + 1 if moves.any() else 0
    values[:, 5] += 2.0 * np.pi * np.round((end[5] - values[-1, 5]) / (2.0 * np.pi))
    _lead_to(end, times, values, rates, first)
    return CubicHermiteSpline(times, values, rates)


def attitude_angles(q: Float[np.ndarray, "n 19"]) -> Float[np.ndarray, "n 3"]:
    """Roll, pitch, yaw [rad] of the trunk, whole turns added up from the first row on."""
    turns = [pin.Quaternion(row[3:7]).toRotationMatrix() for row in q]
    return np.unwrap([rpy_from_rotation(R) for R in turns], axis=0)


def _lead_to(
    end: Float[np.ndarray, "30"],
    times: Float[np.ndarray, " n"],
    values: Float[np.ndarray, "n 30"],
    rates: Float[np.ndarray, "n 30"],
    first: int,
) -> None:
    """Add cubics from nothing at knot ``first`` to what is left to ``end`` at the last one."""
    length = times[-1] - times[first]
    s = ((times[first:] - times[first]) / length)[:, None]
    off, slope = end - values[-1], -rates[-1] * length
    values[first:] += (3.0 * off - slope) * s**2 + (slope - 2.0 * off) * s**3
    rates[first:] += (2.0 * (3.0 * off - slope) * s + 3.0 * (slope - 2.0 * off) * s**2) / length
