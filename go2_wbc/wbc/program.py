"""The compiled way through a tick: the tasks and constraints as numbers for one kernel.

Every number is read off the readable ``Task`` and constraint objects, so there is one place for
each. A task of a user's own keeps its ``rows`` and is condensed along.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from jaxtyping import Float

from go2_wbc.kernels.layout import PROGRAM
from go2_wbc.reference import Reference
from go2_wbc.robot.snapshot import Snapshot
from go2_wbc.wbc.constraints import (
    Equality,
    FloatingBaseDynamics,
    FrictionPyramid,
    Inequality,
    JointLimits,
    StanceFeetStill,
    TorqueLimits,
)
from go2_wbc.wbc.problem import SIZE, Rows
from go2_wbc.wbc.tasks import (
    BodyOrientation,
    BodyPosition,
    ForceRegularisation,
    LegPosture,
    SwingFoot,
    Task,
)

TASKS = (BodyPosition, BodyOrientation, SwingFoot, LegPosture, ForceRegularisation)
CONSTRAINTS = (
    FloatingBaseDynamics,
    StanceFeetStill,
    FrictionPyramid,
    TorqueLimits,
    JointLimits,
)


class Program:
    """What ``WholeBodyController`` formulates, in the form of ``kernels.condensed``."""

    def __init__(
        self, tasks: Sequence[Task], constraints: Sequence[Equality | Inequality]
    ) -> None:
        """Read the numbers of the built-in tasks, which come first, and of the constraints."""
        position, orientation, swing, posture, force = tasks[: len(TASKS)]
        _, still, friction, torque, joints = constraints
        assert isinstance(position, BodyPosition)
        assert isinstance(orientation, BodyOrientation)
        assert isinstance(swing, SwingFoot)
        assert isinstance(posture, LegPosture)
        assert isinstance(force, ForceRegularisation)
        assert isinstance(still, StanceFeetStill)
        assert isinstance(friction, FrictionPyramid)
        assert isinstance(torque, TorqueLimits)
        assert isinstance(joints, JointLimits)
        gains = [
            part
            for task in (position, orientation, swing, posture)
            for part in (task.kp, task.kd, task.weight)
        ]
        self._numbers = PROGRAM.pack(
            [
                *gains,
                force.weight,
                force.weight_of_robot,
                still.damping,
                friction.friction,
                torque.limits,
                joints.q_lower,
                joints.q_upper,
                joints.speed,
                joints.braking,
                joints.horizon,
            ]
        )
        self._extra_tasks = tasks[len(TASKS) :]

    @staticmethod
    def covers(tasks: Sequence[Task], constraints: Sequence[Equality | Inequality]) -> bool:
        """Whether the kernel knows every constraint, and the first tasks, by their kinds."""
        kinds = tuple(type(task) for task in tasks[: len(TASKS)])
        return kinds == TASKS and tuple(type(item) for item in constraints) == CONSTRAINTS

    def solve(
        self, snapshot: Snapshot, reference: Reference
    ) -> tuple[Float[np.ndarray, "30"], Float[np.ndarray, "12"]] | None:
        """Decision z (see ``problem``) and torques [N m]; None if the kernel finds no solution."""
        from go2_wbc.kernels.active_set import SOLVED
        from go2_wbc.kernels.condensed import solve_condensed

        A, b, weights = self._extra_rows(snapshot, reference)
        state = snapshot.state
        q, v = np.ascontiguousarray(state.q), np.ascontiguousarray(state.v)
        z, tau = np.empty(SIZE), np.empty(12)
        outcome = solve_condensed(
            q, v, snapshot.row, reference.row, self._numbers, A, b, weights, z, tau
        )
        return (z, tau) if outcome == SOLVED else None

    def _extra_rows(
        self, snapshot: Snapshot, reference: Reference
    ) -> tuple[Float[np.ndarray, "k 30"], Float[np.ndarray, " k"], Float[np.ndarray, " k"]]:
        if not self._extra_tasks:
            return _NO_ROWS
        rows: list[Rows] = [task.rows(snapshot, reference) for task in self._extra_tasks]
        counts = [len(part.b) for part in rows]
        weights = np.repeat([task.weight for task in self._extra_tasks], counts)
        A, b = np.concatenate([r.A for r in rows]), np.concatenate([r.b for r in rows])
        return np.ascontiguousarray(A, float), b.astype(float), weights.astype(float)


_NO_ROWS = (np.empty((0, SIZE)), np.empty(0), np.empty(0))
