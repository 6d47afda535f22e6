"""Terrains for a simulated plant, as plain data.

The robot starts at the origin, on ground of height 0; the controller is told nothing about the
terrain. Terrains with a direction rise or begin ahead of it, along the world's x axis; a robot with
another initial heading meets them obliquely. Pits reach down to a floor below 0, and divide the
ground into banks.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Float

from go2_wbc.arguments import typed
from go2_wbc.brief import brief
from go2_wbc.errors import ConfigError, unknown_name
from go2_wbc.plant.blocks import HALF_WIDTH, PLATFORM, Block, Terrain
from go2_wbc.validation import NOT_NEGATIVE, POSITIVE, Rule, between, ranged

STEEPEST = 0.8
"""Greatest angle [rad] of a slope: steeper than any friction coefficient up to 1 holds."""
MOST = 10_000
"""Most boxes, steps, blocks, waves and rows of stones: MuJoCo builds a million for minutes."""
COUNTED = between(1, MOST)
CLIMBED = Rule(f"above 0, at most {STEEPEST} rad", lambda angle: 0.0 < angle <= STEEPEST)


@typed()
@dataclass(frozen=True, slots=True)
@ranged(POSITIVE, count=between(0, MOST), clear_radius=NOT_NEGATIVE, seed=NOT_NEGATIVE)
class Boxes(Terrain):
    """Flat ground strewn with low boxes that the robot does not know about.

    The robot starts at the origin, which stays clear.
    """

    height: float = 0.06  #: largest height of a box [m]; heights are uniform in (0, height]
    size: float = 0.25  #: side of a box [m]
    count: int = 100  #: number of boxes
    extent: float = 4.0  #: half side of the square they are strewn over [m]
    clear_radius: float = 0.55
    """No box reaches closer than this to the origin [m]; the Go2 is 0.7 m long."""
    seed: int = 0  #: of the random places and heights

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


UP, DOWN, BOTH = "up", "down", "both"  #: Ways of stairs
TREAD = 0.04  #: Thickness [m] of a step with an open riser


@typed()
@dataclass(frozen=True, slots=True)
@ranged(POSITIVE, count=COUNTED)
class Stairs(Terrain):
    """Steps that lead up to a platform; with a ``count`` of 1 a single step."""

    height: float = 0.08  #: of a step [m]
    count: int = 4  #: of the steps, of each flight
    depth: float = 0.3  #: of a step [m]; 0.3 is that of a flight of stairs in a house
    start: float = 0.8  #: distance of the first one from the origin [m]
    way: str = UP  #: "up", "down" from the ground at the start, or "both", up and down again
    landing: float = PLATFORM  #: length of the level ground behind the last step up [m]
    is_open: bool = False  #: whether there are treads only, with nothing below them

    def __post_init__(self) -> None:
        """Raise ConfigError for another way."""
        if self.way not in (UP, DOWN, BOTH):
            raise ConfigError(unknown_name("Stairs.way", str(self.way), (UP, DOWN, BOTH)))

    @property
    def floor_height(self) -> float:
        """See ``Terrain.floor_height``."""
        return -self.count * self.height if self.way == DOWN else 0.0

    @property
    def pits(self) -> tuple[tuple[float, float], ...]:
        """See ``Terrain.pits``."""
        return ((self.start, math.inf),) if self.way == DOWN else ()

    @property
    def end(self) -> float:
        """See ``Terrain.end``."""
        flights = 2 * (self.count - 1) * self.depth
        return self.start + flights + self.landing if self.way == BOTH else math.inf

    def blocks(self) -> tuple[Block, ...]:
        """One for each step, the last one up with the landing."""
        up = range(1, self.count + 1)
        tops = {UP: (*up,), DOWN: (*(-n for n in up[:-1]),), BOTH: (*up, *up[-2::-1])}[self.way]
        blocks = []
        for n, top in enumerate(tops):
            length = self.landing if top == self.count else self.depth
            behind = self.landing - self.depth if n >= self.count else 0.0
            height = top * self.height
            bottom = height - TREAD if self.is_open else self.floor_height
            x = self.start + n * self.depth + behind
            blocks.append(Block.slab(x, length, bottom, height))
        return tuple(blocks)


@typed()
@dataclass(frozen=True, slots=True)
@ranged(POSITIVE, count=COUNTED)
class Blocks(Terrain):
    """Blocks across the way, one behind the other."""

    height: float = 0.1  #: of each [m]
    length: float = 1.0  #: of each [m]
    gap: float = 1.0  #: length [m] of the ground between two
    count: int = 4  #: of them
    start: float = 0.8  #: distance of the first one from the origin [m]

    @property
    def end(self) -> float:
        """See ``Terrain.end``."""
        return self.start + self.count * (self.length + self.gap) - self.gap

    def blocks(self) -> tuple[Block, ...]:
        """All of them."""
        starts = [self.start + n * (self.length + self.gap) for n in range(self.count)]
        return tuple(Block.slab(x, self.length, 0.0, self.height) for x in starts)


@dataclass(frozen=True, slots=True)
@ranged(angle=CLIMBED)
class Slope(Terrain):
    """A plane that rises ahead; where the robot goes on it is for ``initial_yaw`` to say."""

    angle: float  #: of the plane [rad]

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
    """A slope that leads up from the level, a level top, and a slope that leads down again."""

    angle: float  #: of both slopes [rad]
    length: float = 1.5  #: of each slope and of the top, on the level [m]
    start: float = 0.8  #: distance of the first slope from the origin [m]

    @property
    def end(self) -> float:
        """See ``Terrain.end``."""
        return self.start + 3.0 * self.length

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


STRIPS = 16  #: Flat strips of which a wave is made


@typed()
@dataclass(frozen=True, slots=True)
@ranged(POSITIVE, count=COUNTED)
class Waves(Terrain):
    """Waves across the way, from valley to valley.

    They are made of flat strips: on MuJoCo's height fields feet are pinned between two prisms.
    """

    height: float = 0.08  #: of a crest over a valley [m]
    length: float = 1.0  #: of a wave [m]
    count: int = 5  #: of them
    start: float = 0.8  #: distance of the first one from the origin [m]

    @property
    def end(self) -> float:
        """See ``Terrain.end``."""
        return self.start + self.count * self.length

    def blocks(self) -> tuple[Block, ...]:
        """The strips."""
        x = np.linspace(0.0, self.count * self.length, self.count * STRIPS + 1)
        z = 0.5 * self.height * (1.0 - np.cos(2.0 * np.pi * x / self.length))
        ends = np.column_stack([self.start + x, z]).tolist()
        return tuple(_strip(a, b) for a, b in itertools.pairwise(ends))


def _strip(begin: Sequence[float], end: Sequence[float]) -> Block:
    """A flat block across the way, the upper side of which leads from one (x, z) to another."""
    way, rise = end[0] - begin[0], end[1] - begin[1]
    angle, half = math.atan2(rise, way), 0.15  # [m] of its thickness
    x = 0.5 * (begin[0] + end[0]) + half * math.sin(angle)
    z = 0.5 * (begin[1] + end[1]) - half * math.cos(angle)
    return Block((x, 0.0, z), (0.5 * math.hypot(way, rise), HALF_WIDTH, half), pitch=-angle)


class _Pit(Terrain):
    __slots__ = ()
    depth: float
    start: float

    @property
    def floor_height(self) -> float:
        """See ``Terrain.floor_height``."""
        return -self.depth

    @property
    def pits(self) -> tuple[tuple[float, float], ...]:
        """See ``Terrain.pits``."""
        return ((self.start, self.end),)


@typed()
@dataclass(frozen=True, slots=True)
@ranged(POSITIVE, count=COUNTED, uneven=NOT_NEGATIVE, seed=NOT_NEGATIVE)
class Stones(_Pit):
    """Square stepping stones in a pit."""

    size: float = 0.25  #: side of a stone [m]
    gap: float = 0.1  #: between two of them, ahead and aside [m]
    count: int = 6  #: of rows of stones, ahead
    depth: float = 0.4  #: of the pit [m]
    uneven: float = 0.0  #: by which a stone may be lower [m]; each is drawn evenly, by the ``seed``
    seed: int = 0
    start: float = 0.8  #: where the pit begins, from the origin [m]

    @property
    def end(self) -> float:
        """See ``Terrain.end``."""
        return self.start + self.count * (self.size + self.gap) + self.gap

    def blocks(self) -> tuple[Block, ...]:
        """The stones, in rows over 2 m."""
        rng, pitch = np.random.default_rng(self.seed), self.size + self.gap
        aside, half = round(1.0 / pitch), 0.5 * self.size
        stones = []
        for ahead in range(self.count):
            for left in range(-aside, aside + 1):
                x = self.start + self.gap + ahead * pitch + half
                tall = 0.5 * (self.depth - float(rng.uniform(0.0, self.uneven)))
                stones.append(Block((x, left * pitch, tall - self.depth), (half, half, tall)))
        return tuple(stones)


@dataclass(frozen=True, slots=True)
@ranged(POSITIVE)
class Gap(_Pit):
    """A gap across the way."""

    length: float = 0.2  #: of it [m]
    depth: float = 0.4  #: of it [m]
    start: float = 0.8  #: distance from the origin [m]

    @property
    def end(self) -> float:
        """See ``Terrain.end``."""
        return self.start + self.length

    def blocks(self) -> tuple[Block, ...]:
        """None."""
        return ()


@typed()
@dataclass(frozen=True, slots=True)
class Course(Terrain):
    """Several terrains, one behind the other."""

    parts: tuple[Terrain, ...]
    """Each with its own start, from the end of the one before; each must have an end."""

    __repr__ = brief

    def __post_init__(self) -> None:
        """Raise ConfigError for a part without an end, or for none."""
        if not self.parts or not all(math.isfinite(part.end) for part in self.parts):
            raise ConfigError(f"Course.parts must be terrains with an end, got {self.parts!r}")

    @staticmethod
    @typed()
    def drawn(seed: int, height: float = 0.12, angle: float = 0.3, length: float = 12.0) -> Course:
        """A random one: stairs, blocks, ramps and waves, until it is ``length`` [m] long.

        Each is drawn between half of the ``height`` of a step [m] or the ``angle`` of a slope [rad]
        and all of it; waves may be as high as a step.

        Raises:
            ConfigError: for a negative seed, or what no part of it takes.
        """
        if seed < 0:
            raise ConfigError(f"seed must be at least 0, got {seed}")
        rng, parts, total = np.random.default_rng(seed), [], 0.0
        while total < length:
            kind, share = int(rng.integers(4)), float(rng.uniform(0.5, 1.0))
            step = share * height
            part: Terrain = (
                Stairs(step, 3, 0.31, way=BOTH, landing=1.0),
                Blocks(step, count=1),
                Ramp(share * angle, length=1.0),
                Waves(step, count=2),
            )[kind]
            parts.append(part)
            total += part.end
        return Course(tuple(parts))

    @property
    def floor_height(self) -> float:
        """See ``Terrain.floor_height``."""
        return min(part.floor_height for part in self.parts)

    @property
    def end(self) -> float:
        """See ``Terrain.end``."""
        return sum(part.end for part in self.parts)

    def _shifted(self) -> Iterator[tuple[float, Terrain]]:
        starts = itertools.accumulate((part.end for part in self.parts), initial=0.0)
        return zip(starts, self.parts, strict=False)

    @property
    def pits(self) -> tuple[tuple[float, float], ...]:
        """See ``Terrain.pits``."""
        return tuple((x + a, x + b) for x, part in self._shifted() for a, b in part.pits)

    def blocks(self) -> tuple[Block, ...]:
        """Those of all parts."""
        return tuple(block.shifted(x) for x, part in self._shifted() for block in part.blocks())


@dataclass(frozen=True, slots=True)
@ranged(POSITIVE)
class Patch(Terrain):
    """A strip across the way with a friction of its own, as of oil or ice; 2 mm high."""

    friction: float = 0.15  #: sliding friction coefficient on it
    length: float = 0.5  #: [m]
    start: float = 1.0  #: distance from the origin [m]

    def blocks(self) -> tuple[Block, ...]:
        """The strip."""
        slab = Block.slab(self.start, self.length, 0.0, 0.002)
        return (replace(slab, friction=self.friction),)
