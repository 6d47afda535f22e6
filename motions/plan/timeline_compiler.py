"""Timeline -> plan: written parts are compiled, dynamic blocks are solved, and both are joined.

Each part is made in a frame of its own, on the ground below the feet where it starts; so later
parts are relative to where a jump lands. All parts are at rest, standing, where they join.

If the nearest motion is asked for, parts that break a limit are cut out from rest to rest, and
replaced by the nearest that the robot can do.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np
from jaxtyping import Bool, Float, Int
from scipy.interpolate import PPoly

from go2_wbc.arguments import typed
from go2_wbc.contacts import ContactSchedule
from go2_wbc.curves import Ease
from go2_wbc.errors import PlanNotFound, TimelineError
from go2_wbc.motion_plan import Posture
from go2_wbc.recording import true_runs
from go2_wbc.reference import Anchor
from go2_wbc.robot.model import RobotModel
from go2_wbc.robot.rotations import yaw_rotation
from motions.dynamics.dynamic_trajectory import DynamicTrajectory
from motions.dynamics.knots import standing
from motions.dynamics.phases import PhaseProblem, Progress
from motions.dynamics.plan_cache import nearest_cached, solve_cached
from motions.dynamics.solver import PlanTarget
from motions.language.dynamic_blocks import away_from_home
from motions.language.keys import BalanceShift, BodyKey, FootHold, Key, Mark, PhaseKey
from motions.language.timeline import Timeline
from motions.language.timeline_data import SAME, unchecked
from motions.memory import Memory
from motions.plan.compiled_plan import (
    CompiledPlan,
    DynamicSpan,
    Problem,
    attitude_angles,
    curves_of,
    event_at,
    placed,
)
from motions.plan.leg_tasks import tasks_of
from motions.plan.parts import DECIMALS, rests
from motions.plan.quasi_static import UNLOAD_TIME, FootContacts, compile_quasi_static
from motions.plan.trajectory import Trajectory, trajectory_of
from motions.postures import standing_feet

LEAST_REST = 0.1
"""Time [s] at rest from which on a motion falls into parts there: own choice. Between two poses the
trunk rests for an instant only, and a solver that must meet it there is worse off; at home, where a
motion ends, an instant is enough."""
LEAD = 0.3
"""Time [s] at rest that is solved with what follows or goes before, if there is so much: to begin a
quick move early, and to come to rest after it. Own choice, 1.7 times sqrt(0.29 m / g)."""
SLOW = 5e-4  #: Way [m, rad] between two samples, at most, of what does not just pass home: 0.05 /s
NEAR = 10  #: Samples beside a rest that are as good as part of it: moves begin and end slowly
SAME_POSE = 1e-4  #: Difference [m, rad] of configurations that counts as none; splines ring by less


@dataclass(frozen=True, slots=True)
class Piece:
    """A part of a motion, from rest to rest."""

    first: int  #: row of its path
    last: int  #: row of its path
    start: float  #: when [s] in the motion
    end: float  #: when [s] in the motion

    def written(self, path: Trajectory) -> PlanTarget:
        """What is written there; a foot that leaves at the motion's first instant stands then.

        Raises:
            PlanNotFound: if that is no motion to be near to.
        """
        rows = slice(self.first, self.last + 1)
        stance = path.stance[rows].copy()
        stance[0] |= self.first == 0
        try:
            return PlanTarget(path.times[rows] - self.start, path.q[rows], stance)
        except TimelineError as error:
            raise PlanNotFound("there is no nearest motion", [str(error)]) from error


def without_vain_shifts(timeline: Timeline) -> Timeline:
    """Without shifts of the trunk for two feet or more that are up at once, which cannot balance.

    A shift over three feet is how balance on them is written; two have no area to be over. While
    the second foot joins the first, what was shifted for the first one alone is as much in vain.
    """
    vain: list[Key] = []
    episode: list[BalanceShift] = []
    for shift in timeline.in_order(BalanceShift):
        episode.append(shift)
        if not shift.raised:
            vain += episode if any(len(one.raised) > 1 for one in episode) else []
            episode = []
    vain += episode if any(len(one.raised) > 1 for one in episode) else []
    return replace(timeline, keys=tuple(key for key in timeline.keys if key not in vain))


def pieces_to_repair(
    path: Trajectory, as_checked: Trajectory, broken: Float[np.ndarray, " k"]
) -> list[Piece]:
    """The parts of ``path``, from rest to rest, in which there are ``broken`` instants [s].

    At rest ``path`` must be the same as ``as_checked``: the motion goes on from there as it is.
    """
    times, last = path.times, len(path.times) - 1
    rows = np.minimum(np.searchsorted(times, broken - SAME_POSE), last)
    edges = [(0, 0), *_rests(path, as_checked, rows), (last, last)]
    pieces: list[Piece] = []
    for (before, start), (end, after) in pairwise(edges):
        if not ((rows >= start) & ((rows < end) | (end == last))).any():
            continue
        first = max(before, int(np.searchsorted(times, times[start] - LEAD - SAME_POSE)))
        final = min(after, int(np.searchsorted(times, times[end] + LEAD - SAME_POSE)))
        if pieces and first <= pieces[-1].last:
            first = pieces.pop().first
        pieces.append(Piece(first, final, float(times[first]), float(times[final])))
    return pieces


def _rests(
    path: Trajectory, as_checked: Trajectory, broken: Int[np.ndarray, " k"]
) -> list[tuple[int, int]]:
    """First and last rows of every rest on four feet in which no limit is broken.

    That is a while anywhere, or an instant at home.
    """
    is_ready = np.abs(path.q - as_checked.q).max(axis=1) < SAME_POSE
    is_ready &= path.stance.all(axis=1) & as_checked.stance.all(axis=1)
    steps = np.abs(np.diff(path.q, axis=0)).max(axis=1)
    moves = np.maximum([0.0, *steps], [*steps, 0.0])
    at_home = np.abs(path.q[:, 7:] - path.q[0, 7:]).max(axis=1) < SAME_POSE
    rests = []
    for rest in true_runs((steps < SAME_POSE * np.diff(path.times)) & is_ready[1:]):
        first, last = rest.start, rest.stop
        if path.times[last] - path.times[first] > LEAST_REST - SAME_POSE:
            rests.append((first, last))
            at_home[max(first - NEAR, 0) : last + NEAR] = False
    for instants in true_runs(at_home & is_ready & (moves < SLOW)):
        slowest = instants.start + int(np.argmin(moves[instants]))
        is_inside = instants.start > 0 and instants.stop < len(moves)
        rests += [(slowest, slowest)] if is_inside else []
    return sorted((a, b) for a, b in rests if not ((broken > a) & (broken < b)).any())


SHORTEST = 1e-6
"""Time [s] between dynamic blocks below which there is none: absorbs rounding of sums."""
SAME_PLACE = 1e-3
"""Distance [m] below which feet count as standing below the hips: less than what tracking adds."""
_RESTING = BodyKey(0.0, 0.0, Ease.LINEAR, "z", 0.0)

Broken = Callable[[CompiledPlan], Float[np.ndarray, " k"]]
"""Instants [s] at which a plan breaks a limit."""


@typed(error=TimelineError)
def compile_timeline(
    timeline: Timeline,
    model: RobotModel,
    p_feet: Float[np.ndarray, "4 3"] | None = None,
    *,
    mend: Broken | None = None,
    progress: Progress | None = None,
    memory: Memory | None = None,
) -> CompiledPlan:
    """The plan of ``timeline``, in the frame of the motion.

    Args:
        model: of the robot; compiling uses its data, so it must not be that of a control loop that
            runs in another thread.
        p_feet: where the feet's centres stand at first [m], by default below the hips; the trunk
            starts above them, with their heading.
        mend: finds what is infeasible between dynamic blocks, for which the nearest motion that is
            not is solved; without it all is compiled as it is written. ``FeasibilityChecker`` gives
            it where the timeline asks for it.
        progress: called while something is solved, with the number of iterations and the cost.
        memory: what was compiled before: the timeline is compiled by its parts, from rest to rest,
            and those that are known are not compiled again.

    Raises:
        TimelineError: if it is empty, a dynamic block does not start standing at home, something
            else moves meanwhile, or its phases do not fit each other.
        MissingDependency: if a block must be solved and the solver is not installed.
    """
    blocks = timeline.in_order(PhaseKey)
    if mend is not None:
        memory = None  # what is near to a motion is found for all of it
    cuts = [] if memory is None else rests(timeline)
    if not blocks and mend is None and not cuts:
        return compile_quasi_static(timeline, model, p_feet, memory)
    for block in blocks:
        _require_alone(timeline, block)
    maker = _Maker(timeline, model, p_feet, mend, progress)
    if memory is not None:
        maker.remember(memory, cuts)
    for block in blocks:
        maker.add_stretch(block.start, Posture.STAND)
        maker.add_block(block)
    maker.add_stretch(timeline.end, timeline.exit)
    return maker.joined()


def _require_alone(timeline: Timeline, block: PhaseKey) -> None:
    for key in timeline.keys:
        is_apart = key.end <= block.start + SAME or key.start >= block.end - SAME
        if not (is_apart or key is block or isinstance(key, Mark)):
            raise TimelineError(
                f"{key.track} moves from {key.start:.2f} to {key.end:.2f} s, within a dynamic "
                f"block from {block.start:.2f} to {block.end:.2f} s, which takes the whole robot"
            )
    away = away_from_home(timeline, block.start)
    if away:
        raise TimelineError(
            f"the dynamic block at {block.start:.2f} s starts standing at home(); away: "
            f"{', '.join(away)}"
        )


@dataclass(frozen=True, slots=True)
class _Part:
    """Curves and contacts from ``start`` [s] on, in the frame of the motion."""

    start: float
    curves: PPoly
    times: Float[np.ndarray, " m"]
    stance: Bool[np.ndarray, "m 4"]
    swings: Bool[np.ndarray, "m 4"]


@dataclass(frozen=True, slots=True)
class _Stretch:
    """What is written between two rests, counted from the first one."""

    keys: tuple[Key, ...]
    length: float  #: [s]
    entry: Posture
    exit: Posture

    def of(self, line: Timeline) -> Timeline:
        """It alone, of ``line``."""
        ends = {"entry": self.entry, "exit": self.exit}
        return replace(line, keys=self.keys, cursor=self.length, **ends)


class _Maker:
    """Makes the parts of a plan, one after the other.

    Between them the robot stands at rest over ``feet``, which are in the frame of the next part.
    """

    def __init__(
        self,
        timeline: Timeline,
        model: RobotModel,
        p_feet: Float[np.ndarray, "4 3"] | None,
        broken: Broken | None,
        progress: Progress | None,
    ) -> None:
        self._timeline, self._model = timeline, model
        self._broken, self._progress = broken, progress
        self._time, self._frame = 0.0, Anchor(np.zeros(3), 0.0)
        self._home = standing_feet(model)
        self._feet = self._home
        self._parts: list[_Part] = []
        self._spans: list[DynamicSpan] = []
        self._problems: list[Problem] = []
        self._ramps: list[float] = []
        self._ramp = UNLOAD_TIME
        self._memory: Memory | None = None
        self._cuts: Sequence[float] = ()
        if p_feet is not None:
            self._move_on(0.0, p_feet, 0.0)

    def remember(self, memory: Memory, cuts: Sequence[float]) -> None:
        """Compile by the parts between ``cuts`` [s], with what ``memory`` has of them."""
        self._memory, self._cuts = memory, cuts

    def add_stretch(self, end: float, exit: Posture) -> None:
        """What is written from here to ``end`` [s]."""
        start = self._time
        if end - start < SHORTEST:
            return
        count, keys = len(self._problems), self._written(start, end)
        keys = [key.later(-start) for key in keys] if start else keys
        self._ramp = FootContacts(unchecked(self._timeline, keys=tuple(keys))).ramp()
        for cut in self._cuts:
            if self._time + SHORTEST < cut < end - SHORTEST:
                self._add_part(self._keys(self._time, cut), cut, Posture.STAND)
        self._add_part(self._keys(self._time, end), end, exit)
        self._problems[count:] = _worst(self._problems[count:])

    def _keys(self, start: float, end: float) -> list[Key]:
        """What is written from ``start`` to ``end`` [s], counted from there.

        Of parts that are remembered, to what matters.
        """
        keys = self._written(start, end)
        if self._memory is None:
            return [key.later(-start) for key in keys]
        return [key.retimed(lambda t: round(t - start, DECIMALS)) for key in keys]

    def _written(self, start: float, end: float) -> list[Key]:
        return [
            key
            for key in self._timeline.keys
            if start - SAME <= key.start < end - SAME and not isinstance(key, PhaseKey | Mark)
        ]

    def _add_part(self, keys: list[Key], end: float, exit: Posture) -> None:
        length = end - self._time
        entry = self._timeline.entry if self._time == 0.0 else Posture.STAND
        part = _Stretch(tuple(keys) or (replace(_RESTING, end=length),), length, entry, exit)
        plan, done = self._compiled(part), 0.0
        if self._broken is not None and keys:
            done = self._add_repaired(self._broken(plan), plan, part)
        self._add_written(plan, done, plan.duration)
        last = plan.curves(plan.duration)
        self._move_on(end, last[18:].reshape(4, 3), last[5])

    def _add_repaired(
        self, broken: Float[np.ndarray, " k"], plan: CompiledPlan, stretch: _Stretch
    ) -> float:
        """``plan``, which ``stretch`` was compiled to, up to the last part that is repaired.

        ``broken``: when it breaks a limit [s]. Returns how far that goes [s]; a part to which
        nothing is near stays as it is written.
        """
        done = 0.0
        if not len(broken):
            return done
        path = as_checked = trajectory_of(plan, self._model)
        line = stretch.of(self._timeline)
        asked = replace(stretch, keys=without_vain_shifts(line).keys)
        if len(asked.keys) < len(line.keys):
            path = trajectory_of(self._compiled(asked), self._model)
        for piece in pieces_to_repair(path, as_checked, broken):
            try:
                written = piece.written(path)
                found = nearest_cached(
                    written, self._model, tolerance=line.tolerance, progress=self._progress
                )
            except PlanNotFound as error:
                self._fail("nearest motion", error, self._time + piece.start)
                continue
            self._add_written(plan, done, piece.start)
            rest = _moved(plan.curves, self._frame)(piece.end)
            self._solved(found, written, rest, self._time + piece.start, self._frame)
            done = piece.end
        return done

    def _add_written(self, plan: CompiledPlan, start: float, end: float) -> None:
        """What ``plan``, from here on, does from ``start`` to ``end`` [s] of it."""
        if end - start < SHORTEST:
            return
        first, last = np.searchsorted(plan.curves.x, [start - SHORTEST, end - SHORTEST]).tolist()
        knots = plan.curves.x[first : last + 1]
        curves = PPoly.construct_fast(plan.curves.c[:, first:last], knots - knots[0])
        times = np.array(plan.contacts.times)
        during = times[(times > start) & (times < end)]
        rows = event_at(plan.contacts, np.array([start, *during]))
        times, modes = np.maximum(times[rows] - start, 0.0), plan.contacts.modes[rows]
        curves, swings = _moved(curves, self._frame), plan.swings[rows]
        self._parts.append(_Part(self._time + start, curves, times, modes, swings))
        self._problems += [
            replace(one, time=one.time + self._time)
            for one in plan.problems
            if start <= one.time <= end
        ]
        self._ramps.append(self._ramp)

    def _fail(self, check: str, error: PlanNotFound, time: float) -> None:
        reason = "; ".join([str(error).split("\n")[0], *error.reasons])
        self._problems.append(Problem(check, "trunk", time, reason=reason))

    def add_block(self, block: PhaseKey) -> None:
        """A dynamic block, solved; one that cannot be is rest and a problem."""
        is_home = self._feet is self._home
        initial = None if is_home else standing(self._model, self._feet)
        problem = PhaseProblem(block.phases, initial, tolerance=self._timeline.tolerance)
        try:
            found = solve_cached(problem, self._model, progress=self._progress)
        except PlanNotFound as error:
            self._fail("dynamic plan", error, self._time)
            self.add_stretch(block.end, Posture.STAND)
            return
        start, frame = self._time, self._frame
        yaw = float(attitude_angles(found.q)[-1, 2])
        asked = self._feet + problem.shift
        self._move_on(start + found.duration, asked, yaw, landed=found.p_feet[-1])
        rest = _Stretch((replace(_RESTING, end=1.0),), 1.0, Posture.STAND, Posture.STAND)
        home = self._compiled(rest).curves
        self._solved(found, problem, _moved(home, self._frame)(0.0), start, frame)

    def _solved(
        self,
        found: DynamicTrajectory,
        asked: PhaseProblem | PlanTarget,
        end: Float[np.ndarray, "30"],
        start: float,
        frame: Anchor,
    ) -> None:
        """A part that ends at rest at ``end`` (see ``CompiledPlan.curves``)."""
        span = DynamicSpan(start, frame, asked, placed(found, frame), self._timeline.tolerance)
        curves = curves_of(span.trajectory, self._model, end)
        self._parts.append(_Part(start, curves, *tasks_of(found, self._model)))
        self._spans.append(span)

    def joined(self) -> CompiledPlan:
        """All parts as one plan."""
        line, parts = self._timeline, self._parts
        knots = [part.start + part.curves.x[:-1] for part in parts]
        curves = PPoly(
            np.concatenate([part.curves.c for part in parts], axis=1),
            np.concatenate([*knots, [self._time]]),
        )
        times = np.concatenate([part.start + part.times for part in parts])
        return CompiledPlan(
            name=line.name,
            entry=line.entry,
            exit=line.exit,
            curves=curves,
            contacts=ContactSchedule(
                tuple(times.tolist()), np.concatenate([part.stance for part in parts])
            ),
            swings=np.concatenate([part.swings for part in parts]),
            ramp=min(self._ramps, default=UNLOAD_TIME),
            problems=tuple(self._problems),
            spans={mark.name: (mark.start, mark.end) for mark in line.in_order(Mark)},
            dynamic=tuple(self._spans),
            beats=line.beats,
            held={key.name: key.leg for key in line.in_order(FootHold)},
        )

    def _compiled(self, stretch: _Stretch) -> CompiledPlan:
        feet, model = None if self._feet is self._home else self._feet, self._model
        memory = self._memory
        if memory is None:
            return compile_quasi_static(stretch.of(self._timeline), model, feet)
        stretch = replace(stretch, length=round(stretch.length, DECIMALS))
        known = stretch, None if feet is None else tuple(np.round(feet, 9).ravel().tolist())
        return memory.part(
            known, lambda: compile_quasi_static(stretch.of(self._timeline), model, feet, memory)
        )

    def _move_on(
        self,
        time: float,
        feet: Float[np.ndarray, "4 3"],
        yaw: float,
        landed: Float[np.ndarray, "4 3"] | None = None,
    ) -> None:
        """Go on at ``time`` [s], standing on ``feet``; all of them in the frame of before.

        ``yaw``: of the trunk [rad], whole turns counted. ``landed``: where the feet have come to,
        a little beside: the next frame is there.
        """
        asked = Anchor.of_feet(feet, self._model.foot_radius)
        own = (feet - asked.p_world) @ yaw_rotation(asked.yaw)
        own[:, 2] = self._home[:, 2]
        is_home = np.abs(own - self._home).max() < SAME_PLACE
        self._feet = self._home if is_home else own
        here = asked if landed is None else Anchor.of_feet(landed, 0.0)
        turns = 2.0 * np.pi * round((yaw - here.yaw) / (2.0 * np.pi))
        p = np.array([*here.p_world[:2], 0.0])
        frame = self._frame
        to = frame.p_world + yaw_rotation(frame.yaw) @ p
        self._time, self._frame = time, Anchor(to, frame.yaw + here.yaw + turns)


def _worst(problems: Sequence[Problem]) -> list[Problem]:
    """Of places that a leg does not reach the farthest one, as of a motion in one part."""
    far = dict[str, Problem]()
    for one in problems:
        if not np.isnan(one.miss) and one.miss > getattr(far.get(one.subject), "miss", 0.0):
            far[one.subject] = one
    return [one for one in problems if np.isnan(one.miss) or far[one.subject] is one]


def _moved(curves: PPoly, frame: Anchor) -> PPoly:
    """``curves`` of a part, in the frame of the motion: its coefficients turn as places do."""
    if frame.yaw == 0.0 and not frame.p_world.any():
        return curves
    R, c = yaw_rotation(frame.yaw), curves.c.copy()
    for column in (0, *range(18, 30, 3)):
        c[:, :, column : column + 3] = curves.c[:, :, column : column + 3] @ R.T
        c[3, :, column : column + 3] += frame.p_world
    c[3, :, 5] += frame.yaw
    return PPoly.construct_fast(c, curves.x)
