"""The compiled way through a tick: the tasks and constraints as numbers for one kernel.

Every number is read off the readable ``Task`` and constraint objects, so there is one place for
each. A task of a user's own keeps its ``rows`` and is condensed along.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import TypeVar

import numpy as np
from jaxtyping import Float

from go2_wbc.kernels.layout import DECISION, PROGRAM
from go2_wbc.reference import Reference
from go2_wbc.robot.joint_friction import FrictionFeedForward
from go2_wbc.robot.snapshot import Snapshot
from go2_wbc.wbc.backends import SINGULAR_DETERMINANT
from go2_wbc.wbc.constraints import (
    Equality,
    FrictionPyramid,
    Inequality,
    JointLimits,
    StanceFeetStill,
    TorqueLimits,
)
from go2_wbc.wbc.inputs import stacked
from go2_wbc.wbc.problem import SIZE, Rows
from go2_wbc.wbc.tasks import (
    BodyOrientation,
    BodyPosition,
    ForceRegularisation,
    LegPosture,
    SwingFoot,
    Task,
)

BUILT_IN_TASKS = 5
"""How many of the controller's tasks the kernel knows; a user's own come after them."""

T = TypeVar("T")


class Program:
    """What ``WholeBodyController`` formulates, in the form of ``kernels.condensed``."""

    def __init__(
        self,
        tasks: Sequence[Task],
        constraints: Sequence[Equality | Inequality],
        friction: FrictionFeedForward,
    ) -> None:
        """Read the numbers of the built-in tasks, which come first, and of the constraints."""
        from go2_wbc.algebra.active_set import SOLVED
        from go2_wbc.kernels.condensed import solve_condensed

        self._solve, self._solved = solve_condensed, SOLVED
        position, orientation = _first(BodyPosition, tasks), _first(BodyOrientation, tasks)
        swing, posture = _first(SwingFoot, tasks), _first(LegPosture, tasks)
        force, still = _first(ForceRegularisation, tasks), _first(StanceFeetStill, constraints)
        pyramid = _first(FrictionPyramid, constraints)
        torque, joints = _first(TorqueLimits, constraints), _first(JointLimits, constraints)
        gains = [
            part
            for task in (position, orientation, swing, posture)
            for part in (task.kp, task.kd, task.weight)
        ]
        self._numbers = PROGRAM.pack(
            [
                *gains,
                orientation.flight_weight,
                force.weight,
                force.weight_of_robot,
                still.damping,
                pyramid.friction,
                float(pyramid.keeps_cone),
                torque.motor.peak,
                torque.motor.knee_speed,
                torque.motor.no_load_speed,
                joints.q_lower,
                joints.q_upper,
                joints.speed,
                joints.braking,
                joints.horizon,
                SINGULAR_DETERMINANT,
            ]
        )
        self._friction = friction.numbers
        self._extra_tasks = tasks[BUILT_IN_TASKS:]

    def solve(self, snapshot: Snapshot, reference: Reference) -> Float[np.ndarray, " size"] | None:
        """The decision (see ``kernels.layout.DECISION``); None if the kernel finds no solution."""
        extra = _NO_ROWS
        if self._extra_tasks:
            extra = self._extra_rows(snapshot, reference)
            if not np.isfinite(extra).all():
                return None
        numbers, decision = self._numbers, np.empty(DECISION.size)
        outcome = self._solve(snapshot.row, reference.row, numbers, self._friction, extra, decision)
        return decision if outcome == self._solved else None

    def _extra_rows(self, snapshot: Snapshot, reference: Reference) -> Float[np.ndarray, "k 32"]:
        rows: list[Rows] = [task.rows(snapshot, reference) for task in self._extra_tasks]
        A, b = stacked(rows, self._extra_tasks)
        counts = [len(part.b) for part in rows]
        weights = np.repeat([task.weight for task in self._extra_tasks], counts)
        return np.column_stack([A, b, weights]).astype(float, order="C")


_NO_ROWS = np.empty((0, SIZE + 2))


def _first(kind: type[T], items: Sequence[object]) -> T:
    return next(item for item in items if isinstance(item, kind))
