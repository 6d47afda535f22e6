"""A whole motion made into another: slower, smaller, backwards, again and again."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import replace
from typing import Any, TypeVar

from go2_wbc.curves import Ease
from go2_wbc.errors import TimelineError
from motions.arguments import positive, quantity
from motions.language.arrangement import Arrangement
from motions.language.clock import SAME, BeatClock
from motions.language.easing import backwards
from motions.language.keys import (
    BalanceShift,
    BodyKey,
    BodyPathKey,
    Key,
    LegKey,
    LegTarget,
    Mark,
    PhaseKey,
    PostureKey,
    StepKey,
)

_Line = TypeVar("_Line", bound="Transforms")
_TIMES = ("cursor", "last_start", "floor", "counted_from")


class Transforms(Arrangement):
    """What can be made of a motion that is written."""

    __slots__ = ()

    def scale_time(self: _Line, factor: float) -> _Line:
        """The same motion, ``factor`` times as long: 2 is half as fast."""
        longer = positive("factor", factor)
        return replace(
            self,
            keys=tuple(key.slower(longer) for key in self.keys),
            clock=BeatClock(tuple(longer * t for t in self.clock.instants)),
            shift_time=longer * self.shift_time,
            counted=tuple(longer * beat for beat in self.counted),
            **{name: longer * getattr(self, name) for name in _TIMES},
        )

    def scale(self: _Line, amplitude: float) -> _Line:
        """The same motion with all offsets of trunk and feet multiplied: 0.5 is half as large.

        Postures and the angles of ``leg`` and ``joint`` are no offsets, and stay.
        """
        share = positive("amplitude", amplitude)
        return replace(self, keys=tuple(key.scaled(share) for key in self.keys))

    def scale_shifts(self: _Line, factor: float) -> _Line:
        """The same motion, its moves over the feet that stay, and back, ``factor`` times as long.

        What follows comes later; what goes on meanwhile takes as much longer. See ``shift_time``.
        """
        longer = positive("factor", factor) - 1.0
        shifts = [
            (key.start, key.end)
            for key in self.keys
            if isinstance(key, BalanceShift) and not key.is_swaying
        ]

        def when(t: float) -> float:
            return t + longer * sum(min(max(t - start, 0.0), end - start) for start, end in shifts)

        return replace(
            self,
            keys=tuple(key.retimed(when) for key in self.keys),
            clock=BeatClock(tuple(map(when, self.clock.instants))),
            shift_time=(1.0 + longer) * self.shift_time,
            counted=tuple(map(when, self.counted)),
            **{name: when(getattr(self, name)) for name in _TIMES},
        )

    def shift_height(self: _Line, z: float) -> _Line:
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

    def _reversed(self: _Line, steps: Mapping[StepKey, StepKey]) -> _Line:
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

    def loop(self: _Line, until: float) -> _Line:
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


_GOALS: dict[type[Key], tuple[str, Callable[[Transforms], Any]]] = {
    BodyKey: ("value", lambda line: 0.0),
    BodyPathKey: ("value", lambda line: 0.0),
    PostureKey: ("posture", lambda line: line.entry),
    LegKey: ("target", lambda line: LegTarget.on_ground()),
    BalanceShift: ("raised", lambda line: frozenset()),
}
"""What each key leads to, and where its track is before the first one."""


def _backwards(key: Key, last: dict[str, Any], line: Transforms, end: float) -> Key:
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
