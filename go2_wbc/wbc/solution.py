"""What the whole-body controller decided, with everything needed to audit it."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from go2_wbc.brief import brief
from go2_wbc.errors import ResidualRow
from go2_wbc.records import Array4x3, Array12, Array18, Array30, layout_of
from go2_wbc.robot.state import JointCommand
from go2_wbc.wbc.condensed import Decision
from go2_wbc.wbc.constraints import torque_map
from go2_wbc.wbc.problem import ACCELERATION, FORCES, Problem
from go2_wbc.wbc.tasks import Task

_Z, _TAU, _MOTORS = (layout_of(Decision).slice(part) for part in ("z", "tau", "tau_motors"))


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
    _z: Array30
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
        return WbcSolution(row[_TAU], row[_MOTORS], solve_time, backend, formulate, row[_Z])

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
        return self._z[ACCELERATION]

    @property
    def forces(self) -> Array4x3:
        """Contact force [N] of each foot in the world frame; zero for legs in the air."""
        return self._z[FORCES].reshape(4, 3)

    @property
    def residuals(self) -> tuple[ResidualRow, ...]:
        """Error of every task and violation of every constraint, in its own unit."""
        return self._formulate().residuals(self._z)

    @property
    def violations(self) -> tuple[ResidualRow, ...]:
        """By how much each constraint is broken, in its own unit; rounding, unless relaxed."""
        problem = self._formulate()
        constraints = len(problem.sources) - sum(isinstance(s, Task) for s in problem.sources)
        return problem.residuals(self._z)[-constraints:]

    @property
    def command(self) -> JointCommand:
        """The motors' torques as a joint command."""
        return JointCommand.torque(self.tau_motors)
