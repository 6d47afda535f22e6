"""Time and order: tempo, and putting motions together."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import replace
from typing import TypeVar

from go2_wbc.curves import Ease
from go2_wbc.errors import TimelineError
from go2_wbc.legs import Leg
from motions import arguments
from motions.arguments import is_number, positive
from motions.language.clock import BeatClock
from motions.language.keys import FootHold, Mark
from motions.language.timeline_data import TimelineData, distinct

_Line = TypeVar("_Line", bound="Arrangement")


class Arrangement(TimelineData):
    """When things happen, and what follows what."""

    __slots__ = ()

    # --- time -----------------------------------------------------------------------------

    def hold(
        self: _Line, seconds: float, *, name: str = "", foot: Leg | str | None = None
    ) -> _Line:
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

    def also(self: _Line) -> _Line:
        """Let the next call start when the last one's move starts, not when it ends."""
        return replace(self, cursor=self.last_start, floor=self.cursor)

    def at(self: _Line, t: float) -> _Line:
        """Put the cursor ``t`` seconds (beats) after the start of the motion."""
        if not (is_number(t) and t >= 0.0):
            raise TimelineError(f"at() needs a time of 0 s or later, got {t!r}")
        return replace(self, cursor=self.clock.at(t))

    def bpm(self: _Line, beats_per_minute: float, *, shift_time: float | None = None) -> _Line:
        """Count ``over``, ``hold`` and ``at`` in beats from here on.

        Before a foot is raised the trunk then moves aside in ``shift_time`` beats; by default in
        the fewest whole beats that are no shorter than the timeline's ``shift_time``.
        """
        interval = 60.0 / positive("bpm", beats_per_minute)
        return self._counted(BeatClock.steady(interval), shift_time)

    def on_beats(self: _Line, times: Iterable[float], *, shift_time: float | None = None) -> _Line:
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

    def _counted(self: _Line, clock: BeatClock, shift_time: float | None) -> _Line:
        beats = float(clock.fewest(self.shift_time))
        if shift_time is not None:
            beats = positive("shift_time", shift_time)
        counted = self._beats_until(self.cursor)
        return replace(
            self, clock=clock, shift_beats=beats, counted=counted, counted_from=self.cursor
        )

    # --- putting motions together ---------------------------------------------------------

    def then(self: _Line, *others: TimelineData) -> _Line:
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

    def together(self: _Line, *others: TimelineData) -> _Line:
        """Do all of ``others`` at the same time, from the cursor on; they may not share a part."""
        line, start = self, self.cursor
        for other in _written("together()", others):
            line = line._joined(other, start)
        return replace(line, cursor=max([start, *(start + other.end for other in others)]))

    def repeat(self: _Line, times: int) -> _Line:
        """This whole motion, ``times`` times one after another; it must end as it began."""
        if isinstance(times, bool) or not isinstance(times, int) or times < 1:
            raise TimelineError(f"repeat() needs a whole number of 1 or more, got {times!r}")
        return self.then(*[self] * (times - 1))

    def mirror(self: _Line) -> _Line:
        """The same motion with left and right exchanged."""
        return replace(self, keys=tuple(key.mirrored for key in self.keys))

    def _require_home(self, what: str) -> None:
        if away := ", ".join(self._away):
            raise TimelineError(f"{what} needs motions that end at home(); away: {away}")


def _written(call: str, others: tuple[TimelineData, ...]) -> tuple[TimelineData, ...]:
    for other in others:
        if not isinstance(other, TimelineData):
            hint = f"; is it of the library? load_motion({other!r})" if type(other) is str else ""
            raise TimelineError(f"{call} takes timelines, got {other!r}{hint}")
    return others
