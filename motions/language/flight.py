"""Flights and few feet: calls whose motion is solved, since no curve that one writes obeys physics.

Each makes a dynamic block: phases for the planner of ``motions.dynamics``, from standing at home to
standing at home. A block takes the whole robot; what comes after it counts from where it lands.
"""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from dataclasses import replace
from typing import TypeVar

from go2_wbc.curves import Ease
from go2_wbc.errors import TimelineError
from go2_wbc.legs import LEGS, Leg
from go2_wbc.reference import Posture
from motions.arguments import positive, quantity, word
from motions.dynamics import moves
from motions.dynamics.phases import BODY_COORDINATES, Phase
from motions.keys import BODY_CHANNELS, PostureKey
from motions.language.written import SAME, Written
from motions.phase_key import PhaseKey

_Line = TypeVar("_Line", bound="Flight")
_Place = tuple[float, float, float]


class Flight(Written):
    """What is solved: jumps, and the phases that all of them are made of."""

    __slots__ = ()

    def jump(
        self: _Line, x: float = 0.0, y: float = 0.0, yaw: float = 0.0, height: float = 0.1
    ) -> _Line:
        """Jump to a place [m] and heading [rad] from here, the feet ``height`` [m] over the ground.

        Offsets count from where it lands.
        """
        place = {"x": quantity("x", x), "y": quantity("y", y), "yaw": quantity("yaw", yaw)}
        return self._block(moves.jump(**place, height=positive("height", height)))

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
