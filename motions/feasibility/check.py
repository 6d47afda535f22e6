"""``check``: can the robot do this motion? Kinematics first, then forces; nothing is simulated."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path

import numpy as np
from jaxtyping import Float

from go2_wbc.arguments import typed
from go2_wbc.brief import brief, inline_html
from go2_wbc.errors import CommandError, MotionError
from go2_wbc.feasibility_limits import FeasibilityLimits
from go2_wbc.legs import LEGS
from go2_wbc.motion_plan import MotionPlan
from go2_wbc.recording import Recording
from go2_wbc.robot.description import GO2, RobotProfile
from go2_wbc.robot.model import RobotModel
from go2_wbc.world import World
from motions.authoring import Motion
from motions.batch_kinematics import centres_of_mass
from motions.dynamics.phases import Progress
from motions.feasibility import dynamic_spans, kinematic, tracking
from motions.feasibility import forces as dynamics
from motions.feasibility.bodies import SelfCollision, hulls_of, self_distance
from motions.feasibility.forces import Case, Forces
from motions.feasibility.goal_errors import departure_measurements, departures
from motions.feasibility.joint_stops import joint_position
from motions.feasibility.report import FeasibilityReport, Series
from motions.feasibility.sampled import Sampled, sampled_of
from motions.language.timeline import Timeline
from motions.language.timeline_data import NEAREST
from motions.memory import Memory
from motions.plan.compiled_plan import LEAST_FEET, CompiledPlan, PlanSamples, Problem
from motions.plan.timeline_compiler import Broken, compile_timeline
from motions.plan.trajectory import Trajectory, samples_of, trajectory_of
from motions.registry import load_motion
from motions.saved.files import is_saved_plan, load_plan

BALANCE, WAY = "balance", "way of a foot"  #: Problems of the compiler
SLIDING = 0.17
"""Share of the slip that is allowed, from which on a force that lacks for a moment matters."""


@dataclass(frozen=True, slots=True)
class CheckedMotion:
    """A checked motion, with what the check worked out on its way.

    Attributes:
        plan, report: what was checked, and what the check says.
        path: the movement of the whole robot, in the frame of the motion.
        forces: contact forces and torques along it.
        robot: name of the profile of the robot that was judged.
    """

    plan: MotionPlan
    report: FeasibilityReport
    path: Trajectory
    forces: Forces
    robot: str = GO2

    _repr_html_ = inline_html
    __repr__ = brief

    def recording(self) -> Recording:
        """The plan in the form of a recorded run, for viewers: 100 samples a second.

        Labels are the names of the plan's holds, elsewhere the feet that are in the air.
        """
        path = self.path
        (support,) = (series for series in self.report.series if series.check == "support")
        has_area = path.stance.sum(axis=1) >= LEAST_FEET
        spans = self.plan.spans if isinstance(self.plan, CompiledPlan) else {}
        return Recording(
            time=path.times,
            q=path.q,
            v=path.v,
            tau=self.forces.tau,
            foot_forces=self.forces.contact[:, :, 2],
            stance=path.stance,
            p_world_com=path.p_com,
            support_margin=np.where(has_area, support.values[:, 0], np.nan),
            labels=_labels(path, spans),
            robot=self.robot,
        )


Playable = str | Path | Motion | Timeline | MotionPlan | CheckedMotion
"""What stands for a motion: a name of the library, the file of a saved motion or plan, a motion
(with its default parameters), a timeline, a plan, or a motion that was checked before."""


@typed("model", "mend", "progress", "memory")
def compile_motion(
    motion: object,
    model: RobotModel,
    *,
    mend: Broken | None = None,
    progress: Progress | None = None,
    memory: Memory | None = None,
) -> MotionPlan:
    """The plan of ``motion`` on the robot ``model``; what is compiled already is not done again.

    Args:
        motion: a ``Playable``; anything else is refused.
        model: must not be that of a control loop that runs in another thread.
        mend, progress, memory: as for ``compile_timeline``; ``mend`` is asked for timelines with
            ``physics="nearest"`` only, by default a checker of that robot in the usual world.

    Raises:
        CommandError: for an unknown name, or for what stands for no motion.
        TimelineError: if the timeline is empty or its parameters are not valid.
        MotionFileError: for a file that cannot be used.
    """
    if isinstance(motion, CheckedMotion):
        return motion.plan
    if isinstance(motion, MotionPlan):
        return motion
    if isinstance(motion, str | Path) and is_saved_plan(motion):
        return load_plan(motion, model=model)
    line = timeline_of(motion, model.profile)
    if line is None:
        raise CommandError(
            "motion must be a name of the library, a function with @motion before it, a Timeline, "
            f"a plan or a CheckedMotion, got {motion!r}"
        )
    asked = (mend or FeasibilityChecker(model)._broken) if line.physics == NEAREST else None
    return compile_timeline(line, model, mend=asked, progress=progress, memory=memory)


def timeline_of(motion: object, profile: RobotProfile | None = None) -> Timeline | None:
    """The timeline of ``motion``; of a plan, or of what stands for no motion, none.

    One of the library is as the robot of ``profile`` does it, by default a Go2.

    Raises:
        CommandError: for an unknown name.
    """
    if isinstance(motion, str | Path):
        own = {} if profile is None else profile.motions.get(str(motion), {})
        return None if is_saved_plan(motion) else load_motion(motion, **own)
    if isinstance(motion, Motion):
        return motion()
    return motion if isinstance(motion, Timeline) else None


class FeasibilityChecker:
    """Checks motions on one robot; loads what it needs once.

    It works with ``model``, and a ``RobotModel`` is for one thread at a time: never check on the
    model of a control loop that runs.

    Attributes:
        model, world: the robot, and in which world motions are checked.
    """

    @typed()
    def __init__(
        self,
        model: RobotModel | None = None,
        limits: FeasibilityLimits | None = None,
        *,
        world: World | None = None,
        progress: Progress | None = None,
        memory: Memory | None = None,
    ) -> None:
        """Prepare for ``model``, by default the installed Go2, in ``world``.

        What is uncertain in it counts at its worst. Plans are made for ``model`` as it is: like the
        controller, they know nothing of a payload. ``progress`` is called while a dynamic motion is
        solved, with the number of iterations and the cost. With a ``memory`` of its own, what a
        motion has in common with those that were checked before is not worked out again: for an
        editor.
        """
        self.model = model or RobotModel()
        self.world = world or World()
        self._progress, self._memory = progress, memory
        self._limits = limits or FeasibilityLimits()
        self._loaded = _loaded(self.model, self.world.worst)
        self._collision = SelfCollision(self.model)
        self._hulls = hulls_of(self.model.description)

    def __repr__(self) -> str:
        return f"<FeasibilityChecker: {self.model!r}, {self.world!r}>"

    def __reduce__(self) -> tuple[object, ...]:
        """A process pool loads it anew, without ``progress``."""
        return partial(FeasibilityChecker, self.model, self._limits, world=self.world), ()

    @typed("check")
    def plan(self, motion: Playable, *, check: bool = True) -> MotionPlan:
        """The plan of ``motion``, compiled and checked no more often than needed.

        Args:
            motion: of a checked one nothing is done again.
            check: whether it must be feasible.

        Raises:
            MotionInfeasible: if the motion breaks a limit; carries the findings. Else what
                ``compile_motion`` raises.
        """
        plan = self._compiled(motion)
        if check:
            known = motion if isinstance(motion, CheckedMotion) else plan
            self.check(known).raise_if_infeasible()
        return plan

    def check(self, motion: Playable) -> FeasibilityReport:
        """The report on ``motion``; one that was checked before keeps its report.

        Raises what ``compile_motion`` does.
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
        return compile_motion(
            motion, self.model, mend=self._broken, progress=self._progress, memory=self._memory
        )

    def _broken(self, plan: CompiledPlan) -> Float[np.ndarray, " k"]:
        """Instants [s] at which ``plan`` breaks a limit."""
        return np.concatenate([[], *(one.broken_at for one in self.evaluate(plan).report.series)])

    @typed()
    def departure(self, plan: MotionPlan) -> dict[str, float]:
        """How far ``plan`` is from what was written, at most, by name with unit.

        Nothing if it is what was written; by parts, and in words, it stands in the report.
        """
        return departure_measurements(plan, self.model)

    def evaluate(self, motion: Playable) -> CheckedMotion:
        """Compile and check ``motion``, once: its plan, the report, the movement and the forces.

        The result stands for the motion wherever one is asked for: ``GO2Controller.play`` plays its
        plan without compiling or checking it again.

        One that was checked before is returned as it is.

        Raises:
            MotionError: if the plan is not finite: then there is no movement to judge. Else what
                ``compile_motion`` raises.
        """
        if isinstance(motion, CheckedMotion):
            return motion
        plan, model = self._compiled(motion), self.model
        whole = plan if isinstance(plan, CompiledPlan) else None
        solved = whole if whole is not None and whole.dynamic else None
        spans = () if whole is None else whole.dynamic
        work = partial(self._sampled, plan)
        sampled = sampled_of(samples_of(plan, model), spans, work, self._memory)
        report = FeasibilityReport.of(
            plan.name,
            plan.duration,
            self._judged(sampled, plan),
            None if whole is None else whole.end_pose,
            departures=() if solved is None else departures(solved, model),
            world=self.world,
        )
        return CheckedMotion(
            plan, report, sampled.path, sampled.forces, model.description.profile.name
        )

    def _sampled(
        self, plan: MotionPlan, asked: PlanSamples, before: Trajectory | None, start: int
    ) -> Sampled:
        """What is ``asked``: all, or what is new to a motion ``before``, from row ``start`` on."""
        model, heavy, world, memory = self.model, self._loaded, self.world.worst, self._memory
        rpy = None if before is None else before.rpy[start]
        path = trajectory_of(plan, model, memory, asked, rpy)
        inertia = dynamics.inertia_of(before or path, heavy)
        forces = dynamics.forces_of(path, heavy, memory, inertia)
        if isinstance(plan, CompiledPlan) and plan.dynamic:
            forces = dynamic_spans.with_spans(forces, path, plan, model)
        forces = dynamics.resisted(forces, path, world)
        places = dynamics.places_of(path, model)
        case = Case(path, forces, places, model, heavy, world, self._limits, memory)
        carried = case
        if heavy is not model:
            poses = np.hstack([path.q[:, :3], path.rpy])
            p_com = centres_of_mass(poses, path.q[:, 7:], heavy)
            carried = replace(case, path=replace(path, p_com=p_com))
        com, zero_moment_point = dynamics.support(carried)
        if carried is not case:  # the controller feels the load, and shifts the CoM back
            own = dynamics.support(case)[0]
            margins = np.minimum(com.margins, own.margins)
            com = replace(com, values=np.minimum(com.values, own.values), margins=margins)
        series = (
            kinematic.reach(case),
            joint_position(case),
            kinematic.clearance(case, self._hulls),
            kinematic.dragging(case),
            *kinematic.landing(case),
            com,
            kinematic.joint_speed(case),
            kinematic.smoothness(case),
            zero_moment_point,
            *dynamics.contacts(case),
            dynamics.friction(case),
            *dynamics.torque(case),
        )
        return Sampled(
            path=path,
            forces=forces,
            places=places,
            p_com=carried.path.p_com,
            lost=dynamics.lost(case, inertia),
            creep=dynamics.creep(path, heavy),
            settled=dynamics.settled(path),
            series={one.check: one for one in series},
        )

    def _judged(self, sampled: Sampled, plan: MotionPlan) -> list[Series]:
        """Every check, causes before what follows from them."""
        limits, found, heavy = self._limits, sampled.series, self._loaded
        own = (sampled.path, sampled.forces, sampled.places, self.model, heavy)
        case = Case(*own, self.world.worst, limits, self._memory)
        problems, in_flight = (), []
        if isinstance(plan, CompiledPlan):
            problems = plan.problems
            if plan.dynamic:
                in_flight = dynamic_spans.judged(plan, case)
        carried = replace(case, path=replace(case.path, p_com=sampled.p_com))
        lag = dynamics.lagging(case, sampled.lost)
        slip = dynamics.slip(case, sampled.creep, sampled.settled)
        com, zero_moment_point, grip = found["support"], found["support of ZMP"], found["friction"]
        wrench, load = found["contact wrench"], found["foot load"]
        is_off, slips = com.is_broken or lag.is_broken, slip.is_broken or lag.is_broken
        slides = max(map(slip.worst, LEGS)) > SLIDING * limits.slip
        lacks = wrench.worst(0, begin=dynamics.SPREAD) > limits.jolt
        is_lacking = lag.is_broken or (slides and lacks)
        return [
            *_missed(problems, case),
            found["reach"],
            found["joint position"],
            self_distance(case, self._collision),
            found["clearance"],
            found["dragging"],
            found["landing place"],
            found["flat landing"],
            kinematic.ends(case, plan),
            *(_failed(problem) for problem in problems if is_off and problem.check == "balance"),
            com,
            found["joint speed"],
            found["landing speed"],
            found["continuity"],
            zero_moment_point if lag.is_broken else zero_moment_point.downgraded(),
            wrench if is_lacking else wrench.downgraded(),
            load if slips else load.downgraded(),
            lag,
            tracking.tipping(carried, zero_moment_point.values[:, 0]),
            tracking.tracking(case, sampled.lost),
            grip if slips else grip.downgraded(),
            slip,
            found["torque"],
            found["torque at speed"],
            *in_flight,
        ]


@typed("world")
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


def _missed(problems: Sequence[Problem], case: Case) -> list[Series]:
    """What else than balance is not as written; a place that a foot nearly reaches is a warning."""
    found = [_failed(problem) for problem in problems if problem.check not in (BALANCE, WAY)]
    for problem in problems:
        if problem.check == WAY:
            values, reach = np.full((1, 1), problem.miss), case.limits.reach
            what, times = (WAY, "m", (problem.subject,), values), np.array([problem.time])
            found.append(case.series(*what, reach, tight=reach, times=times))
    return found


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


def _labels(path: Trajectory, spans: Mapping[str, tuple[float, float]]) -> tuple[str, ...]:
    of_modes = [_label(mode) for mode in range(2 ** len(LEGS))]
    labels = [of_modes[mode] for mode in (path.stance @ [1, 2, 4, 8]).tolist()]
    for name, (start, end) in reversed(list(spans.items())):  # the first one counts
        first, last = np.searchsorted(path.times, [start, end]).tolist()
        labels[first:last] = [name] * (last - first)
    return tuple(labels)


def _label(stance: int) -> str:
    """Of feet that stand by the bits of a number."""
    raised = [leg.name for leg in LEGS if not stance >> leg & 1]
    if len(raised) == 4:
        return "flight"
    return f"{' and '.join(raised)} up" if raised else "on four feet"
