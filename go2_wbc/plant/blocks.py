"""What a terrain is: a floor, pits in it, and blocks that are fixed to the world."""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from dataclasses import dataclass, replace

HALF_WIDTH = 5.0  #: Half width [m] of stairs, ramps and patches
PLATFORM = 10.0  #: Length [m] of the level ground behind the last step


@dataclass(frozen=True, slots=True)
class Block:
    """A box that is fixed to the world."""

    centre: tuple[float, float, float]  #: [m]
    half_size: tuple[float, float, float]  #: half of its sides [m]
    yaw: float = 0.0  #: by which it is turned about z [rad]
    pitch: float = 0.0
    """By which it is turned about its own y axis before [rad]; positive lowers its +x end."""
    friction: float | None = None
    """Sliding friction coefficient on it, in the place of the plant's; None for that."""

    @staticmethod
    def slab(start: float, length: float, bottom: float, top: float) -> Block:
        """A level one across the way: where it begins and how long it is [m], and its heights."""
        centre = (start + 0.5 * length, 0.0, 0.5 * (bottom + top))
        return Block(centre, (0.5 * length, HALF_WIDTH, 0.5 * (top - bottom)))

    def shifted(self, ahead: float) -> Block:
        """The same so much [m] farther ahead."""
        x, y, z = self.centre
        return replace(self, centre=(x + ahead, y, z))


class Terrain(ABC):
    """What the ground is like, where it is not a level floor."""

    __slots__ = ()

    @property
    def floor_pitch(self) -> float:
        """Angle [rad] by which the whole floor is turned about y; negative rises ahead."""
        return 0.0

    @property
    def floor_height(self) -> float:
        """Of the whole floor [m], 0 or less."""
        return 0.0

    @property
    def end(self) -> float:
        """Where [m] ahead the ground has height 0 again for good; infinite if nowhere."""
        return math.inf

    @property
    def pits(self) -> tuple[tuple[float, float], ...]:
        """From where to where [m] ahead the ground of height 0 is missing, in order."""
        return ()

    @abstractmethod
    def blocks(self) -> tuple[Block, ...]:
        """What lies on the ground, or stands on the floor of the pits."""

    def banks(self) -> tuple[Block, ...]:
        """The ground between the pits, where there are any."""
        edges = [-PLATFORM, *(x for pit in self.pits for x in pit)]
        edges.append(edges[-1] + PLATFORM)
        spans = [(a, b) for a, b in zip(edges[::2], edges[1::2], strict=True) if a < b]
        return tuple(Block.slab(a, b - a, self.floor_height, 0.0) for a, b in spans if self.pits)
