"""What the exam's motions are drawn from: families, and the random numbers of one draw."""

import hashlib
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import TypeVar

import numpy as np

from go2_wbc.legs import LEGS, Leg
from motions import Timeline

TRAIN, TEST = "train", "test"
_Item = TypeVar("_Item")
BODY_SIZES = {"x": 0.09, "y": 0.08, "z": 0.09, "roll": 0.35, "pitch": 0.30, "yaw": 0.35}
"""An offset of the trunk on each channel [m, rad] that is large for a Go2: amplitude 1."""
CHANNELS = tuple(BODY_SIZES)


class Draw:
    """The free numbers of one motion, in the order in which they are asked for.

    A family asks for the same ones whatever the amplitude, so that only that differs.
    """

    def __init__(self, family: str, number: int) -> None:
        """Args: family: whose motion; number: of the draw."""
        self._rng = np.random.default_rng([number, _digest(family)])

    def between(self, low: float, high: float) -> float:
        """A number."""
        return float(self._rng.uniform(low, high))

    def sign(self) -> float:
        """1 or -1."""
        return float(self._rng.choice([-1.0, 1.0]))

    def either(self, low: float, high: float) -> float:
        """A number, or its negative."""
        return self.sign() * self.between(low, high)

    def count(self, low: int, high: int) -> int:
        """A whole number from ``low`` to ``high``."""
        return int(self._rng.integers(low, high + 1))

    def one_of(self, items: Sequence[_Item]) -> _Item:
        """One of them."""
        return items[int(self._rng.integers(len(items)))]

    def some(self, items: Sequence[_Item], count: int) -> list[_Item]:
        """``count`` different ones, in random order."""
        return [items[int(row)] for row in self._rng.permutation(len(items))[:count]]

    def leg(self) -> Leg:
        """Any leg."""
        return self.one_of(LEGS)

    def front(self) -> Leg:
        """A front leg."""
        return self.one_of(LEGS[:2])


Write = Callable[[Draw, float], Timeline]
"""Writes a motion with the numbers of a draw, at an amplitude."""


@dataclass(frozen=True, slots=True)
class Family:
    """Motions of one structure."""

    name: str  #: unique
    write: Write  #: the motion of a draw at an amplitude
    low: float = 0.2  #: amplitude at which physics is expected to say yes; own guess
    high: float = 4.0  #: amplitude at which it is expected to say no; own guess
    is_dynamic: bool = False  #: whether it is solved, or the robot leaves the ground
    late: float = 0.0  #: time [s] into the plan at which it is entered; above 0 for a wrong entry
    draws: int = 1  #: how many of its borders are bisected

    @property
    def half(self) -> str:
        """Train or test, by the name: thresholds may be set on the former only."""
        return (TRAIN, TEST)[_digest(self.name) % 2]


def moved(
    line: Timeline, values: Mapping[str, float], over: float, ease: str = "minimum_jerk"
) -> Timeline:
    """``line`` and a move of the trunk to offsets [m, rad] by channel."""
    return line.body(**values, over=over, ease=ease)


def to_and_fro(line: Timeline, channel: str, size: float, over: float, times: int = 1) -> Timeline:
    """``line`` and moves of the trunk there, and as far to the other side."""
    for _ in range(times):
        line = moved(moved(line, {channel: size}, over), {channel: -size}, over)
    return line


def tapped(line: Timeline, leg: Leg, z: float, up: float, down: float, times: int) -> Timeline:
    """``line`` and a foot raised and put down again."""
    for _ in range(times):
        line = line.foot(leg, z=z, over=up).down(leg, over=down)
    return line


def named(*writes: Write) -> dict[str, Write]:
    """Functions by the names of the families that they write."""
    return {write.__name__.strip("_"): write for write in writes}


def _digest(text: str) -> int:
    return int.from_bytes(hashlib.sha256(text.encode()).digest()[:4], "big")
