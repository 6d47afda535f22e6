"""The whole-body controller: (snapshot, reference) -> torques, by one quadratic program a tick."""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from dataclasses import replace
from functools import partial
from typing import Any

import numpy as np
from jaxtyping import Float

from go2_wbc.algebra.active_set import SOLVED
from go2_wbc.errors import ConfigError, QpInfeasible, unknown_name
from go2_wbc.records import Array30, layout_of, packed
from go2_wbc.reference import Reference
from go2_wbc.robot.joint_friction import FrictionFeedForward
from go2_wbc.robot.model import RobotModel
from go2_wbc.robot.snapshot import Snapshot
from go2_wbc.wbc.backends import solve_condensed, solve_full
from go2_wbc.wbc.condensed import Decision, QpNumbers, Workspace, solve_tick
from go2_wbc.wbc.config import WbcConfig
from go2_wbc.wbc.constraints import Constraints, Equality, FloatingBaseDynamics, Inequality
from go2_wbc.wbc.inputs import check_extra_tasks, check_inputs, check_problem, stacked
from go2_wbc.wbc.problem import SIZE, Bounds, Problem
from go2_wbc.wbc.relaxation import solve_relaxed
from go2_wbc.wbc.solution import WbcSolution
from go2_wbc.wbc.solvers import check_solver
from go2_wbc.wbc.tasks import BuiltInTasks, Task


class WholeBodyController:
    """Torques that follow a reference as well as physics and the limits allow.

    Tasks (weighted least squares) and constraints are described in ``tasks`` and ``constraints``;
    ``backend`` is "condensed" (default), "full" (the same QP without elimination), or "placo".
    """

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

    def _back_end(self, name: str) -> tuple[str, Callable[[Problem], Array30]]:
        """Which solver it has, and how it solves an assembled problem."""
        solver = check_solver(self.config.solver)
        if name == "placo":
            from go2_wbc.wbc.placo_backend import SOLVER, PlacoBackend

            return SOLVER, PlacoBackend(self.model, self.config).solve
        ours = {"condensed": solve_condensed, "full": solve_full}
        if name not in ours:
            raise ConfigError(unknown_name("WBC back end", name, (*ours, "placo")))
        return solver, partial(ours[name], solver=solver)

    def formulate(self, snapshot: Snapshot, reference: Reference) -> Problem:
        """The QP of this tick."""
        task_rows = [task.rows(snapshot, reference) for task in self.tasks]
        equality_rows = [item.rows(snapshot, reference) for item in self.equalities]
        bounds = [item.bounds(snapshot, reference) for item in self.inequalities]
        task_counts = [len(rows.b) for rows in task_rows]
        return Problem(
            snapshot=snapshot,
            reference=reference,
            tasks=stacked(task_rows, self.tasks),
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

    def _relaxed(self, problem: Problem, error: QpInfeasible) -> Array30:
        try:
            return solve_relaxed(problem, self.config.solver)
        except QpInfeasible as contradiction:
            raise error from contradiction

    @property
    def is_compiled(self) -> bool:
        """Whether ticks are solved by the compiled kernel: condensed, and by ``active_set``."""
        return self._is_compiled

    def solve_compiled(self, snapshot: Snapshot, reference: Reference) -> WbcSolution | None:
        """Solve one tick by the kernel; None if it is not used here or finds no solution."""
        if not self.is_compiled:
            return None
        start = time.perf_counter()
        extra = _NO_ROWS
        if self._extra_tasks:
            extra = self._extra_rows(snapshot, reference)
            if not np.isfinite(extra).all():
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


_NO_ROWS, _DECISION = np.empty((0, SIZE + 2)), layout_of(Decision).size
