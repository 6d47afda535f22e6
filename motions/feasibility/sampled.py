"""Results of a check for single samples and their neighbours, stored for the next motion.

Most samples of an edited motion are those of the previous one, perhaps shifted in time. Only the
changed part is computed again, from where the robot stands on all feet some samples before it to
where it does so after it, and replaces the old part. Sums over a motion, and the controller's
corrections, last longer, and are not stored.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, fields, is_dataclass, replace
from typing import Any

import numpy as np
from jaxtyping import Bool, Float

from motions.feasibility.forces import Forces
from motions.feasibility.report import Series
from motions.memory import Memory
from motions.plan.compiled_plan import DynamicSpan, PlanSamples
from motions.plan.trajectory import Trajectory, are_within

BESIDE = 30
"""Samples after which one does not know of another: a spline forgets to a part in 10^17, averages
reach over ``forces.SPREAD``, and limits of time for what may be broken are 0.25 s or less."""
SAME = 1e-9  #: Difference [m, rad, 1] of equal samples: times that are shifted are rounded
BLOCK = 512  #: Samples that are compared at a time
TURN = 1.0  #: Difference [rad] of angles from which on they differ by whole turns


@dataclass(frozen=True, slots=True)
class Sampled:
    """Of every sample of a motion."""

    path: Trajectory
    forces: Forces
    places: Float[np.ndarray, "n 4 3"]  #: see ``forces.places_of``
    p_com: Float[np.ndarray, "n 3"]  #: CoM of the robot with its load [m]
    lost: Float[np.ndarray, "n 6"]  #: see ``forces.lost``
    creep: Float[np.ndarray, "n 4 2"]  #: see ``forces.creep``
    settled: Bool[np.ndarray, "n 4"]  #: see ``forces.settled``
    series: Mapping[str, Series]  #: by check


@dataclass(frozen=True, slots=True)
class Change:
    """Rows ``first`` to ``last`` that have changed, worked out from ``start`` to ``stop``.

    Those behind were ``shift`` rows earlier; ``times`` are those of all rows [s].
    """

    start: int
    first: int
    last: int
    stop: int
    shift: int
    times: Float[np.ndarray, " n"]

    @staticmethod
    def of(
        asked: PlanSamples, numbers: Float[np.ndarray, "n k"], before: Float[np.ndarray, "m k"]
    ) -> Change | None:
        """From ``before`` to ``numbers`` of what is ``asked``; None if all or the start has."""
        count, ahead = len(numbers), _same(numbers, before)
        behind = _same(numbers[ahead:][::-1], before[ahead:][::-1])
        stands = asked.stance.all(axis=1) & (numbers[:, -1] == 0.0)
        stands[0] = stands[-1] = True
        rows = np.flatnonzero(stands)

        def ahead_of(row: int) -> int:
            return int(rows[np.searchsorted(rows, max(row - BESIDE, 0), side="right") - 1])

        def behind_of(row: int) -> int:
            return int(rows[np.searchsorted(rows, min(row + BESIDE, count) - 1)]) + 1

        first, last = ahead_of(ahead), behind_of(count - behind)
        start, stop = ahead_of(first), behind_of(last)
        if not ahead or stop - start == count:
            return None
        return Change(start, first, last, stop, count - len(before), asked.times)

    def part(self, asked: PlanSamples) -> PlanSamples:
        """What is asked of the rows that are worked out anew."""
        rows = slice(self.start, self.stop)
        return replace(asked, **{one.name: getattr(asked, one.name)[rows] for one in fields(asked)})


@dataclass(frozen=True, slots=True)
class _Known:
    """What a memory has of the motion before."""

    numbers: Float[np.ndarray, "n k"]  #: that tell its samples apart
    spans: int  #: how many dynamic ones there are
    sampled: Sampled


Work = Callable[[PlanSamples, Trajectory | None, int], Sampled]
"""Of what is asked; or of a part of it from a row on, in a motion that begins as another one."""


def sampled_of(
    asked: PlanSamples, spans: Sequence[DynamicSpan], work: Work, memory: Memory | None
) -> Sampled:
    """What ``work`` gives for what is ``asked``; for all that the last motion has not, if any."""
    if memory is None:
        return work(asked, None, 0)
    numbers, known = _numbers(asked, are_within(asked.times, spans)), memory.last
    found: Sampled | None = None
    if isinstance(known, _Known) and known.spans == len(spans):
        change = Change.of(asked, numbers, known.numbers)
        if change is not None:
            part = work(change.part(asked), known.sampled.path, change.start)
            joined: Sampled = _joined(change, known.sampled, part, {})
            seam = joined.path.rpy[change.last - 1 : change.last + 1]
            found = None if np.ptp(seam, axis=0).max() > TURN else joined
    found = work(asked, None, 0) if found is None else found
    memory.last = _Known(numbers, len(spans), found)
    return found


def _numbers(asked: PlanSamples, is_dynamic: np.ndarray) -> Float[np.ndarray, "n k"]:
    """What tells samples apart."""
    count = len(asked.times)
    turns, p_feet = asked.R.reshape(count, 9), asked.p_feet.reshape(count, 12)
    whole = [asked.p, turns, asked.q_joints, p_feet, asked.normal_force_max]
    flags = [asked.is_com[:, None], asked.stance, asked.raised, is_dynamic[:, None]]
    return np.hstack(whole + flags)


def _joined(change: Change, old: Any, new: Any, done: dict[int, Any]) -> Any:  # noqa: ANN401 - tables of tables
    """``old``, with what has changed from ``new``, which begins with row ``start``.

    ``done``: what was joined, by what was new: some tables are in several places.
    """
    if isinstance(new, np.ndarray):
        if not old.strides[0] and not new.strides[0]:  # one row that stands for all
            return np.broadcast_to(new[:1], (len(change.times), *new.shape[1:]))
        if id(new) not in done:
            own = new[change.first - change.start : change.last - change.start]
            parts = [old[: change.first], own, old[change.last - change.shift :]]
            done[id(new)] = np.concatenate(parts)
        return done[id(new)]
    if isinstance(new, Mapping):
        return {name: _joined(change, old[name], item, done) for name, item in new.items()}
    if not is_dataclass(new) or isinstance(new, type):
        return new
    tables = {one.name: getattr(new, one.name) for one in fields(new) if one.init}
    tables = {
        name: change.times if name == "times" else _joined(change, getattr(old, name), table, done)
        for name, table in tables.items()
    }
    whole = replace(new, **tables)
    if isinstance(new, Series) and isinstance(whole, Series):
        pairs = zip(old.least, new.least, strict=True)
        least, whose = (_joined(change, *pair, done) for pair in pairs)
        whole.knowing((least, whose))
    return whole


def _same(one: Float[np.ndarray, "n k"], other: Float[np.ndarray, "m k"]) -> int:
    """How many rows at the beginning are equal."""
    count = min(len(one), len(other))
    for row in range(0, count, BLOCK):
        rows = slice(row, min(row + BLOCK, count))
        differ = np.abs(one[rows] - other[rows]) > SAME
        if differ.any():
            return row + int(differ.any(axis=1).argmax())
    return count
