"""What a timeline is made of, and how calls add to it: keys, a cursor, beats as a measure of time.

The classes beside this one hold the calls that authors make; ``Timeline`` has them all.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field, fields
from itertools import pairwise
from operator import attrgetter
from typing import Self, TypeVar

from go2_wbc.brief import inline_html
from go2_wbc.curves import Ease
from go2_wbc.errors import TimelineError, unknown_name
from go2_wbc.legs import Leg
from go2_wbc.motion_plan import Posture
from motions.arguments import is_number, positive
from motions.dynamics.phases import Tolerance
from motions.language.keys import BODY_CHANNELS, BalanceShift, BodyKey, Key, LegKey

SAME = 1e-9  #: Times this close [s] are the same: absorbs rounding of sums
LEAST_BEAT = 0.05
"""Beats that follow closer [s] are no ruler: own choice, 1200 a minute; nobody counts so fast."""
MOST_BEATS = 10_000  #: Nor are more than so many: own choice, an hour at 160 a minute


@dataclass(frozen=True, slots=True)
class BeatClock:
    """Counts in beats: straight between the instants of two, and on as the last two are apart."""

    instants: tuple[float, ...] = (0.0, 1.0)
    """When [s] after the start of the motion beats 0, 1, 2 ... are; two or more."""

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


LONGEST = 1200.0
"""Time [s] that a motion may take unless ``Timeline(longest=...)`` says more: a check of 20 minutes
of steps takes as long as these."""
SHIFT_TIME = 0.9
"""Time [s] in which the body moves over the feet that stay, before another one is raised."""
AS_WRITTEN, NEAREST = PHYSICS = ("as_written", "nearest")
"""What may be made of a motion that the robot cannot do: nothing, or the nearest that it can."""

_KeyType = TypeVar("_KeyType", bound=Key)
_Some = TypeVar("_Some", bound="TimelineData")


@dataclass(frozen=True, slots=True)
class TimelineData:
    """An authored motion."""

    entry: Posture = Posture.STAND
    exit: Posture = Posture.STAND
    name: str = field(default="motion", kw_only=True)
    balance: bool = field(default=True, kw_only=True)
    """Whether the body moves over the standing feet before one is raised."""
    shift_time: float = field(default=SHIFT_TIME, kw_only=True)
    """How long [s] that takes, before a tempo is set."""
    physics: str = field(default=AS_WRITTEN, kw_only=True)
    """``"as_written"``, or ``"nearest"``: what the robot cannot do as written is solved as the
    nearest motion that it can."""
    tolerance: Tolerance = field(default=Tolerance(), kw_only=True)  #: of what is solved
    longest: float = field(default=LONGEST, kw_only=True)
    """How long [s] it may become; a slip of the pen is no motion of a day."""
    keys: tuple[Key, ...] = field(default=(), kw_only=True)  #: what was written so far
    cursor: float = field(default=0.0, kw_only=True)  #: when [s] the next call starts
    clock: BeatClock = field(default=BeatClock(), kw_only=True)
    """What one unit of ``over`` lasts, here and later."""
    shift_beats: float = field(default=0.0, kw_only=True)
    """How many beats a shift takes with a tempo; 0 without one."""
    counted: tuple[float, ...] = field(default=(), kw_only=True)
    """Beats [s] of what was written before the present tempo."""
    counted_from: float = field(default=0.0, kw_only=True)  #: since when [s] the present one counts
    last_start: float = field(default=0.0, kw_only=True)  #: when [s] the last call's move starts
    floor: float = field(default=0.0, kw_only=True)
    """The cursor does not fall behind this time [s] after ``also``."""
    latest: float = field(default=0.0, init=False, compare=False)  #: when [s] its last key ends

    _repr_html_ = inline_html

    def __repr__(self) -> str:
        ends = f"{self.entry.value} to {self.exit.value}"
        return f"Timeline({self.name!r}, {self.end:.2f} s, {len(self.keys)} moves, {ends})"

    def __post_init__(self) -> None:
        """Raise TimelineError for what is out of range, or a track that moves twice at once."""
        if not isinstance(self.name, str):
            raise TimelineError(f"name must be a word, got {self.name!r}")
        if not isinstance(self.balance, bool):
            raise TimelineError(f"balance must be True or False, got {self.balance!r}")
        for name in ("entry", "exit"):
            if not isinstance(getattr(self, name), Posture):
                valid = ", ".join(f"Posture.{posture.name}" for posture in Posture)
                raise TimelineError(
                    f"{name} must be one of {valid} (from motions import Posture), got "
                    f"{getattr(self, name)!r}"
                )
        positive("shift_time", self.shift_time)
        if str(self.physics) not in PHYSICS:
            raise TimelineError(unknown_name("physics", str(self.physics), PHYSICS))
        if not isinstance(self.tolerance, Tolerance):
            raise TimelineError(
                f"tolerance must be a Tolerance(position [m], angle [rad]), got {self.tolerance!r}"
            )
        object.__setattr__(self, "latest", max((key.end for key in self.keys), default=0.0))
        self._require_length(self.end)
        _require_no_overlap(self.keys)

    def _require_length(self, end: float) -> None:
        if end > positive("longest", self.longest):
            raise TimelineError(
                f"a motion of {end:g} s is longer than {self.longest:g} s: "
                f"Timeline(longest={math.ceil(end):g}) allows it, if that is meant"
            )

    # --- what is written ------------------------------------------------------------------

    @property
    def end(self) -> float:
        """When [s] the last part ends."""
        return max([self.cursor, *(key.end for key in self.keys)])

    @property
    def beats(self) -> tuple[float, ...]:
        """When [s] the beats are that it counts in; none without a tempo."""
        return self._beats_until(self.end)

    @property
    def raised(self) -> frozenset[Leg]:
        """Legs whose last key leaves them in the air."""
        last = {key.leg: key.target for key in self.in_order(LegKey)}
        return frozenset(leg for leg, target in last.items() if not target.is_on_ground)

    @property
    def shifted_for(self) -> frozenset[Leg]:
        """Legs for whose absence the trunk has moved over the other feet."""
        shifts = self.in_order(BalanceShift)
        return shifts[-1].raised if shifts else frozenset()

    @property
    def _away(self) -> list[str]:
        """What its last keys leave elsewhere than at home, in words."""
        values = self._body_values
        away = [f"body {name}" for name in BODY_CHANNELS if values.get(name)]
        away += [f"foot {leg.name}" for leg in sorted(self.raised)]
        return [*away, "balance"] if self.shifted_for else away

    def body_value(self, channel: str) -> float:
        """Where the last key leaves a channel of the body."""
        return self._body_values.get(channel, 0.0)

    @property
    def _body_values(self) -> dict[str, float]:
        return {key.channel: key.value for key in self.in_order(BodyKey)}

    def in_order(self, kind: type[_KeyType]) -> list[_KeyType]:
        """Its keys of one kind, by their starts."""
        keys = [key for key in self.keys if isinstance(key, kind)]
        return sorted(keys, key=lambda key: key.start)

    # --- how it is written ----------------------------------------------------------------

    def _shifted(self, raised: frozenset[Leg]) -> Self:
        if not self.balance or self.shifted_for == raised:
            return self
        end = self.cursor + self.shift_time
        if self.shift_beats:
            end = self.clock.after(self.cursor, self.shift_beats)
        return self._longer([BalanceShift(self.cursor, end, Ease.MINIMUM_JERK, raised)], end)

    def _longer(self, keys: Sequence[Key], cursor: float) -> Self:
        first = min((key.start for key in keys), default=self.cursor)
        latest = max([self.latest, *(key.end for key in keys)])
        longer = unchecked(
            self,
            keys=(*self.keys, *keys),
            cursor=max(cursor, self.floor),
            last_start=first,
            floor=0.0,
            latest=latest,
        )
        longer._require_length(max(longer.cursor, latest))
        is_behind = self.latest <= first + SAME  # all of them: a long motion is not gone through
        meanwhile = [] if is_behind else [key for key in self.keys if key.end > first]
        _require_no_overlap([*meanwhile, *keys])
        return longer

    def _joined(self, other: TimelineData, start: float) -> Self:
        return self._longer([key.later(start) for key in other.keys], start + other.end)

    def _beats_until(self, end: float) -> tuple[float, ...]:
        now = self.clock.between(self.counted_from, end) if self.shift_beats else ()
        return distinct(*self.counted, *now)

    def _span(self, over: float) -> tuple[float, float]:
        return self.cursor, self.clock.after(self.cursor, positive("over", over))


_FIELDS = tuple(item.name for item in fields(TimelineData))
_all_of = attrgetter(*_FIELDS)
_SLOTS = tuple(vars(TimelineData)[name].__set__ for name in _FIELDS)


def unchecked(timeline: _Some, **values: object) -> _Some:
    """A copy with other ``values``, of which it is known that they are valid."""
    other: _Some = object.__new__(type(timeline))
    for put, value in zip(_SLOTS, _all_of(timeline), strict=True):
        put(other, value)
    for name, value in values.items():
        object.__setattr__(other, name, value)
    return other


def distinct(*instants: float) -> tuple[float, ...]:
    """The increasing ``instants`` [s], each once."""
    kept = list[float]()
    for instant in instants:
        if not kept or instant > kept[-1] + SAME:
            kept.append(instant)
    return tuple(kept)


def _require_no_overlap(keys: Sequence[Key]) -> None:
    last: dict[str, Key] = {}
    for key in sorted(keys, key=lambda key: key.start):
        before = last.get(key.track)
        if before is not None and key.start < before.end - SAME:
            raise TimelineError(
                f"{key.track} moves twice at once: {before.start:.2f} to {before.end:.2f} s and "
                f"{key.start:.2f} to {key.end:.2f} s"
            )
        last[key.track] = key
