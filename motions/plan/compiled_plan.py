"""A motion as cubics and contacts, ready to be played; and what could not be done as written.

Its parts that are solved obey the whole robot's dynamics: where and when, and their curves.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace

import numpy as np
import pinocchio as pin
from jaxtyping import Bool, Float, Int
from scipy.interpolate import CubicHermiteSpline, PPoly
from scipy.spatial.transform import Rotation

from go2_wbc.arguments import typed
from go2_wbc.brief import inline_html
from go2_wbc.contacts import TIE, ContactPhase, ContactSchedule
from go2_wbc.errors import MotionError
from go2_wbc.legs import Leg
from go2_wbc.motion_plan import Footsteps, HeldFoot, MotionPlan, PlanFeedback, Posture
from go2_wbc.reference import Anchor, LegTask, Reference, TrackedPoint
from go2_wbc.robot.model import RobotModel
from go2_wbc.robot.rotations import rpy_from_rotation, yaw_rotation
from go2_wbc.tracking.plan_curves import CURVES, PlanCurves, StanceLoad
from motions.batch_kinematics import Wanted, attitudes
from motions.dynamics.dynamic_trajectory import BALANCING_FEET, DynamicTrajectory, sampled
from motions.dynamics.phases import PhaseProblem, Tolerance
from motions.dynamics.solver import PlanTarget
from motions.postures import NORMAL_FORCE_MAX, NORMAL_FORCE_MIN


@dataclass(frozen=True, slots=True)
class DynamicSpan:
    """Part of a plan that obeys the whole robot's dynamics."""

    start: float  #: when [s] it starts in the plan
    frame: Anchor  #: where: the frame of its problem in that of the plan
    asked: PhaseProblem | PlanTarget
    """Phases, or a motion that physics does not allow as it was written, in ``frame``."""
    trajectory: DynamicTrajectory
    """States, torques, forces, gains and deviation; in the plan's frame."""
    tolerance: Tolerance = Tolerance()  #: how far it may be from what was asked

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

    def step_at(self, t: float) -> int:
        """Row of the trajectory's forces and torques that belongs to ``t`` [s] of the plan."""
        plan = self.trajectory
        row = int(np.searchsorted(plan.times, t - self.start, side="right")) - 1
        return min(max(row, 0), len(plan.tau) - 1)

    def feedback_at(self, t: float) -> PlanFeedback | None:
        """The feedback at ``t`` [s] of the plan, if two feet or one stand then.

        The planned state is that of the curves that are played, for which see ``centred``.
        """
        plan, row = self.trajectory, self.step_at(t)
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
    """A span at k instants."""

    q: Float[np.ndarray, "k 19"]  #: (k, 19) configurations, between the knots as the solver steps
    v: Float[np.ndarray, "k 18"]  #: (k, 18) velocities, likewise
    a: Float[np.ndarray, "k 18"]  #: (k, 18) accelerations
    tau: Float[np.ndarray, "k 12"]  #: (k, 12) torques [N m]
    forces: Float[np.ndarray, "k 4 3"]  #: (k, 4, 3) forces of the ground on the feet [N]
    v_motors: Float[np.ndarray, "k 12"]
    """(k, 12) joint speeds [rad/s] at which the motors must give the torques: of those at both ends
    of the step, through which a torque holds, the one at which they give less."""


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


LANDING_RAMP = 0.01
"""Time [s] over which a foot takes up its load after a flight: own choice, a few ticks. Landing
takes 0.1 s, and the forces that it needs are planned."""
FORCE_WEIGHT = 1e-2
"""Weight [1/N^2] by which the forces of a solved part are kept to: they lie in the friction cone
that it was solved with, an even share of the load may not. From 0.001 to 0.1 it makes no difference
to slips (own experiments)."""
_CUBIC = 4  #: Coefficients of a cubic
LEAST_FEET = 3
"""Standing feet that span an area, so that a robot that stops there can keep standing."""


@dataclass(frozen=True, slots=True)
class Problem:
    """What cannot be done as it is written."""

    check: str  #: what the feasibility check calls it
    subject: str  #: the leg, or the trunk
    time: float  #: when [s] it is worst
    miss: float = np.nan
    """Distance [m] by which the leg is too short; nan if that is not what is wrong."""
    reason: str = ""  #: why no pose is balanced


@dataclass(frozen=True, slots=True, kw_only=True)
class PlanSamples(Wanted):
    """The part of many references that says where the robot shall be."""

    times: Float[np.ndarray, " n"]  #: (n,) [s]
    stance: Bool[np.ndarray, "n 4"]  #: (n, 4) feet that stand
    normal_force_max: Float[np.ndarray, "n 4"]  #: (n, 4) greatest normal force [N] of each foot

    @staticmethod
    def one_by_one(
        plan: MotionPlan, times: Float[np.ndarray, " n"], p_feet: Float[np.ndarray, "*n 4 3"]
    ) -> PlanSamples:
        """The samples of any plan, by its ``at``; its feet stand at ``p_feet``."""
        references = [plan.at(float(t)) for t in times]
        swings = np.array([[t is LegTask.SWING for t in one.legs] for one in references])
        swung = np.array([one.p_world_feet for one in references])
        return PlanSamples(
            times=times,
            p=np.array([one.body.p_world for one in references]),
            is_com=np.array([one.body.point is TrackedPoint.COM for one in references]),
            R=np.array([one.body.R_world_base for one in references]),
            q_joints=np.array([one.q_joints for one in references]),
            stance=np.array([one.stance for one in references]),
            p_feet=np.where(swings[:, :, None], swung, p_feet),
            raised=np.array([[t is LegTask.JOINTS for t in one.legs] for one in references]),
            normal_force_max=np.array([one.normal_force_max for one in references]),
        )


@dataclass(frozen=True, slots=True)
class CompiledPlan(MotionPlan):
    """A timeline, ready to be played.

    Attributes:
        name, entry, exit: see ``MotionPlan``.
        curves: cubics of CoM [m], roll, pitch, yaw [rad], the twelve joints [rad] and the places of
            the four feet's centres [m]: (30,).
        contacts: who stands when.
        swings: (m, 4) at each event of ``contacts``, the feet in the air that follow their places;
            the others in the air follow their joints.
        ramp: time [s] over which a foot is unloaded before lift-off and loaded after touchdown.
        problems: what could not be done as written.
        spans, beats: start and end [s] of the named holds, and instants [s] that it counts in.
        dynamic: its parts that obey the whole robot's dynamics.
        held: by the names of spans, the foot that must be held up then; see ``held_feet``.
    """

    name: str
    entry: Posture
    exit: Posture
    curves: PPoly
    contacts: ContactSchedule
    swings: Bool[np.ndarray, "m 4"]
    ramp: float
    problems: tuple[Problem, ...]
    spans: Mapping[str, tuple[float, float]]
    beats: tuple[float, ...] = ()
    dynamic: tuple[DynamicSpan, ...] = ()
    held: Mapping[str, Leg] = field(default_factory=dict)
    _asked: PlanCurves = field(init=False, repr=False)

    _repr_html_ = inline_html

    def __repr__(self) -> str:
        ends = f"{self.entry.value} to {self.exit.value}"
        return f"CompiledPlan({self.name!r}, {self.duration:.2f} s, {ends})"

    def __post_init__(self) -> None:
        """Bind what the kernel reads; raise MotionError for other curves, or lengths of tables."""
        contacts, curves = self.contacts, self.curves
        shape = curves.c.shape
        if len(shape) != 3 or shape[::2] != (_CUBIC, CURVES) or curves.x[0] != 0.0:
            raise MotionError(
                f"plan {self.name!r}: curves must be {CURVES} cubics from 0 s on, got {list(shape)}"
            )
        if self.swings.shape != contacts.modes.shape:
            raise MotionError(
                f"plan {self.name!r}: swings must have a row for each of {len(contacts.times)} "
                f"contact events, got {list(self.swings.shape)}"
            )
        in_air = np.where(self.swings, float(LegTask.SWING), float(LegTask.JOINTS))
        tasks = np.where(contacts.modes, float(LegTask.STANCE), in_air)
        since, until = self._gradual(contacts.since, -np.inf), self._gradual(contacts.until, np.inf)
        load = StanceLoad(self.ramp, NORMAL_FORCE_MIN, NORMAL_FORCE_MAX)
        asked = PlanCurves(curves.x, curves.c, np.array(contacts.times), tasks, since, until, load)
        object.__setattr__(self, "_asked", asked)

    @property
    def has_dynamic_spans(self) -> bool:
        """Whether some of it is solved; see ``MotionPlan.has_dynamic_spans``."""
        return bool(self.dynamic)

    @property
    def duration(self) -> float:  # type: ignore[override]
        """Length of the motion [s]."""
        return float(self.curves.x[-1])

    @property
    def footsteps(self) -> Footsteps | None:
        """How its feet step, if any does; see ``MotionPlan.footsteps``."""
        if not self.swings.any():
            return None
        ramp = min(self.ramp, LANDING_RAMP) if self.dynamic else self.ramp
        return Footsteps(
            contacts=self.contacts,
            swings=self.swings,
            unloads=np.where(
                self.contacts.modes, self._gradual(self.contacts.until, np.inf), np.inf
            ),
            ramp=ramp,
            normal_force_min=NORMAL_FORCE_MIN,
            normal_force_max=NORMAL_FORCE_MAX,
        )

    @property
    def end_pose(self) -> tuple[float, float, float]:
        """Where it ends: x, y [m] and yaw [rad] of the frame of the feet, in that of the motion."""
        return Anchor.of_feet(self.curves(self.duration)[18:].reshape(4, 3), 0.0).pose

    @property
    def held_feet(self) -> tuple[HeldFoot, ...]:
        """Feet that it holds up; see ``MotionPlan.held_feet``."""
        found = []
        for name, leg in self.held.items():
            start, end = self.spans[name]
            height = float(self.curves(0.5 * (start + end))[18 + 3 * leg + 2])
            found.append(HeldFoot(name, leg, start, end, height))
        return tuple(found)

    @property
    def is_dynamic(self) -> bool:
        """Whether fewer than three feet stand at any time; see ``MotionPlan.is_dynamic``."""
        return bool((self.contacts.modes.sum(axis=1) < LEAST_FEET).any())

    @typed()
    def at(self, t: float) -> Reference:
        """The reference at ``t``; see ``MotionPlan.at``."""
        return Reference.of_row(self.row_at(t))

    @typed(late=True)
    def row_at(self, t: float) -> Float[np.ndarray, " size"]:
        """Its numbers, by a kernel; see ``MotionPlan.row_at``."""
        target, span = self._asked.at(t), self._span_at(t)
        if span is not None:
            target.f_world_feet[:] = span.trajectory.forces[span.step_at(t)]
            target.force_weight = FORCE_WEIGHT
        return target.row

    def feedback_at(self, t: float) -> PlanFeedback | None:
        """Of the span at ``t``, on two feet or one; see ``MotionPlan.feedback_at``."""
        span = self._span_at(t)
        return None if span is None else span.feedback_at(t)

    def _span_at(self, t: float) -> DynamicSpan | None:
        return next((span for span in self.dynamic if span.start <= t < span.end), None)

    def _gradual(self, changes: Float[np.ndarray, "m 4"], never: float) -> Float[np.ndarray, "m 4"]:
        """``changes`` of contacts [s] but those in dynamic spans: there forces jump as planned."""
        table = changes.copy()
        for span in self.dynamic:
            table[(changes > span.start - TIE) & (changes < span.end + TIE)] = never
        return table

    @typed(late=True)
    def samples(self, times: Float[np.ndarray, " n"]) -> PlanSamples:
        """What the references at ``times`` ask for; ``at`` gives the same one by one."""
        values = self.curves(np.clip(times, 0.0, self.duration))
        rows, asked = event_at(self.contacts, times), self._asked
        elapsed = np.maximum(times[:, None] - asked.since[rows], 0.0)
        left = asked.until[rows] - times[:, None]
        phase = ContactPhase(self.contacts.modes[rows], elapsed, left)
        return PlanSamples(
            times=times,
            p=values[:, :3],
            is_com=np.ones(len(times), dtype=bool),
            R=attitudes(values[:, 3:6]),
            q_joints=values[:, 6:18],
            stance=phase.stance,
            raised=~(phase.stance | self.swings[rows]),
            p_feet=values[:, 18:].reshape(-1, 4, 3),
            normal_force_max=NORMAL_FORCE_MAX * phase.load_share(self.ramp),
        )


def event_at(contacts: ContactSchedule, times: Float[np.ndarray, " n"]) -> Int[np.ndarray, " n"]:
    """Index of the last event at or before each of ``times`` [s], of a schedule that ends."""
    event = np.searchsorted(contacts.times, times + TIE, side="right") - 1
    return np.maximum(event, 0)
