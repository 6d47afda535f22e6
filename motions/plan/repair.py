"""Which parts of a motion are to be replaced by the nearest that the robot can do, and how."""

from __future__ import annotations

from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np
from jaxtyping import Float, Int

from go2_wbc.errors import PlanNotFound, TimelineError
from motions.dynamics.knots import true_spans
from motions.dynamics.projection import PlanTarget
from motions.language.keys import BalanceShift, Key
from motions.language.timeline import Timeline
from motions.plan.trajectory import Trajectory

LEAST_REST = 0.1
"""Time [s] at rest from which on a motion falls into parts there: own choice. Between two poses the
trunk rests for an instant only, and a solver that must meet it there is worse off; at home, where a
motion ends, an instant is enough."""
LEAD = 0.3
"""Time [s] at rest that is solved with what follows or goes before, if there is so much: to begin a
quick move early, and to come to rest after it. Own choice, 1.7 times sqrt(0.29 m / g)."""
SLOW = 5e-4
"""Way [m, rad] between two samples, at most, of what does not just pass home: 0.05 /s."""
NEAR = 10
"""Samples beside a rest that are as good as part of it: moves begin and end slowly."""
SAME = 1e-4
"""Difference [m, rad] of configurations that counts as none; splines ring by less."""


@dataclass(frozen=True, slots=True)
class Piece:
    """A part of a motion, from rest to rest.

    Attributes:
        first, last: rows of its path.
        start, end: when [s] in the motion.
    """

    first: int
    last: int
    start: float
    end: float

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
    rows = np.minimum(np.searchsorted(times, broken - SAME), last)
    edges = [(0, 0), *_rests(path, as_checked, rows), (last, last)]
    pieces: list[Piece] = []
    for (before, start), (end, after) in pairwise(edges):
        if not ((rows >= start) & ((rows < end) | (end == last))).any():
            continue
        first = max(before, int(np.searchsorted(times, times[start] - LEAD - SAME)))
        final = min(after, int(np.searchsorted(times, times[end] + LEAD - SAME)))
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
    is_ready = np.abs(path.q - as_checked.q).max(axis=1) < SAME
    is_ready &= path.stance.all(axis=1) & as_checked.stance.all(axis=1)
    steps = np.abs(np.diff(path.q, axis=0)).max(axis=1)
    moves = np.maximum([0.0, *steps], [*steps, 0.0])
    at_home = np.abs(path.q[:, 7:] - path.q[0, 7:]).max(axis=1) < SAME
    rests = []
    for first, last in true_spans((steps < SAME * np.diff(path.times)) & is_ready[1:]):
        if path.times[last] - path.times[first] > LEAST_REST - SAME:
            rests.append((first, last))
            at_home[max(first - NEAR, 0) : last + NEAR] = False
    for first, end in true_spans(at_home & is_ready & (moves < SLOW)):
        slowest = first + int(np.argmin(moves[first:end]))
        rests += [(slowest, slowest)] if first > 0 and end < len(moves) else []
    return sorted((a, b) for a, b in rests if not ((broken > a) & (broken < b)).any())
