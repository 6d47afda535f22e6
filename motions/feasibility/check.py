"""``check``: can the robot do this motion? Kinematics first, then forces; nothing is simulated."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from jaxtyping import Float

from go2_wbc.errors import MotionError
from go2_wbc.feasibility_limits import FeasibilityLimits
from go2_wbc.legs import LEGS
from go2_wbc.motion_plan import MotionPlan
from go2_wbc.robot.model import RobotModel
from go2_wbc.world import World
from motions.batch_kinematics import centres_of_mass
from motions.dynamics.phases import Progress
from motions.feasibility import dynamic_spans, friction, kinematic, tracking
from motions.feasibility import forces as dynamics
from motions.feasibility.checked_motion import CheckedMotion, Playable, compile_motion
from motions.feasibility.collision import SelfCollision, self_distance
from motions.feasibility.goal_errors import departure_measurements, departures
from motions.feasibility.hulls import hulls_of
from motions.feasibility.report import FeasibilityReport, Series
from motions.plan.compiled_plan import CompiledPlan, Problem
from motions.plan.trajectory import Trajectory, trajectory_of

BALANCE, WAY = "balance", "way of a foot"
"""Problems of the compiler."""
SLIDING = 0.17
"""Share of the slip that is allowed, from which on a force that lacks for a moment matters."""


class FeasibilityChecker:
    """Checks motions on one robot; loads what it needs once.

    It works with ``model``, and a ``RobotModel`` is for one thread at a time: never check on the
    model of a control loop that runs.

    Attributes:
        model: the robot.
        world: in which motions are checked.
    """

    def __init__(
        self,
        model: RobotModel | None = None,
        limits: FeasibilityLimits | None = None,
        *,
        world: World | None = None,
        progress: Progress | None = None,
    ) -> None:
        """Prepare for ``model``, by default the installed Go2, in ``world``.

        What is uncertain in it counts at its worst. Plans are made for ``model`` as it is: like the
        controller, they know nothing of a payload. ``progress`` is called while a dynamic motion is
        solved, with the number of iterations and the cost.
        """
        self.model = model or RobotModel()
        self.world = world or World()
        self._progress = progress
        self._limits = limits or FeasibilityLimits()
        self._loaded = _loaded(self.model, self.world.worst)
        self._collision = SelfCollision(self.model)
        self._hulls = hulls_of(self.model.description)

    def plan(self, motion: Playable, *, check: bool = True) -> MotionPlan:
        """The plan of ``motion``, compiled and checked no more often than needed.

        Args:
            motion: as for ``check``; of a checked one nothing is done again.
            check: whether it must be feasible.

        Raises:
            CommandError: for an unknown name, or for what stands for no motion.
            TimelineError: if the timeline is empty or its parameters are not valid.
            MotionInfeasible: if the motion breaks a limit; carries the findings.
        """
        plan = self._compiled(motion)
        if check:
            known = motion if isinstance(motion, CheckedMotion) else plan
            self.check(known).raise_if_infeasible()
        return plan

    def check(self, motion: Playable) -> FeasibilityReport:
        """The report on ``motion``; one that was checked before keeps its report.

        Args:
            motion: a name of the library, a motion with its default parameters, a timeline, a plan,
                or a checked motion.

        Raises:
            CommandError: for an unknown name, or for what stands for no motion.
            TimelineError: if the timeline is empty or its parameters are not valid.
        """
        if isinstance(motion, CheckedMotion):
            return motion.report
        plan = self._compiled(motion)
        try:
            return self.evaluate(plan).report
        except MotionError as error:
            unknown = _failed(Problem("numbers", "plan", 0.0, reason=str(error)))
            return FeasibilityReport.of(plan.name, plan.duration, [unknown], world=self.world)

    def _compiled(self, motion: object) -> MotionPlan:
        """The plan of ``motion``, the nearest feasible one where its timeline asks for that."""
        return compile_motion(motion, self.model, mend=self._broken, progress=self._progress)

    def _broken(self, plan: CompiledPlan) -> Float[np.ndarray, " k"]:
        """Instants [s] at which ``plan`` breaks a limit."""
        return np.concatenate([[], *(one.broken_at for one in self.evaluate(plan).report.series)])

    def departure(self, plan: MotionPlan) -> dict[str, float]:
        """How far ``plan`` is from what was written, at most, by name with unit.

        Nothing if it is what was written; by parts, and in words, it stands in the report.
        """
        return departure_measurements(plan, self.model)

    def evaluate(self, motion: Playable) -> CheckedMotion:
        """Compile and check ``motion``, once: its plan, the report, the movement and the forces.

        The result stands for the motion wherever one is asked for: ``GO2Controller.play`` plays its
        plan without compiling or checking it again.

        Args:
            motion: as for ``check``; one that was checked before is returned as it is.

        Raises:
            CommandError: for an unknown name, or for what stands for no motion.
            TimelineError: if the timeline is empty or its parameters are not valid.
            MotionError: if the plan is not finite: then there is no movement to judge.
        """
        if isinstance(motion, CheckedMotion):
            return motion
        plan, model, limits = self._compiled(motion), self.model, self._limits
        path = trajectory_of(plan, model)
        heavy, floor = self._loaded, self.world.worst.friction
        carried = path if heavy is model else _with_load(path, heavy)
        forces = dynamics.forces_of(path, heavy)
        problems, in_flight = (), []
        if isinstance(plan, CompiledPlan):
            problems = plan.problems
            forces = dynamic_spans.with_spans(forces, path, plan, model)
            in_flight = dynamic_spans.judged(plan, model, heavy.mass, floor)
        forces = dynamics.resisted(forces, path, self.world.worst)
        lag = dynamics.lagging(path, forces, heavy, limits)
        off = tracking.tracking(path, forces, heavy, self.world.worst, limits)
        com, zero_moment_point = dynamics.support(carried, forces, limits)
        if carried is not path:  # the controller feels the load, and shifts the CoM back
            com = _lesser(com, dynamics.support(path, forces, limits)[0])
        tips = tracking.tipping(carried, forces, zero_moment_point.values[:, 0], heavy, limits)
        slip = friction.slip(path, forces, heavy, limits, floor)
        is_off, slips = com.is_broken or lag.is_broken, slip.is_broken or lag.is_broken
        wrench, load = dynamics.contacts(path, forces, limits)
        slides = max(map(slip.worst, LEGS)) > SLIDING * limits.slip
        lacks = wrench.worst(0, begin=dynamics.SPREAD) > limits.jolt
        is_lacking = lag.is_broken or (slides and lacks)
        grip = friction.friction(path, forces, heavy, limits, floor)
        landing_place, landing_speed = kinematic.landing(path, model, limits)
        in_order_of_causes = [
            *_missed(problems, limits),
            kinematic.reach(path, limits),
            kinematic.joint_position(path, model, limits),
            self_distance(path, self._collision, model, limits),
            kinematic.clearance(path, model, self._hulls, limits),
            kinematic.dragging(path, model, limits),
            landing_place,
            kinematic.ends(plan, path, model, limits),
            *(_failed(problem) for problem in problems if is_off and problem.check == "balance"),
            com,
            kinematic.joint_speed(path, model),
            landing_speed,
            kinematic.smoothness(path, limits),
            zero_moment_point if lag.is_broken else zero_moment_point.downgraded(),
            wrench if is_lacking else wrench.downgraded(),
            load if slips else load.downgraded(),
            lag,
            tips,
            off,
            grip if slips else grip.downgraded(),
            slip,
            *dynamics.torque(path, forces, model, limits),
            *in_flight,
        ]
        end_pose = plan.end_pose if isinstance(plan, CompiledPlan) else None
        report = FeasibilityReport.of(
            plan.name,
            plan.duration,
            in_order_of_causes,
            end_pose,
            departures=departures(plan, model),
            world=self.world,
        )
        return CheckedMotion(plan, report, path, forces)


def check(
    motion: Playable,
    *,
    friction: float | None = None,
    payload: float | None = None,
    world: World | None = None,
) -> FeasibilityReport:
    """Whether the installed Go2 can do ``motion``; see ``FeasibilityChecker``.

    Args:
        motion: what to check.
        friction: coefficient of the floor, instead of that of ``world``.
        payload: extra mass [kg], instead of that of ``world``.
        world: in which it is checked, ``World()`` by default.

    Raises:
        ConfigError: for a world that is out of range.
    """
    return FeasibilityChecker(world=World.of(friction, payload, world)).check(motion)


def _missed(problems: Sequence[Problem], limits: FeasibilityLimits) -> list[Series]:
    """What else than balance is not as written; a place that a foot nearly reaches is a warning."""
    found = [_failed(problem) for problem in problems if problem.check not in (BALANCE, WAY)]
    for problem in problems:
        if problem.check == WAY:
            times, values = np.array([problem.time]), np.full((1, 1), problem.miss)
            what = (WAY, "m", (problem.subject,), times, values, limits.reach)
            found.append(Series.against(*what, tight=limits.reach))
    return found


def _lesser(one: Series, other: Series) -> Series:
    """The lesser values of two series that may not fall below the same limits."""
    values = np.minimum(one.values, other.values)
    return replace(one, values=values, margins=np.minimum(one.margins, other.margins))


def _failed(problem: Problem) -> Series:
    one, times, subjects = np.ones((1, 1)), np.array([problem.time]), (problem.subject,)
    values = problem.miss * one
    return Series(problem.check, "m", subjects, times, values, 0 * one, -one, note=problem.reason)


def _loaded(model: RobotModel, world: World) -> RobotModel:
    """``model`` with the masses of ``world``; the same one if there is nothing to change."""
    if world.payload == 0.0 and world.mass_scale == 1.0:
        return model
    heavy = RobotModel(
        model.description,
        armature=np.array(model.pin_model.armature[6:]),
        foot_radius=model.foot_radius,
        world=world,
    )
    heavy.motor, heavy.torque_limits = model.motor, model.torque_limits
    return heavy


def _with_load(motion: Trajectory, heavy: RobotModel) -> Trajectory:
    """The same movement with the CoM that the load gives it."""
    poses = np.hstack([motion.q[:, :3], motion.rpy])
    return replace(motion, p_com=centres_of_mass(poses, motion.q[:, 7:], heavy))
