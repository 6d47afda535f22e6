"""Jumps, rears and lifts: calls whose path is solved, since written curves would not obey physics.

Each makes a dynamic block: phases for the solver of ``motions.dynamics``, from standing at home to
standing at home. A block takes all tracks; later offsets are relative to where it lands.
"""

from __future__ import annotations

import math
from collections.abc import Collection, Mapping, Sequence
from dataclasses import replace
from itertools import count, pairwise
from typing import Self

from go2_wbc.arguments import typed
from go2_wbc.curves import Ease
from go2_wbc.errors import TimelineError, unknown_name
from go2_wbc.legs import LEGS, Leg
from go2_wbc.motion_plan import Posture
from motions import arguments
from motions.arguments import positive, quantity
from motions.dynamics import phases as build
from motions.dynamics.phases import BODY_COORDINATES, Phase
from motions.language.keys import PhaseKey, PostureKey
from motions.language.timeline_data import SAME, BeatClock, TimelineData

_Place = tuple[float, float, float]
_LOW = (-0.03, 0.0, -0.09, 0.0, 0.1, 0.0)  #: Trunk before it pounces [m, rad]


class DynamicBlocks(TimelineData):
    """What is solved: jumps, rears, lifts, and the phases that all of them are made of.

    With a tempo each waits so long that its first touchdown comes on a beat, and ends on one.
    """

    __slots__ = ()

    @property
    def is_dynamic(self) -> bool:
        """Whether some of it is solved."""
        return any(isinstance(key, PhaseKey) for key in self.keys)

    def jump(
        self,
        x: float = 0.0,
        y: float = 0.0,
        yaw: float = 0.0,
        height: float = 0.1,
        *,
        flight: float | None = None,
    ) -> Self:
        """Jump to a place [m] and heading [rad] from here, the feet ``height`` [m] over the ground.

        Offsets count from where it lands. ``flight`` is the time in the air [s, beats], by default
        what a fall from ``height`` takes; in less, the legs are drawn up.
        """
        time = None if flight is None else self._seconds("jump(): flight", flight)
        return self._to_beats(build.jump(x, y, yaw, height, flight=time))

    def spin_jump(self, angle: float, *, height: float = 0.12) -> Self:
        """Jump up and turn by ``angle`` [rad] in the air, to the left if it is positive."""
        return self._to_beats(build.jump(yaw=angle, height=height))

    def pounce(self, x: float = 0.3, *, height: float = 0.08, crouch: float = 0.6) -> Self:
        """Crouch low for ``crouch`` seconds (beats), then leap ``x`` [m] ahead."""
        first, *others = build.jump(x, height=height)
        duration = self._seconds("pounce(): crouch", crouch)
        low = replace(first, duration=duration, body=_LOW, label="crouch low")
        return self._to_beats((low, *others))

    def hop(self, times: int, *, height: float = 0.05, period: float = 0.5) -> Self:
        """Hop in place ``times`` times, coming down once a ``period`` [s, beats].

        Raises:
            TimelineError: for a number that is not 1 to 10, or away from ``home``.
        """
        phases = build.hop(times, self._seconds("hop(): period", period), height)
        return self._to_beats(phases, period)

    def rear(self, pitch: float = -math.radians(25.0), *, hold: float = 0.6) -> Self:
        """Rear up on the hind feet to a ``pitch`` [rad] below 0, nose up.

        The front feet are in the air for ``hold`` seconds (beats).
        """
        return self._to_beats(build.rear(pitch, self._seconds("rear(): hold", hold)))

    def lift(
        self, legs: Collection[Leg | str], *, hold: float = 0.35, height: float = 0.06
    ) -> Self:
        """Lift two feet ``height`` [m] and put them back, in the air for ``hold`` seconds (beats).

        For one foot at a time, which takes no balance on a line, there is ``foot``.

        Raises:
            TimelineError: for what is not two feet, or away from ``home``.
        """
        given = legs if isinstance(legs, Collection) and not isinstance(legs, str) else (legs,)
        feet = sorted({arguments.foot(leg) for leg in given})
        if len(feet) != 2:
            raise TimelineError(f"lift() takes two feet, such as ('FL', 'RR'), got {legs!r}")
        return self._to_beats(build.lift(feet, self._seconds("lift(): hold", hold), height))

    def _seconds(self, name: str, beats: float) -> float:
        return self.clock.after(self.cursor, positive(name, beats)) - self.cursor

    def _to_beats(self, phases: tuple[Phase, ...], period: float | None = None) -> Self:
        """A block of ``phases``, some of them longer, so that it keeps the tempo, if there is one.

        Feet come down on a beat first, then ``period`` beats later each time; the end is on one.
        """
        if not self.shift_beats:
            return self._block(phases)
        timed, now, last = list(phases), self.cursor, None
        first = 0  # the phase that is made longer, before the next touchdown
        for row, (phase, after) in enumerate(pairwise(phases)):
            now += phase.duration
            if not after.stance > phase.stance:
                continue
            goal = _next_beat(self.clock, now) if last is None else now
            if last is not None and period is not None:
                goal = self.clock.after(last, period)
            _lengthen(timed, first, goal - now)
            now, last, first = goal, goal, row + 1
        now += phases[-1].duration
        _lengthen(timed, len(phases) - 1, _next_beat(self.clock, now) - now)
        return self._block(tuple(timed))

    @typed("stance", "body", "feet", "label", error=TimelineError)
    def phase(
        self,
        duration: float,
        *,
        stance: Collection[Leg | str] = LEGS,
        body: Mapping[str, float] | None = None,
        feet: Mapping[Leg | str, Sequence[float]] | None = None,
        label: str = "",
    ) -> Self:
        """A phase of a dynamic block [s, beats]; those that follow each other are one block.

        Args:
            duration: how long; known when it is written, whatever the planner finds.
            stance: the feet that stand.
            body: the trunk's offsets from the start of the block at the end of this phase; of x, y,
                z [m], roll, pitch, yaw [rad] those left out are 0. ``None`` leaves the trunk free.
            feet: places x, y, z [m] at the end of this phase, of feet in the air, from where they
                stood at the start of the block.
            label: what messages call it.

        Raises:
            TimelineError: away from ``home``, or for an unknown coordinate or place.
        """
        phase = Phase(
            self._seconds("phase(): duration", duration),
            frozenset(arguments.foot(leg) for leg in stance),
            None if body is None else _pose(body),
            {arguments.foot(leg): _place(place) for leg, place in (feet or {}).items()},
            label,
        )
        last = max(self.in_order(PhaseKey), key=lambda key: key.end, default=None)
        if last is None or not last.is_open or abs(last.end - self.cursor) > SAME:
            return self._block((phase,), is_open=True)
        longer = replace(last, phases=(*last.phases, phase), end=last.end + phase.duration)
        keys = tuple(key for key in self.keys if key is not last)
        return replace(self, keys=keys)._longer([longer], longer.end)

    def _block(self, phases: tuple[Phase, ...], *, is_open: bool = False) -> Self:
        away = away_from_home(self, self.cursor)
        if away:
            raise TimelineError(
                f"a jump or flight starts standing at home(); away: {', '.join(away)}"
            )
        end = self.cursor + sum(phase.duration for phase in phases)
        return self._longer([PhaseKey(self.cursor, end, Ease.LINEAR, phases, is_open)], end)


def away_from_home(line: TimelineData, time: float) -> list[str]:
    """What is not at home, standing, when everything that starts before ``time`` [s] is over."""
    before = replace(line, keys=tuple(key for key in line.keys if key.start < time - SAME))
    *_, last = line.entry, *(key.posture for key in before.in_order(PostureKey))
    return [*before._away, *([] if last is Posture.STAND else [f"posture {last.value}"])]


def _next_beat(clock: BeatClock, time: float) -> float:
    """The first beat [s] at or after ``time``."""
    return next(beat for beat in map(clock.at, count()) if beat > time - SAME)


def _lengthen(phases: list[Phase], row: int, seconds: float) -> None:
    if abs(seconds) > SAME:
        phases[row] = replace(phases[row], duration=phases[row].duration + seconds)


def _pose(body: Mapping[str, float]) -> tuple[float, float, float, float, float, float]:
    for name in body:
        if name not in BODY_COORDINATES:
            raise TimelineError(unknown_name("coordinate of the body", name, BODY_COORDINATES))
    x, y, z, roll, pitch, yaw = (quantity(name, body.get(name, 0.0)) for name in BODY_COORDINATES)
    return x, y, z, roll, pitch, yaw


def _place(place: Sequence[float]) -> _Place:
    try:
        x, y, z = place
    except (TypeError, ValueError):
        raise TimelineError(f"a foot's place must be x, y, z [m], got {place!r}") from None
    return quantity("x", x), quantity("y", y), quantity("z", z)
