"""``check``: can the robot do this motion? Kinematics first, then forces; nothing is simulated."""

from __future__ import annotations

import numpy as np

from go2_wbc.errors import MotionError, TimelineError
from go2_wbc.reference import MotionPlan
from go2_wbc.robot.model import RobotModel
from motions.authoring import Motion
from motions.balance import Unbalanced
from motions.compiler import CompiledPlan, OutOfReach, compile_timeline
from motions.feasibility import dynamic, kinematic
from motions.feasibility.checked_motion import CheckedMotion
from motions.feasibility.collision import SelfCollision, self_distance
from motions.feasibility.limits import FeasibilityLimits
from motions.feasibility.report import FeasibilityReport, Series
from motions.registry import load_motion
from motions.timeline import Timeline
from motions.trajectory import trajectory_of


class FeasibilityChecker:
    """Checks motions on one robot; loads what it needs once.

    Attributes:
        model: the robot.
    """

    def __init__(
        self, model: RobotModel | None = None, limits: FeasibilityLimits | None = None
    ) -> None:
        """Prepare for ``model``, by default the installed Go2."""
        self.model = model or RobotModel()
        self._limits = limits or FeasibilityLimits()
        self._collision = SelfCollision(self.model)

    def check(self, motion: str | Motion | Timeline | MotionPlan) -> FeasibilityReport:
        """The report on ``motion``.

        Args:
            motion: a name of the library, a motion with its default parameters, a timeline, or a
                plan.

        Raises:
            CommandError: for an unknown name.
            TimelineError: if the timeline is empty, or this is no motion.
        """
        plan = self._plan(motion)
        try:
            return self._rehearsed(plan).report
        except MotionError as error:
            unknown = _failed("numbers", "plan", 0.0, np.nan, str(error))
            return FeasibilityReport.of(plan.name, plan.duration, [unknown])

    def evaluate(self, motion: str | Motion | Timeline | MotionPlan) -> CheckedMotion:
        """The report on ``motion`` with the movement and the forces that it judges.

        Args:
            motion: as for ``check``.

        Raises:
            CommandError: for an unknown name.
            TimelineError: if the timeline is empty, or this is no motion.
            MotionError: if the plan is not finite: then there is no movement.
        """
        return self._rehearsed(self._plan(motion))

    def _plan(self, motion: object) -> MotionPlan:
        if isinstance(motion, str):
            motion = load_motion(motion)
        if isinstance(motion, Motion):
            motion = motion()
        if not isinstance(motion, Timeline | MotionPlan):
            raise TimelineError(f"a motion is a name, a Timeline or a plan, not {motion!r}")
        is_plan = isinstance(motion, MotionPlan)
        return motion if is_plan else compile_timeline(motion, self.model)

    def _rehearsed(self, plan: MotionPlan) -> CheckedMotion:
        model, limits = self.model, self._limits
        path = trajectory_of(plan, model)
        forces = dynamic.forces_of(path, model)
        series = [
            *_as_written(plan),
            kinematic.reach(path, limits),
            kinematic.joint_position(path, model),
            kinematic.joint_speed(path, model),
            *dynamic.torque(path, forces, model, limits),
            *dynamic.support(path, forces, limits),
            *dynamic.contacts(path, forces, limits),
            self_distance(path, self._collision, limits),
            kinematic.clearance(path, model, limits),
            *kinematic.landing(path, model, limits),
            kinematic.smoothness(path, limits),
            kinematic.ends(plan, path, model, limits),
        ]
        report = FeasibilityReport.of(plan.name, plan.duration, series)
        return CheckedMotion(plan, report, path, forces)


def check(motion: str | Motion | Timeline | MotionPlan) -> FeasibilityReport:
    """Whether the installed Go2 can do ``motion``; see ``FeasibilityChecker``."""
    return FeasibilityChecker().check(motion)


def _as_written(plan: MotionPlan) -> list[Series]:
    """What the compiler could not do as it was written."""
    if not isinstance(plan, CompiledPlan):
        return []
    series = []
    for problem in plan.problems:
        if isinstance(problem, OutOfReach):
            series.append(_failed("way of a foot", problem.leg, problem.time, problem.miss, ""))
        elif isinstance(problem, Unbalanced):
            series.append(_failed("balance", "trunk", problem.time, np.nan, problem.reason))
    return series


def _failed(what: str, subject: str, time: float, value: float, note: str) -> Series:
    one = np.ones((1, 1))
    return Series(what, "m", (subject,), np.array([time]), value * one, 0 * one, -one, note=note)
