"""The ground that the page has chosen: physics plays a motion on it; the check knows a level one.

Robots begin on the level, or on the slope, and what has a start begins ``AHEAD`` of them.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from jaxtyping import Float

from go2_wbc.errors import StudioError, unknown_name
from go2_wbc.planning.height_map import CELL

if TYPE_CHECKING:
    from go2_wbc.plant.terrain import Terrain

LEVEL = "level"
AHEAD = 0.6  #: Of the middle of the robot [m]: own choice, a robot that lies needs 0.5
AROUND = 1.0  #: How far [m] around the robot's way the ground is drawn
WIDEST = 8.0  #: The most that is drawn of it, along and across [m]


@dataclass(frozen=True, slots=True)
class Kind:
    """Grounds of one kind, which differ by one number."""

    size: str  #: what the number is, in words
    unit: str  #: "m" or "deg"
    least: float  #: valid, in that unit
    most: float
    usual: float  #: if a page names none


KINDS: Mapping[str, Kind] = {
    "slope": Kind("angle", "deg", 1.0, 20.0, 5.0),
    "ramp": Kind("angle", "deg", 1.0, 25.0, 10.0),
    "stairs": Kind("step", "m", 0.01, 0.2, 0.08),
    "blocks": Kind("height", "m", 0.01, 0.25, 0.1),
    "boxes": Kind("height", "m", 0.01, 0.12, 0.04),
    "waves": Kind("height", "m", 0.01, 0.2, 0.08),
}
ONLY_LEVEL = (
    "Verdict, margins, chance and certificate are those of level ground; "
    "physics plays on the {0.kind}."
)


@dataclass(frozen=True, slots=True)
class PlayedGround:
    """A ground by its name."""

    kind: str = LEVEL  #: or one of ``KINDS``
    size: float = 0.0  #: the number of its kind, in its unit

    def __str__(self) -> str:
        """In words; nothing of a level one."""
        if self.kind == LEVEL:
            return ""
        kind = KINDS[self.kind]
        return f"{self.kind}, {kind.size} {self.size:g} {kind.unit}"

    @property
    def terrain(self) -> Terrain | None:
        """What a simulated robot stands on; None of a level one."""
        from go2_wbc.plant import terrain  # the simulator, which only who plays has to load

        size, angle = self.size, math.radians(self.size)
        make = {
            LEVEL: lambda: None,
            "slope": lambda: terrain.Slope(angle),
            "ramp": lambda: terrain.Ramp(angle, start=AHEAD),
            "stairs": lambda: terrain.Stairs(size, start=AHEAD, way=terrain.BOTH),
            "blocks": lambda: terrain.Blocks(size, start=AHEAD),
            "boxes": lambda: terrain.Boxes(size),
            "waves": lambda: terrain.Waves(size, start=AHEAD),
        }
        return make[self.kind]()

    def told(self) -> str:
        """What of the page is of another ground; nothing where that is level."""
        return "" if self.kind == LEVEL else ONLY_LEVEL.format(self)

    def cells(self, way: Float[np.ndarray, "n 2"]) -> Float[np.ndarray, "k 3"]:
        """What is around a ``way`` [m], as ``Recording.ground``; nothing of a level one."""
        from go2_wbc.plant.mujoco.lidar import heights_of

        if (terrain := self.terrain) is None:
            return np.empty((0, 3))
        middle = 0.5 * (way.min(axis=0) + way.max(axis=0))
        half = np.minimum(0.5 * np.ptp(way, axis=0) + AROUND, 0.5 * WIDEST)
        ends = zip(np.floor((middle - half) / CELL), np.ceil((middle + half) / CELL), strict=True)
        axes = [CELL * (np.arange(low, high) + 0.5) for low, high in ends]
        places = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).reshape(-1, 2)
        return np.column_stack([places, heights_of(terrain, places)])


def ground_of(order: Mapping[str, object]) -> PlayedGround:
    """The one that a page asks for by ``ground`` and ``size``; a level one if it does not.

    Raises:
        StudioError: for what is no ground, or out of range.
    """
    name, size = order.get("ground", LEVEL), order.get("size")
    if name == LEVEL:
        return PlayedGround()
    if not isinstance(name, str) or name not in KINDS:
        raise StudioError(unknown_name("ground", f"{name!s:.40}", (LEVEL, *KINDS)))
    kind = KINDS[name]
    size = kind.usual if size is None else size
    if isinstance(size, bool) or not isinstance(size, int | float):
        raise StudioError(f"{kind.size} must be a number, got {size!r:.40}")
    if not kind.least <= size <= kind.most:
        between = f"must be between {kind.least:g} and {kind.most:g} {kind.unit}"
        raise StudioError(f"{kind.size} {between}, got {size:g}")
    return PlayedGround(name, float(size))


def shown(ground: PlayedGround) -> dict[str, object]:
    """As the page needs it, with what may be chosen."""
    return {
        "ground": ground.kind,
        "size": ground.size,
        "warning": ground.told(),
        "grounds": {
            name: {"size": one.size, "unit": one.unit, "range": (one.least, one.most)}
            for name, one in KINDS.items()
        },
    }
