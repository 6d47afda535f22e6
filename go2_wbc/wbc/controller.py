"""The whole-body controller: (snapshot, reference) -> torques, by one quadratic program a tick.

No back end gets numbers that are not finite. Solvers treat a nan in many ways: one takes seconds to
give up, another takes a nan bound for an open side, and an infinite minimum force is no bound to a
third. So all arrays are checked before any back end is called, used or not, and the error names the
first bad number. The minimum normal force may be -inf and the maximum inf: there is no such bound
then.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import partial
from typing import Any

import numpy as np
from jaxtyping import Float

from go2_wbc.algebra.active_set import SOLVED
from go2_wbc.arguments import typed
from go2_wbc.brief import brief
from go2_wbc.errors import ConfigError, QpInfeasible, ResidualRow, unknown_name
from go2_wbc.records import Array4x3, Array12, Array18, Array30, layout_of, packed
from go2_wbc.reference import BodyTarget, Reference, Target
from go2_wbc.robot.model import RobotModel
from go2_wbc.robot.motor import FrictionFeedForward
from go2_wbc.robot.state import JointCommand, Snapshot
from go2_wbc.validation import is_finite_number
from go2_wbc.wbc.backends import solve_condensed, solve_full
from go2_wbc.wbc.condensed import Decision, QpNumbers, Workspace, solve_tick
from go2_wbc.wbc.config import WbcConfig
from go2_wbc.wbc.constraints import (
    Constraints,
    Equality,
    FloatingBaseDynamics,
    Inequality,
    Multipliers,
    torque_map,
)
from go2_wbc.wbc.explanation import Explanation, multipliers_of
from go2_wbc.wbc.problem import ACCELERATION, FORCES, SIZE, Bounds, Problem, Rows, Source
from go2_wbc.wbc.solvers import check_solver, solve_relaxed
from go2_wbc.wbc.tasks import BuiltInTasks, Task

GREATEST_EXTRA_WEIGHT = 1e4
"""Weight of a user's own task beyond which nothing is left of the others' accuracy."""
GREATEST_NUMBER = 1e100  #: In a task's rows: they are squared, and summed
BACKENDS = ("condensed", "full", "placo")  #: Names of the back ends, the usual one first
_IN_BODY = frozenset(BodyTarget.__dataclass_fields__)
_IN_STATE = ("q", "v")
_TAU, _MOTORS, _MULTIPLIERS = map(layout_of(Decision).slice, Decision.part_names()[1:])
_NO_ROWS, _DECISION = np.empty((0, SIZE + 2)), layout_of(Decision).size


@dataclass(frozen=True, slots=True)
class WbcSolution:
    """One solution of the whole-body QP.

    Attributes:
        tau: joint torques [N m] of the dynamics, without friction: M qdd + h = S' tau + J' f.
        tau_motors: what the motors are told [N m]: ``tau`` and the friction of the joints, within
            what they give at their speeds.
        solve_time: seconds of assembly and solution.
        backend: which back end solved it.
        is_relaxed: whether constraints had to give way, see ``violations``.
    """

    tau: Array12
    tau_motors: Array12
    solve_time: float
    backend: str
    _formulate: Callable[[], Problem]
    _row: Float[np.ndarray, " size"]  # z; of the compiled solve all of its ``Decision``
    is_relaxed: bool = False

    __repr__ = brief

    @staticmethod
    def of_row(
        row: Float[np.ndarray, " size"],
        solve_time: float,
        backend: str,
        formulate: Callable[[], Problem],
    ) -> WbcSolution:
        """The solution whose arrays ``row`` holds (see ``condensed.Decision``)."""
        return WbcSolution(row[_TAU], row[_MOTORS], solve_time, backend, formulate, row)

    @staticmethod
    def from_decision(
        z: Array30, problem: Problem, solve_time: float, backend: str, *, is_relaxed: bool = False
    ) -> WbcSolution:
        """Torques from the joint rows of M a + h = tau + J' f; no friction is fed forward."""
        A, offset = torque_map(problem.snapshot)
        tau = A @ z + offset
        return WbcSolution(tau, tau, solve_time, backend, lambda: problem, z, is_relaxed)

    @property
    def qdd(self) -> Array18:
        """Generalised acceleration.

        Pinocchio's spatial base acceleration in the base frame [m/s^2, rad/s^2], then the joints
        [rad/s^2].
        """
        return self._row[ACCELERATION]

    @property
    def forces(self) -> Array4x3:
        """Contact force [N] of each foot in the world frame; zero for legs in the air."""
        return self._row[FORCES].reshape(4, 3)

    @property
    def residuals(self) -> tuple[ResidualRow, ...]:
        """Error of every task and violation of every constraint, in its own unit."""
        return self._formulate().residuals(self._row[:SIZE])

    @property
    def violations(self) -> tuple[ResidualRow, ...]:
        """By how much each constraint is broken, in its own unit; rounding, unless relaxed."""
        problem = self._formulate()
        constraints = len(problem.sources) - sum(isinstance(s, Task) for s in problem.sources)
        return problem.residuals(self._row[:SIZE])[-constraints:]

    @property
    def multipliers(self) -> Multipliers:
        """Of every inequality: written by the compiled solve, else solved for (``explanation``)."""
        if len(self._row) > SIZE:
            return Multipliers.of(self._row[_MULTIPLIERS])
        return multipliers_of(self._formulate(), is_relaxed=self.is_relaxed)

    def explain(self) -> Explanation:
        """Which limits bind and what more of each would give, or which contradict each other."""
        return Explanation.of(self._formulate())

    @property
    def command(self) -> JointCommand:
        """The motors' torques as a joint command."""
        return JointCommand.torque(self.tau_motors)


class WholeBodyController:
    """Torques that follow a reference as well as physics and the limits allow.

    Tasks (weighted least squares) and constraints are described in ``tasks`` and ``constraints``;
    ``backend`` is "condensed" (default), "full" (the same QP without elimination), or "placo".
    """

    @typed()
    def __init__(
        self,
        model: RobotModel,
        backend: str = "condensed",
        config: WbcConfig | None = None,
        *,
        extra_tasks: Sequence[Task] = (),
    ) -> None:
        """Prepare the tasks and constraints for ``model``.

        Args:
            model: the robot.
            backend: name of the back end.
            config: gains, weights and limits.
            extra_tasks: tasks of your own, beside the built-in ones.

        Raises:
            ConfigError: for an unknown back end, extra tasks with one that cannot take them, or
                a weight of theirs that is out of range.
            SolverUnavailable: for an unknown or uninstalled solver.
        """
        self.model = model
        self.config = config or WbcConfig()
        check_extra_tasks(extra_tasks)
        weight, motor = model.mass * model.gravity, model.motor.scaled(self.config.torque_share)
        tasks = BuiltInTasks.of(self.config, weight)
        limits = Constraints.of(self.config, model, motor)
        friction = FrictionFeedForward(self.config.joint_friction, motor)
        self._numbers = packed(QpNumbers(tasks, limits, friction))
        self._friction = self._numbers.friction
        self._extra_tasks = tuple(extra_tasks)
        t, c = self._numbers.tasks, self._numbers.constraints
        built_in = (t.position, t.orientation, t.swing, t.posture, t.force)
        self.tasks: tuple[Task, ...] = (*built_in, *self._extra_tasks)
        self.equalities: tuple[Equality, ...] = (FloatingBaseDynamics(), c.still)
        self.inequalities: tuple[Inequality, ...] = (c.pyramid, c.torque, c.joint)
        self._workspace = Workspace()
        self.backend_name = backend
        self._solver, self._solve = self._back_end(backend)
        self._is_compiled = backend == "condensed" and self.config.solver == "active_set"
        if extra_tasks and backend == "placo":
            raise ConfigError("the placo back end has tasks of its own and takes no extra ones")

    def __repr__(self) -> str:
        return (
            f"<WholeBodyController: {self.backend_name}, {self._solver}, {len(self.tasks)} tasks>"
        )

    def _back_end(self, name: str) -> tuple[str, Callable[[Problem], Array30]]:
        """Which solver it has, and how it solves an assembled problem."""
        solver = check_solver(self.config.solver)
        if name == "placo":
            from go2_wbc.wbc.placo_backend import SOLVER, PlacoBackend

            return SOLVER, PlacoBackend(self.model, self.config).solve
        ours = {"condensed": solve_condensed, "full": solve_full}
        if name not in ours:
            raise ConfigError(unknown_name("WBC back end", name, BACKENDS))
        return solver, partial(ours[name], solver=solver)

    @typed(late=True)
    def formulate(self, snapshot: Snapshot, reference: Reference) -> Problem:
        """The QP of this tick.

        Raises:
            ConfigError: for a task or constraint whose rows do not fit.
        """
        task_rows = [task.rows(snapshot, reference) for task in self.tasks]
        equality_rows = [item.rows(snapshot, reference) for item in self.equalities]
        bounds = [item.bounds(snapshot, reference) for item in self.inequalities]
        tasks = stacked(task_rows, self.tasks)
        task_counts = [len(rows.b) for rows in task_rows]
        return Problem(
            snapshot=snapshot,
            reference=reference,
            tasks=tasks,
            weights=np.repeat([task.weight_at(reference) for task in self.tasks], task_counts),
            equalities=stacked(equality_rows, self.equalities),
            bounds=Bounds(*(np.concatenate(parts) for parts in zip(*bounds, strict=True))),
            sources=(*self.tasks, *self.equalities, *self.inequalities),
            counts=(
                *task_counts,
                *(len(rows.b) for rows in equality_rows),
                *(len(rows.lower) for rows in bounds),
            ),
        )

    @typed(late=True)
    def solve(
        self, snapshot: Snapshot, reference: Reference, *, relax: bool = False
    ) -> WbcSolution:
        """Solve one tick.

        Args:
            snapshot: of this tick.
            reference: what to do.
            relax: if the constraints contradict each other, let those give way that reality can
                contradict (see ``relaxation``); the solution's ``violations`` say how far.

        Raises:
            QpInfeasible: if no torque meets the constraints; carries the residual table. With
                ``relax`` only for a reference that no robot could meet. Also for numbers that are
                not finite; names the array.
            CommandError: for an array of another shape than it should have.
        """
        solution = self.solve_compiled(snapshot, reference)
        if solution is not None:
            return solution
        start = time.perf_counter()  # thread_time costs a tenth of a tick on some machines
        check_inputs(snapshot, reference, self._solver)
        problem = self.formulate(snapshot, reference)
        check_problem(problem, self._solver)
        try:
            z, is_relaxed = self._solve(problem), False
        except QpInfeasible as error:
            if not relax:
                raise
            z, is_relaxed = self._relaxed(problem, error), True
        spent = time.perf_counter() - start
        solution = WbcSolution.from_decision(
            z, problem, spent, self.backend_name, is_relaxed=is_relaxed
        )
        motors = self._friction.motor_torques(snapshot, solution.qdd, solution.tau)
        return replace(solution, tau_motors=motors)

    @typed(late=True)
    def explain(self, snapshot: Snapshot, reference: Reference) -> Explanation:
        """Which limits bind in a tick and what more of each would give, or why it has no solution.

        Raises:
            QpInfeasible: for numbers that are not finite; names the array.
            ConfigError: for a task or constraint whose rows do not fit.
        """
        check_inputs(snapshot, reference, self._solver)
        return Explanation.of(self.formulate(snapshot, reference))

    def _relaxed(self, problem: Problem, error: QpInfeasible) -> Array30:
        try:
            return solve_relaxed(problem, self.config.solver)
        except QpInfeasible as contradiction:
            raise error from contradiction

    @property
    def is_compiled(self) -> bool:
        """Whether ticks are solved by the compiled kernel: condensed, and by ``active_set``."""
        return self._is_compiled

    @typed(late=True)
    def solve_compiled(self, snapshot: Snapshot, reference: Reference) -> WbcSolution | None:
        """Solve one tick by the kernel; None if it is not used here or finds no solution."""
        if not self.is_compiled:
            return None
        start = time.perf_counter()
        extra = _NO_ROWS
        if self._extra_tasks:
            extra = self._extra_rows(snapshot, reference)
            if not (np.abs(extra) <= GREATEST_NUMBER).all():
                return None
        decision = Decision.of(np.empty(_DECISION))
        target: Any = reference  # has the row of a ``Target``
        work = self._workspace
        outcome = solve_tick(snapshot, target, self._numbers, extra, work, decision)
        if outcome != SOLVED:
            return None
        spent = time.perf_counter() - start
        formulate = partial(self.formulate, snapshot, reference)
        return WbcSolution.of_row(decision.row, spent, self.backend_name, formulate)

    def _extra_rows(self, snapshot: Snapshot, reference: Reference) -> Float[np.ndarray, "k 32"]:
        rows = [task.rows(snapshot, reference) for task in self._extra_tasks]
        A, b = stacked(rows, self._extra_tasks)
        counts = [len(part.b) for part in rows]
        weights = np.repeat([task.weight_at(reference) for task in self._extra_tasks], counts)
        return np.column_stack([A, b, weights]).astype(float, order="C")


def check_extra_tasks(tasks: Sequence[Task]) -> None:
    """Look at the weights of a user's own tasks.

    Raises:
        ConfigError: for a weight that is no number from 0 to ``GREATEST_EXTRA_WEIGHT``.
    """
    for task in tasks:
        weight = task.weight
        if not (is_finite_number(weight) and 0.0 <= float(weight) <= GREATEST_EXTRA_WEIGHT):
            raise ConfigError(
                f"the weight of the task {task.name!r} must be between 0 and "
                f"{GREATEST_EXTRA_WEIGHT:g}, got {weight!r}"
            )


def check_inputs(snapshot: Snapshot, reference: Reference, solver: str) -> None:
    """Look at every array of both.

    Raises:
        QpInfeasible: for the first number that is not finite, by name and place.
        CommandError: for an array that has another shape than it should, or holds no numbers.
    """
    for index in np.flatnonzero(~np.isfinite(snapshot.row)).tolist():
        name, place = layout_of(Snapshot).place(index)
        owner = "snapshot.state" if name in _IN_STATE else "snapshot"
        raise QpInfeasible(solver, f"{owner}.{name}{place} is {snapshot.row[index]}")
    for index in np.flatnonzero(~np.isfinite(reference.row)).tolist():
        name, place = layout_of(Target).place(index)
        value = reference.row[index]
        if {"normal_force_min": -np.inf, "normal_force_max": np.inf}.get(name) != value:
            owner = "reference.body" if name in _IN_BODY else "reference"
            raise QpInfeasible(solver, f"{owner}.{name}{place} is {value}")


def check_problem(problem: Problem, solver: str) -> None:
    """Look at the rows that were made of finite arrays: gains may be too great, a task wrong.

    Raises:
        QpInfeasible: for rows that are not finite, or of a task beyond ``GREATEST_NUMBER``, with
            the name of their task or constraint.
    """
    tasks, equalities, (C, lower, upper) = problem.tasks, problem.equalities, problem.bounds
    parts = [
        (np.abs(tasks.A) <= GREATEST_NUMBER).all(axis=1) & (np.abs(tasks.b) <= GREATEST_NUMBER),
        np.isfinite(equalities.A).all(axis=1) & np.isfinite(equalities.b),
        np.isfinite(C).all(axis=1) & (lower < np.inf) & (upper > -np.inf),
    ]
    bad = np.flatnonzero(~np.concatenate(parts))
    if len(bad):
        source = int(np.searchsorted(np.cumsum(problem.counts), bad[0], side="right"))
        name = problem.sources[source].name
        raise QpInfeasible(solver, f"the rows of {name!r} are not finite, or too great to square")


def _are_numbers(given: object) -> bool:
    try:
        return np.asarray(given).dtype.kind in "bif"
    except ValueError:  # rows of several lengths
        return False


def stacked(rows: Sequence[object], sources: Sequence[Source]) -> Rows:
    """The rows of several tasks or constraints, one below the other.

    Raises:
        ConfigError: for rows that are no (k, 30) and (k,) of numbers.
    """
    parts = list[Rows]()
    for part, source in zip(rows, sources, strict=True):
        if not isinstance(part, Rows) or not all(map(_are_numbers, part)):
            given = " ".join(repr(part).split())
            raise ConfigError(f"rows() of {source.name!r} must give Rows(A, b), got {given:.80}")
        A, b, count = np.shape(part.A), np.shape(part.b), np.size(part.b)
        if b != (count,) or (count, SIZE) != A:
            raise ConfigError(
                f"{source.name!r} has rows of the shapes {A} and {b}, wanted are (k, {SIZE}) and "
                "(k,)"
            )
        parts.append(part)
    return Rows(np.concatenate([r.A for r in parts]), np.concatenate([r.b for r in parts]))
