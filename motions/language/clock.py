"""Beats as a measure of time: which instant [s] of a motion a beat is."""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass
from itertools import pairwise

from go2_wbc.errors import TimelineError
from motions.arguments import is_number

SAME = 1e-9
"""Times this close [s] are the same: absorbs rounding of sums."""
LEAST_BEAT = 0.05
"""Beats that follow closer [s] are no ruler: own choice, 1200 a minute; nobody counts so fast."""
MOST_BEATS = 10_000
"""Nor are more than so many: own choice, an hour at 160 a minute."""


@dataclass(frozen=True, slots=True)
class BeatClock:
    """Counts in beats: straight between the instants of two, and on as the last two are apart.

    Attributes:
        instants: when [s] after the start of the motion beats 0, 1, 2 ... are; two or more.
    """

    instants: tuple[float, ...] = (0.0, 1.0)

    @staticmethod
    def steady(interval: float) -> BeatClock:
        """A beat every ``interval`` seconds, from the start of the motion on."""
        return BeatClock((0.0, interval))

    @staticmethod
    def of(times: Iterable[float]) -> BeatClock:
        """Beats at these instants [s].

        Raises:
            TimelineError: unless they are two or more increasing numbers, none below 0.
        """
        instants = list(times)
        for number, time in enumerate(instants):
            if not (is_number(time) and time >= 0.0):
                raise TimelineError(
                    f"beat {number} must be at a time of 0 s or later, got {time!r}"
                )
        for number, (first, second) in enumerate(pairwise(instants)):
            if not second - first > SAME:
                raise TimelineError(
                    f"beats must come one after the other: beat {number} is at {first:g} s, beat "
                    f"{number + 1} at {second:g} s"
                )
        if len(instants) < 2:
            raise TimelineError(f"a tempo needs 2 beats or more, got {len(instants)}")
        return BeatClock(tuple(map(float, instants)))

    def at(self, beat: float) -> float:
        """When [s] ``beat`` is, at least 0; it need not be a whole one."""
        return self.after(self.instants[0], beat)

    def after(self, start: float, beats: float) -> float:
        """When [s] ``beats`` have passed since the instant ``start`` [s]."""
        left, now = beats, start
        for first, second in pairwise(self.instants[:-1]):
            if now < second - SAME:
                share = (second - now) / (second - first)
                if left <= share:
                    return now + left * (second - first)
                left, now = left - share, second
        return now + left * (self.instants[-1] - self.instants[-2])

    @property
    def is_steady(self) -> bool:
        """Whether beats are evenly apart from the start on: a tempo, not a song."""
        return len(self.instants) == 2 and self.instants[0] == 0.0

    def between(self, start: float, end: float) -> tuple[float, ...]:
        """The beats from ``start`` to ``end`` [s], both included.

        Of a tempo they are counted from ``start`` on, as ``after`` counts; of a song they are where
        they are. None if they follow each other closer than ``LEAST_BEAT``, or
        are more than ``MOST_BEATS``.
        """
        first = start if self.is_steady else self.instants[0]
        least = min(late - early for early, late in pairwise(self.instants))
        if least < LEAST_BEAT or end - min(first, start) > MOST_BEATS * least:
            return ()
        gap = self.instants[-1] - self.instants[-2]
        known = (start,) if self.is_steady else self.instants
        more = range(1, int((end - known[-1]) / gap + 1.0) + 1)
        times = (*known, *(known[-1] + beat * gap for beat in more))
        return tuple(time for time in times if start - SAME <= time <= end + SAME)

    def fewest(self, seconds: float) -> int:
        """The fewest whole beats that are nowhere shorter than ``seconds``."""
        shortest = min(second - first for first, second in pairwise(self.instants))
        return math.ceil(seconds / shortest - SAME)
