"""Time and order: tempo, putting motions together, and making one into another."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from dataclasses import replace
from typing import Any, Self

from go2_wbc.arguments import typed
from go2_wbc.curves import Ease
from go2_wbc.errors import TimelineError
from go2_wbc.legs import Leg
from go2_wbc.validation import LARGEST
from motions import arguments
from motions.arguments import is_number, positive, quantity
from motions.language.keys import (
    ON_GROUND,
    BalanceShift,
    BodyKey,
    BodyPathKey,
    FootHold,
    Key,
    LegKey,
    Mark,
    PhaseKey,
    PostureKey,
    StepKey,
    backwards,
)
from motions.language.timeline_data import LEAST_BEAT, SAME, BeatClock, TimelineData, distinct

SLOWEST, FASTEST = 1.0, 60.0 / LEAST_BEAT
"""Beats a minute of a tempo: own choice, nobody counts slower or faster."""
SHORTEST = 0.1  #: Time [s] that a repetition counts at the least against the longest motion
_TIMES = ("cursor", "last_start", "floor", "counted_from")


class Arrangement(TimelineData):
    """When things happen, what follows what, and what can be made of it."""

    __slots__ = ()

    # --- time -----------------------------------------------------------------------------

    @typed("name", error=TimelineError)
    def hold(self, seconds: float, *, name: str = "", foot: Leg | str | None = None) -> Self:
        """Stay as it is for this long.

        Args:
            seconds: how long.
            name: marks the span for who looks at the result.
            foot: a raised one that must be measured at its height meanwhile, for the motion to
                count as done.

        Raises:
            TimelineError: for a foot on the ground, or in a span without a name.
        """
        start, end = self._span(seconds)
        marks = [Mark(start, end, Ease.LINEAR, name)] if name else []
        if foot is not None:
            leg = arguments.foot(foot)
            if leg not in self.raised or not name:
                raise TimelineError(f"hold(): foot {leg.name} must be raised, and the span named")
            marks = [FootHold(start, end, Ease.LINEAR, name, leg)]
        return self._longer(marks, end)

    def also(self) -> Self:
        """Let the next call start when the last one's move starts, not when it ends."""
        return replace(self, cursor=self.last_start, floor=self.cursor)

    def at(self, t: float) -> Self:
        """Put the cursor ``t`` seconds (beats) after the start of the motion.

        Raises:
            TimelineError: for a time before the start, or none.
        """
        if not (is_number(t) and t >= 0.0):
            raise TimelineError(f"at() needs a time of 0 s or later, got {t!r}")
        return replace(self, cursor=self.clock.at(t))

    def bpm(self, beats_per_minute: float, *, shift_time: float | None = None) -> Self:
        """Count ``over``, ``hold`` and ``at`` in beats from here on.

        Before a foot is raised the trunk then moves aside in ``shift_time`` beats; by default in
        the fewest whole beats that are no shorter than the timeline's ``shift_time``.

        Raises:
            TimelineError: for a tempo that is out of range.
        """
        if not SLOWEST <= positive("bpm", beats_per_minute) <= FASTEST:
            raise TimelineError(
                f"bpm must be {SLOWEST:g} to {FASTEST:g} beats a minute, got {beats_per_minute!r}"
            )
        interval = 60.0 / beats_per_minute
        return self._counted(BeatClock.steady(interval), shift_time)

    @typed("times", error=TimelineError, late=True)
    def on_beats(self, times: Iterable[float], *, shift_time: float | None = None) -> Self:
        """Count in the beats at these ``times`` [s] of the motion from here on.

        ``at(0)`` is the first of them. Between two beats time goes evenly; after the last one, and
        before the first, beats are as far apart as the nearest two.

        Args:
            times: increasing instants, such as ``beats("song.wav").times``.
            shift_time: as for ``bpm``, in beats.

        Raises:
            TimelineError: for fewer than two times, or times that do not increase from 0 s on.
        """
        return self._counted(BeatClock.of(times), shift_time)

    def _counted(self, clock: BeatClock, shift_time: float | None) -> Self:
        beats = float(clock.fewest(self.shift_time))
        if shift_time is not None:
            beats = positive("shift_time", shift_time)
        counted = self._beats_until(self.cursor)
        return replace(
            self, clock=clock, shift_beats=beats, counted=counted, counted_from=self.cursor
        )

    # --- putting motions together ---------------------------------------------------------

    def then(self, *others: TimelineData) -> Self:
        """This motion, then the others; each starts in the posture in which the last one ends.

        Raises:
            TimelineError: for what is no timeline, if the postures differ, or one before the last
                does not end at home.
        """
        line = self
        for other in _written("then()", others):
            if other.entry is not line.exit:
                raise TimelineError(
                    f"then(): this ends in {line.exit.value}, the next starts in "
                    f"{other.entry.value}"
                )
            line._require_home("then()")
            counted = distinct(*line.beats, *(line.end + beat for beat in other.beats))
            line = replace(line._joined(other, line.end), exit=other.exit, counted=counted)
            line = replace(line, counted_from=line.end)
        return line

    def together(self, *others: TimelineData) -> Self:
        """Do all of ``others`` at the same time, from the cursor on; they may not share a part.

        Raises:
            TimelineError: for what is no timeline, or where two move the same part.
        """
        line, start = self, self.cursor
        for other in _written("together()", others):
            line = line._joined(other, start)
        return replace(line, cursor=max([start, *(start + other.end for other in others)]))

    def repeat(self, times: int) -> Self:
        """This whole motion, ``times`` times one after another; it must end as it began.

        Raises:
            TimelineError: for a number below 1, another end than start, or too long a motion.
        """
        if isinstance(times, bool) or not isinstance(times, int) or not 1 <= times <= LARGEST:
            raise TimelineError(f"repeat() needs a whole number of 1 or more, got {times!r:.80}")
        self._require_length(times * max(self.end, SHORTEST))
        return self.then(*[self] * (times - 1))

    def mirror(self) -> Self:
        """The same motion with left and right exchanged."""
        return replace(self, keys=tuple(key.mirrored for key in self.keys))

    # --- made into another ----------------------------------------------------------------

    def scale_time(self, factor: float) -> Self:
        """The same motion, ``factor`` times as long: 2 is half as fast.

        Raises:
            TimelineError: for a factor that is not above 0.
        """
        longer = positive("factor", factor)
        keys = tuple(key.slower(longer) for key in self.keys)
        return self._retimed(keys, lambda t: longer * t, longer)

    def scale(self, amplitude: float) -> Self:
        """The same motion with all offsets of trunk and feet multiplied: 0.5 is half as large.

        Postures and the angles of ``leg`` and ``joint`` are no offsets, and stay.

        Raises:
            TimelineError: for a factor that is not above 0.
        """
        share = positive("amplitude", amplitude)
        return replace(self, keys=tuple(key.scaled(share) for key in self.keys))

    def scale_shifts(self, factor: float) -> Self:
        """The same motion, its moves over the feet that stay, and back, ``factor`` times as long.

        What follows comes later; what goes on meanwhile takes as much longer. See ``shift_time``.

        Raises:
            TimelineError: for a factor that is not above 0.
        """
        longer = positive("factor", factor) - 1.0
        shifts = [
            (key.start, key.end)
            for key in self.keys
            if isinstance(key, BalanceShift) and not key.is_swaying
        ]

        def when(t: float) -> float:
            return t + longer * sum(min(max(t - start, 0.0), end - start) for start, end in shifts)

        keys = tuple(key.retimed(when) for key in self.keys)
        return self._retimed(keys, when, 1.0 + longer)

    def scale_jumps(self, share: float) -> Self:
        """The same motion, its dynamic blocks ``share`` as high, as far and as steep.

        Flights last as long as that takes, and what follows comes sooner; turns stay.

        Raises:
            TimelineError: of a motion without a dynamic block, or that keeps a tempo.
        """
        share = positive("share", share)
        keys = [key.smaller(share) if isinstance(key, PhaseKey) else key for key in self.keys]
        saved = [
            (old.end, old.end - new.end)
            for old, new in zip(self.keys, keys, strict=True)
            if isinstance(old, PhaseKey)
        ]
        if not saved or self.shift_beats:
            raise TimelineError("scale_jumps() needs a dynamic block, and no tempo to be kept")

        def when(t: float) -> float:
            return t - sum(less for end, less in saved if end <= t + SAME)

        return self._retimed(tuple(key.retimed(when) for key in keys), when, 1.0)

    def _retimed(
        self, keys: tuple[Key, ...], when: Callable[[float], float], factor: float
    ) -> Self:
        """With ``keys``, its instants where ``when`` puts them, and ``factor`` times its shifts."""
        return replace(
            self,
            keys=keys,
            clock=BeatClock(tuple(map(when, self.clock.instants))),
            shift_time=factor * self.shift_time,
            counted=tuple(map(when, self.counted)),
            **{name: when(getattr(self, name)) for name in _TIMES},
        )

    def shift_height(self, z: float) -> Self:
        """The same motion with the trunk ``z`` [m] higher; negative: lower.

        It goes there in the first move and comes back in the last.

        Raises:
            TimelineError: of a motion of fewer than two moves, one after the other, or with a
                dynamic block, which starts and ends at its own height.
        """
        offset, moves = quantity("z", z), [key for key in self.keys if not isinstance(key, Mark)]
        first = min(moves, key=lambda key: (key.start, -key.end), default=None)
        last = max(moves, key=lambda key: (key.end, -key.start), default=None)
        if first is None or last is None or last.start < first.end - SAME:
            raise TimelineError("shift_height() needs two moves, one after the other")
        if any(isinstance(key, PhaseKey) for key in moves):
            raise TimelineError("shift_height() does not work with a dynamic block")
        heights = [key for key in moves if isinstance(key, BodyKey) and key.channel == "z"]
        before = [key for key in heights if key.end <= last.start + SAME]
        keys: list[Key] = [key for key in self.keys if key not in before]
        keys += [key.moved(offset) for key in before]
        for move, goal in ((first, offset), (last, self.body_value("z"))):
            if not any(key.start < move.end and move.start < key.end for key in heights):
                keys.append(BodyKey(move.start, move.end, Ease.MINIMUM_JERK, "z", goal))
        return replace(self, keys=tuple(keys))

    def _reversed(self, steps: Mapping[StepKey, StepKey]) -> Self:
        """The same motion backwards; ``steps`` are those back, for every step.

        Raises:
            TimelineError: if it does not end at home, or holds a call that has no way back.
        """
        self._require_home("reverse()")
        end, last = self.end, dict[str, Any]()
        keys = list[Key]()
        for key in sorted(self.keys, key=lambda key: key.start):
            is_step = isinstance(key, StepKey)
            keys.append(steps[key] if is_step else _backwards(key, last, self, end))
        counted = tuple(end - beat for beat in reversed(self.beats))
        line = replace(self, keys=tuple(keys), entry=self.exit, exit=self.entry)
        return replace(line, cursor=end, floor=0.0, counted=counted, counted_from=end)

    def loop(self, until: float) -> Self:
        """This whole motion, over and over, as often as it fits into ``until`` seconds.

        Raises:
            TimelineError: if it does not fit once, or does not end as it began.
        """
        times = int((positive("until", until) + SAME) / self.end) if self.end else 0
        if times < 1:
            raise TimelineError(
                f"loop(): {until:g} s are less than the motion takes, {self.end:.2f} s"
            )
        return self.repeat(times)

    def _require_home(self, what: str) -> None:
        if away := ", ".join(self._away):
            raise TimelineError(f"{what} needs motions that end at home(); away: {away}")


def _written(call: str, others: tuple[TimelineData, ...]) -> tuple[TimelineData, ...]:
    for other in others:
        if not isinstance(other, TimelineData):
            hint = f"; is it of the library? load_motion({other!r})" if type(other) is str else ""
            raise TimelineError(f"{call} takes timelines, got {other!r}{hint}")
    return others


_GOALS: dict[type[Key], tuple[str, Callable[[Arrangement], Any]]] = {
    BodyKey: ("value", lambda line: 0.0),
    BodyPathKey: ("value", lambda line: 0.0),
    PostureKey: ("posture", lambda line: line.entry),
    LegKey: ("target", lambda line: ON_GROUND),
    BalanceShift: ("raised", lambda line: frozenset()),
}
"""What each key leads to, and where its track is before the first one."""


def _backwards(key: Key, last: dict[str, Any], line: Arrangement, end: float) -> Key:
    """The key that leads back to where ``key`` came from; ``last``: where each track is."""
    turned = replace(key, start=end - key.end, end=end - key.start, ease=backwards(key.ease))
    if isinstance(key, Mark):
        return turned
    if type(key) not in _GOALS:
        raise TimelineError(f"reverse() does not work with {key.track}: it has no way back")
    name, first = _GOALS[type(key)]
    before = last.get(key.track, first(line))
    last[key.track] = getattr(key, name)
    if isinstance(turned, BodyPathKey):
        shares = tuple(1.0 - share for share in reversed(turned.shares))
        turned = replace(turned, through=turned.through[::-1], shares=shares)
    return replace(turned, **{name: before})
