"""What no back end may be given: numbers that are not finite, arrays of another shape.

A nan makes its way through a solver in many forms: one takes seconds to give up, another takes a
nan bound for an open side, and an infinite least force is no bound to a third. So every back end is
asked only after the arrays were looked at, used or not, and the error names the first bad number.
The least normal force may be -inf and the greatest inf: there is no such bound then.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from jaxtyping import Float

from go2_wbc.compilation import subroutine
from go2_wbc.errors import ConfigError, QpInfeasible
from go2_wbc.records import layout_of, numbers_of
from go2_wbc.reference import BodyTarget, Reference, Target
from go2_wbc.robot.snapshot import Snapshot
from go2_wbc.validation import is_finite_number
from go2_wbc.wbc.problem import SIZE, Problem, Rows, Source
from go2_wbc.wbc.tasks import Task

GREATEST_EXTRA_WEIGHT = 1e4
"""Weight of a user's own task beyond which nothing is left of the others' accuracy."""
_IN_BODY = frozenset(BodyTarget.__dataclass_fields__)
_IN_STATE = ("q", "v")
_FORCES_START = layout_of(Target).slice("normal_force_min").start
_FORCES_END = layout_of(Target).slice("normal_force_max").stop


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
        QpInfeasible: for rows that are not finite, with the name of their task or constraint.
    """
    tasks, equalities, (C, lower, upper) = problem.tasks, problem.equalities, problem.bounds
    parts = [
        np.isfinite(tasks.A).all(axis=1) & np.isfinite(tasks.b),
        np.isfinite(equalities.A).all(axis=1) & np.isfinite(equalities.b),
        np.isfinite(C).all(axis=1) & (lower < np.inf) & (upper > -np.inf),
    ]
    bad = np.flatnonzero(~np.concatenate(parts))
    if len(bad):
        source = int(np.searchsorted(np.cumsum(problem.counts), bad[0], side="right"))
        name = problem.sources[source].name
        raise QpInfeasible(solver, f"the rows of {name!r} are not finite")


def stacked(rows: Sequence[Rows], sources: Sequence[Source]) -> Rows:
    """The rows of several tasks or constraints, one below the other.

    Raises:
        ConfigError: for rows that are no (k, 30) and (k,).
    """
    for part, source in zip(rows, sources, strict=True):
        if np.shape(part.b) != (len(part.b),) or np.shape(part.A) != (len(part.b), SIZE):
            raise ConfigError(
                f"{source.name!r} has rows of the shapes {np.shape(part.A)} and "
                f"{np.shape(part.b)}, wanted are (k, {SIZE}) and (k,)"
            )
    return Rows(np.concatenate([r.A for r in rows]), np.concatenate([r.b for r in rows]))


@subroutine
def is_finite(row: Float[np.ndarray, " n"]) -> bool:
    """Whether every number is finite. Without branches it takes a fifth."""
    count = 0
    for i in range(len(row)):
        count += abs(row[i]) < np.inf
    return count == len(row)


@subroutine
def are_valid(now: Snapshot, target: Target) -> bool:
    """What ``check_inputs`` demands."""
    asked = numbers_of(target)
    for leg in range(4):
        if not (target.normal_force_min[leg] < np.inf and target.normal_force_max[leg] > -np.inf):
            return False
    return (
        is_finite(numbers_of(now))
        and is_finite(asked[:_FORCES_START])
        and is_finite(asked[_FORCES_END:])
    )
