"""The moves of a dance: short, of whole pulses, each with an accent on every pulse.

A pulse is a beat, or a few; see ``pulses_of``. A move starts half a pulse before its first accent
and ends half a pulse after its last, in its initial pose; so any move can follow any other.
"""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from collections.abc import Mapping
from dataclasses import dataclass

from go2_wbc.curves import Ease
from motions.language.timeline import Timeline, deg

FULL_PULSE = 0.8
"""Length [s] of the shortest pulse in which a move has its full size; in a shorter one it is
smaller, so that speeds are not greater. Own choice."""
SHIFT_TIME = 0.75
"""Least time [s] in which the trunk moves over three feet, or back: own choice, near to the 0.9 s
that a timeline takes by itself."""
TAP_HEIGHT = 0.04  #: Height [m] of a paw between two taps
LEAST_LIFT = 0.03  #: Least height [m], whatever the tempo


@dataclass(frozen=True, slots=True)
class Accent:
    """Something that shall happen on a beat."""

    pulse: int  #: on which pulse, from the start of its move or of the dance
    part: str  #: a channel of the trunk that turns back, or the foot that touches the ground
    sign: int  #: 1 where the channel is greatest, -1 where it is least, 0 for a foot


class Move(ABC):
    """One move of a dance."""

    name: str  #: what users call it

    @abstractmethod
    def pulses(self, pulse: float) -> int:
        """How many pulses of ``pulse`` seconds it takes."""

    @abstractmethod
    def accents(self, pulse: float) -> tuple[Accent, ...]:
        """Its accents; the first pulse after its start is number 0."""

    @abstractmethod
    def written(self, line: Timeline, pulse: float) -> Timeline:
        """``line``, counting in pulses, and then this move."""


@dataclass(frozen=True, slots=True)
class Strokes(Move):
    """The trunk moves out, perhaps from one side to the other, and back."""

    name: str
    goals: tuple[Mapping[str, float], ...]
    """Offsets [m, rad] of the trunk on each pulse; the first one that is named is the accent."""

    def pulses(self, pulse: float) -> int:
        """One for each goal."""
        return len(self.goals)

    def accents(self, pulse: float) -> tuple[Accent, ...]:
        """The trunk turns back at each goal."""
        firsts = [next(iter(goal.items())) for goal in self.goals]
        return tuple(
            Accent(number, part, 1 if value > 0 else -1)
            for number, (part, value) in enumerate(firsts)
        )

    def written(self, line: Timeline, pulse: float) -> Timeline:
        """The strokes; the trunk turns back without a rest, so that the accent is sharp."""
        size, over = min(1.0, pulse / FULL_PULSE), 0.5
        for goal in self.goals:
            place = {name: size * value for name, value in goal.items()}
            line, over = line.body(**place, over=over, ease=Ease.CUBIC), 1.0
        home = dict.fromkeys({name for goal in self.goals for name in goal}, 0.0)
        return line.body(**home, over=0.5, ease=Ease.CUBIC)


@dataclass(frozen=True, slots=True)
class Taps(Move):
    """A foot taps the ground ``times`` times."""

    name: str
    foot: str
    times: int = 2

    def pulses(self, pulse: float) -> int:
        """Its taps, and what the trunk needs to move aside and back."""
        return round(2.0 * _shift(pulse)) + self.times

    def accents(self, pulse: float) -> tuple[Accent, ...]:
        """The foot touches the ground."""
        first = round(_shift(pulse) + 0.5)
        return tuple(Accent(first + tap, self.foot, 0) for tap in range(self.times))

    def written(self, line: Timeline, pulse: float) -> Timeline:
        """The trunk aside, the taps, the trunk back.

        The foot comes down with speed: one that comes to rest on the ground is there 60 ms early
        when the trunk is 3 mm too low.
        """
        height = max(LEAST_LIFT, TAP_HEIGHT * min(1.0, pulse / FULL_PULSE))
        line = line.unweight(self.foot, over=_shift(pulse))
        for _ in range(self.times):
            line = line.foot(self.foot, z=height, over=0.5)
            line = line.foot(self.foot, over=0.5, ease=Ease.IN)
        return line.home(over=_shift(pulse))


def _shift(pulse: float) -> float:
    """Pulses, a whole number and a half, in which the trunk moves aside."""
    return max(math.ceil(SHIFT_TIME / pulse - 0.5 - 1e-9), 0) + 0.5


def _swing(name: str, channel: str, size: float) -> Strokes:
    return Strokes(name, ({channel: size}, {channel: -size}))


def _waltz(name: str, **far: float) -> Strokes:
    """Down and aside on ONE, up on two, and a little down again on three."""
    return Strokes(
        name, ({"z": -0.035, **far}, {"z": 0.012}, {"z": -0.012, **dict.fromkeys(far, 0.0)})
    )


MOVES: Mapping[str, Move] = {
    move.name: move
    for move in (
        Strokes("nod", ({"pitch": deg(9)},)),
        Strokes("look_up", ({"pitch": deg(-9)},)),
        Strokes("bob", ({"z": -0.04},)),
        Strokes("bow", ({"pitch": deg(8), "z": -0.03},)),
        Strokes("lean_left", ({"y": 0.025, "roll": deg(-8)},)),
        Strokes("lean_right", ({"y": -0.025, "roll": deg(8)},)),
        Strokes("turn_left", ({"yaw": deg(11)},)),
        Strokes("turn_right", ({"yaw": deg(-11)},)),
        Strokes("lunge", ({"x": 0.035, "pitch": deg(4)},)),
        Strokes("sit_back", ({"x": -0.035, "pitch": deg(-5)},)),
        Strokes("dip_left", ({"y": 0.03, "z": -0.03},)),
        Strokes("dip_right", ({"y": -0.03, "z": -0.03},)),
        _swing("sway", "y", 0.03),
        Strokes("rock", ({"y": 0.02, "roll": deg(-7)}, {"y": -0.02, "roll": deg(7)})),
        _swing("twist", "yaw", deg(10)),
        _swing("rodeo", "pitch", deg(-7)),
        Strokes("shimmy", ({"yaw": deg(8), "roll": deg(5)}, {"yaw": deg(-8), "roll": deg(-5)})),
        _waltz("waltz_left", y=0.03, roll=deg(-4)),
        _waltz("waltz_right", y=-0.03, roll=deg(4)),
        _waltz("waltz_ahead", x=0.025),
        _waltz("waltz_turn", yaw=deg(9)),
        *(Taps(f"tap_{foot}", foot) for foot in ("FL", "FR", "RL", "RR")),
    )
}
"""The moves, by name. Sizes are own choices, well inside of what the check allows."""
WALTZ = tuple(name for name in MOVES if name.startswith("waltz"))  #: Those that take a bar of three
