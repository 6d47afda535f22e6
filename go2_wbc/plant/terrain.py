"""Ground that a simulated plant can stand the robot on, as plain data.

The robot starts at the origin, and is told nothing of it. Whatever has a direction rises or begins
ahead of it, along the world's x axis.
"""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from go2_wbc.validation import NOT_NEGATIVE, POSITIVE, Rule, ranged

STEEPEST = 0.8
"""Greatest angle [rad] of a slope: steeper than any friction coefficient up to 1 holds."""
HALF_WIDTH = 5.0
"""Half width [m] of stairs, ramps and patches."""
CLIMBED = Rule(f"above 0, at most {STEEPEST} rad", lambda angle: 0.0 < angle <= STEEPEST)
PLATFORM = 10.0
"""Length [m] of the level ground behind the last step."""


@dataclass(frozen=True, slots=True)
class Block:
    """A box that is fixed to the world.

    Attributes:
        centre: of the box [m].
        half_size: half of its sides [m].
        yaw: by which it is turned about z [rad].
        pitch: by which it is turned about its own y axis before [rad]; positive lowers its +x end.
        friction: sliding friction coefficient on it, in the place of the plant's; None for that.
    """

    centre: tuple[float, float, float]
    half_size: tuple[float, float, float]
    yaw: float = 0.0
    pitch: float = 0.0
    friction: float | None = None


class Terrain(ABC):
    """What the ground is like, where it is not a level floor."""

    __slots__ = ()

    @property
    def floor_pitch(self) -> float:
        """Angle [rad] by which the whole floor is turned about y; negative rises ahead."""
        return 0.0

    @abstractmethod
    def blocks(self) -> tuple[Block, ...]:
        """What lies on the floor."""


@dataclass(frozen=True, slots=True)
@ranged(POSITIVE, count=NOT_NEGATIVE, clear_radius=NOT_NEGATIVE, seed=NOT_NEGATIVE)
class Boxes(Terrain):
    """Flat ground strewn with low boxes that the robot does not know about.

    The robot starts at the origin, which stays clear.

    Attributes:
        height: largest height of a box [m]; heights are uniform in (0, height].
        size: side of a box [m].
        count: number of boxes.
        extent: half side of the square they are strewn over [m].
        clear_radius: no box reaches closer than this to the origin [m]; the Go2 is 0.7 m long.
        seed: of the random places and heights.
    """

    height: float = 0.06
    size: float = 0.25
    count: int = 100
    extent: float = 4.0
    clear_radius: float = 0.55
    seed: int = 0

    def layout(self) -> Float[np.ndarray, "n 4"]:
        """One row per box: x, y of its centre [m], yaw [rad], height [m].

        Places that reach into the clear disc are dropped, so there may be fewer than ``count``.
        """
        rng = np.random.default_rng(self.seed)
        low = (-self.extent, -self.extent, -np.pi, 0.0)
        high = (self.extent, self.extent, np.pi, self.height)
        rows = rng.uniform(low, high, size=(self.count, 4))
        reach = self.size / np.sqrt(2.0)
        return rows[np.hypot(rows[:, 0], rows[:, 1]) - reach > self.clear_radius]

    def blocks(self) -> tuple[Block, ...]:
        """One for each row of ``layout``."""
        half = 0.5 * self.size
        return tuple(
            Block((x, y, 0.5 * height), (half, half, 0.5 * height), yaw=yaw)
            for x, y, yaw, height in self.layout().tolist()
        )


@dataclass(frozen=True, slots=True)
@ranged(POSITIVE)
class Stairs(Terrain):
    """Steps that lead up to a platform; with a ``count`` of 1 a single step.

    Attributes:
        height: of a step [m].
        count: of the steps.
        depth: of a step [m]; 0.3 is that of a flight of stairs in a house.
        start: distance of the first one from the origin [m].
    """

    height: float = 0.08
    count: int = 4
    depth: float = 0.3
    start: float = 0.8

    def blocks(self) -> tuple[Block, ...]:
        """One for each step, the last one with the platform."""
        blocks = []
        for n in range(self.count):
            half = 0.5 * (self.depth if n < self.count - 1 else PLATFORM)
            top = 0.5 * (n + 1) * self.height
            centre = (self.start + n * self.depth + half, 0.0, top)
            blocks.append(Block(centre, (half, HALF_WIDTH, top)))
        return tuple(blocks)


@dataclass(frozen=True, slots=True)
@ranged(angle=CLIMBED)
class Slope(Terrain):
    """A plane that rises ahead; where the robot goes on it is for ``initial_yaw`` to say.

    Attributes:
        angle: of the plane [rad].
    """

    angle: float

    @property
    def floor_pitch(self) -> float:
        """See ``Terrain.floor_pitch``."""
        return -self.angle

    def blocks(self) -> tuple[Block, ...]:
        """None: the floor itself is the slope."""
        return ()


@dataclass(frozen=True, slots=True)
@ranged(POSITIVE, angle=CLIMBED)
class Ramp(Terrain):
    """A slope that leads up from the level, a level top, and a slope that leads down again.

    Attributes:
        angle: of both slopes [rad].
        length: of each slope and of the top, on the level [m].
        start: distance of the first slope from the origin [m].
    """

    angle: float
    length: float = 1.5
    start: float = 0.8

    def blocks(self) -> tuple[Block, ...]:
        """The way up, the top and the way down."""
        rise = self.length * math.tan(self.angle)
        half, thick = 0.5 * self.length / math.cos(self.angle), 0.5
        x = self.start + 0.5 * self.length
        down = thick * math.cos(self.angle)
        aside = thick * math.sin(self.angle)
        z = 0.5 * rise - down
        top = (x + self.length, 0.0, 0.5 * rise)
        return (
            Block((x + aside, 0.0, z), (half, HALF_WIDTH, thick), pitch=-self.angle),
            Block(top, (0.5 * self.length, HALF_WIDTH, 0.5 * rise)),
            Block(
                (x + 2 * self.length - aside, 0.0, z), (half, HALF_WIDTH, thick), pitch=self.angle
            ),
        )


@dataclass(frozen=True, slots=True)
@ranged(POSITIVE)
class Patch(Terrain):
    """A strip across the way with a friction of its own, as of oil or ice; 2 mm high.

    Attributes:
        friction: sliding friction coefficient on it.
        length: [m].
        start: distance from the origin [m].
    """

    friction: float = 0.15
    length: float = 0.5
    start: float = 1.0

    def blocks(self) -> tuple[Block, ...]:
        """The strip."""
        half = 0.5 * self.length
        centre = (self.start + half, 0.0, 0.001)
        return (Block(centre, (half, HALF_WIDTH, 0.001), friction=self.friction),)
