"""Flights and few feet: calls whose motion is solved, since no curve that one writes obeys physics.

Each makes a dynamic block: phases for the planner of ``motions.dynamics``, from standing at home to
standing at home. A block takes the whole robot; what comes after it counts from where it lands.
"""

from __future__ import annotations

import math
from collections.abc import Collection, Mapping, Sequence
from dataclasses import replace
from typing import TypeVar

import numpy as np

from go2_wbc.curves import Ease
from go2_wbc.errors import TimelineError
from go2_wbc.legs import LEGS, Leg
from go2_wbc.reference import Posture
from motions.arguments import is_number, positive, quantity, word
from motions.dynamics import moves
from motions.dynamics.phases import BODY_COORDINATES, Phase
from motions.keys import BODY_CHANNELS, PostureKey
from motions.language.written import SAME, Written
from motions.phase_key import PhaseKey

_Line = TypeVar("_Line", bound="Flight")
_Place = tuple[float, float, float]
FARTHEST, HIGHEST = 1.0, 0.5
"""Distance and height [m] of jumps beyond which no planner need be asked: the power of the motors
ends at about 0.7 and 0.3 m (own experiments)."""
FULL_TURN = 2.0 * math.pi
MOST_HOPS = 16
SHORTEST_STAND = 0.1
"""Least time [s] on the ground between hops: own choice, five of the planner's knots."""
_LOW = (-0.03, 0.0, -0.09, 0.0, 0.1, 0.0)
"""Trunk before it pounces [m, rad]."""


class Flight(Written):
    """What is solved: jumps, rears, lifts, and the phases that all of them are made of.

    With a tempo each waits so long that its first touchdown comes on a beat, and ends on one.
    """

    __slots__ = ()

    def jump(
        self: _Line, x: float = 0.0, y: float = 0.0, yaw: float = 0.0, height: float = 0.1
    ) -> _Line:
        """Jump to a place [m] and heading [rad] from here, the feet ``height`` [m] over the ground.

        Offsets count from where it lands.
        """
        return self._to_beats(self._jump("jump()", x, y, yaw, height))

    def spin_jump(self: _Line, angle: float, *, height: float = 0.12) -> _Line:
        """Jump up and turn by ``angle`` [rad] in the air, to the left if it is positive."""
        return self._to_beats(self._jump("spin_jump()", 0.0, 0.0, angle, height))

    def pounce(self: _Line, x: float = 0.3, *, height: float = 0.08, crouch: float = 0.6) -> _Line:
        """Crouch low for ``crouch`` seconds (beats), then leap ``x`` [m] ahead."""
        first, *others = self._jump("pounce()", x, 0.0, 0.0, height)
        duration = positive("pounce(): crouch", crouch) * self.beat
        low = replace(first, duration=duration, body=_LOW, label="crouch low")
        return self._to_beats((low, *others))

    def hop(self: _Line, times: int, *, height: float = 0.05, period: float = 0.5) -> _Line:
        """Hop in place ``times`` times, coming down once a ``period`` [s, beats]."""
        if isinstance(times, bool) or not isinstance(times, int) or not 1 <= times <= MOST_HOPS:
            raise TimelineError(
                f"hop() needs a whole number of times from 1 to {MOST_HOPS}, got {times!r}"
            )
        rise = _within("hop(): height", positive("hop(): height", height), HIGHEST, "m")
        every = positive("hop(): period", period) * self.beat
        shortest = 2.0 * math.sqrt(2.0 * rise / moves.GRAVITY) + SHORTEST_STAND
        if every < shortest:
            raise TimelineError(
                f"hop(): a period of {every:.2f} s is too short for {rise:g} m high hops, which "
                f"take {shortest:.2f} s or more; make them lower"
            )
        return self._to_beats(moves.hop(times, every, rise))

    def rear(self: _Line, pitch: float = -math.radians(25.0), *, hold: float = 0.6) -> _Line:
        """Rear up on the hind feet to a ``pitch`` [rad] below 0, nose up.

        The front feet are in the air for ``hold`` seconds (beats).
        """
        angle = quantity("pitch", pitch)
        if angle >= 0.0:
            raise TimelineError(
                f"rear(): pitch is {pitch:g} rad; the nose goes up: give one below 0"
            )
        return self._to_beats(moves.rear(angle, positive("rear(): hold", hold) * self.beat))

    def lift(
        self: _Line, legs: Collection[Leg | str], *, hold: float = 0.35, height: float = 0.06
    ) -> _Line:
        """Lift two feet ``height`` [m] and put them back, in the air for ``hold`` seconds (beats).

        For one foot at a time, which takes no balance on a line, there is ``foot``.
        """
        feet = tuple(sorted({word("foot", leg, Leg.__members__) for leg in legs}))
        if len(feet) != 2 or isinstance(legs, str):
            raise TimelineError(f"lift() takes two feet, such as ('FL', 'RR'), got {legs!r}")
        time = positive("lift(): hold", hold) * self.beat
        rise = _within("lift(): height", positive("lift(): height", height), HIGHEST, "m")
        return self._to_beats(moves.lift(feet, time, rise))

    def _jump(self, call: str, x: float, y: float, yaw: float, height: float) -> tuple[Phase, ...]:
        place = [_within(f"{call}: {n}", v, FARTHEST, "m") for n, v in (("x", x), ("y", y))]
        turn = _within(f"{call}: yaw", yaw, FULL_TURN, "rad")
        rise = _within(f"{call}: height", positive(f"{call}: height", height), HIGHEST, "m")
        return moves.jump(*place, turn, rise)

    def _to_beats(self: _Line, phases: tuple[Phase, ...]) -> _Line:
        """A block of ``phases``, the first and last as long as the tempo needs."""
        if not self.shift_beats:
            return self._block(phases)
        first, last = phases[0], phases[-1]
        ends = np.cumsum([phase.duration for phase in phases])
        lands = next(
            end
            for end, phase, following in zip(ends, phases, phases[1:], strict=False)
            if phase.stance != following.stance and following.stance > phase.stance
        )
        longer = replace(first, duration=first.duration + self._to_next_beat(float(lands)))
        whole = float(ends[-1]) + longer.duration - first.duration
        end = replace(last, duration=last.duration + self._to_next_beat(whole))
        return self._block((longer, *phases[1:-1], end))

    def _to_next_beat(self, time: float) -> float:
        return math.ceil(time / self.beat - SAME) * self.beat - time

    def phase(
        self: _Line,
        duration: float,
        *,
        stance: Collection[Leg | str] = LEGS,
        body: Mapping[str, float] | None = None,
        feet: Mapping[Leg | str, Sequence[float]] | None = None,
        label: str = "",
    ) -> _Line:
        """A phase of a dynamic block [s, beats]; those that follow each other are one block.

        Args:
            duration: how long; known when it is written, whatever the planner finds.
            stance: the feet that stand.
            body: the trunk's offsets from the start of the block at the end of this phase; of x, y,
                z [m], roll, pitch, yaw [rad] those left out are 0. ``None`` leaves the trunk free.
            feet: places x, y, z [m] at the end of this phase, of feet in the air, from where they
                stood at the start of the block.
            label: what messages call it.
        """
        phase = Phase(
            positive("phase() duration", duration) * self.beat,
            frozenset(word("foot", leg, Leg.__members__) for leg in stance),
            None if body is None else _pose(body),
            {
                word("foot", leg, Leg.__members__): _place(place)
                for leg, place in (feet or {}).items()
            },
            label,
        )
        last = max(self.in_order(PhaseKey), key=lambda key: key.end, default=None)
        if last is None or not last.is_open or abs(last.end - self.cursor) > SAME:
            return self._block((phase,), is_open=True)
        longer = replace(last, phases=(*last.phases, phase), end=last.end + phase.duration)
        keys = tuple(key for key in self.keys if key is not last)
        return replace(self, keys=keys)._longer([longer], longer.end)

    def _block(self: _Line, phases: tuple[Phase, ...], *, is_open: bool = False) -> _Line:
        away = away_from_home(self, self.cursor)
        if away:
            raise TimelineError(
                f"a dynamic block starts standing at home(); away: {', '.join(away)}"
            )
        end = self.cursor + sum(phase.duration for phase in phases)
        return self._longer([PhaseKey(self.cursor, end, Ease.LINEAR, phases, is_open)], end)


def away_from_home(line: Written, time: float) -> list[str]:
    """What is not at home, standing, when everything that starts before ``time`` [s] is over."""
    before = replace(line, keys=tuple(key for key in line.keys if key.start < time - SAME))
    away = [f"body {name}" for name in BODY_CHANNELS if before.body_value(name) != 0.0]
    away += [f"foot {leg.name}" for leg in sorted(before.raised)]
    if before.shifted_for:
        away.append("balance")
    postures = [line.entry, *(key.posture for key in before.in_order(PostureKey))]
    if postures[-1] is not Posture.STAND:
        away.append(f"posture {postures[-1].value}")
    return away


def _pose(body: Mapping[str, float]) -> tuple[float, float, float, float, float, float]:
    for name in body:
        word("coordinate of the body", name, {name: name for name in BODY_COORDINATES})
    x, y, z, roll, pitch, yaw = (quantity(name, body.get(name, 0.0)) for name in BODY_COORDINATES)
    return x, y, z, roll, pitch, yaw


def _place(place: Sequence[float]) -> _Place:
    try:
        x, y, z = place
    except (TypeError, ValueError):
        raise TimelineError(f"a foot's place must be x, y, z [m], got {place!r}") from None
    return quantity("x", x), quantity("y", y), quantity("z", z)


def _within(name: str, value: float, largest: float, unit: str) -> float:
    """``value``, a number from -``largest`` to ``largest``."""
    if not is_number(value):
        raise TimelineError(f"{name} must be a finite number, got {value!r}")
    if abs(value) > largest:
        hint = f"; write deg({value:g})?" if unit == "rad" else ""
        raise TimelineError(
            f"{name} is {value:g} {unit}: no jump goes beyond {largest:.3g} {unit}{hint}"
        )
    return float(value)
