"""Motions generated from a seed that the check refuses as they are written.

Each kind asks for something that no quasi-static motion can do, within what a person might write.
Nothing here knows what the planner of the nearest motion makes of it.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from go2_wbc.errors import MotionError
from motions import FeasibilityChecker, Timeline
from motions.language.timeline_data import NEAREST

LARGEST = {"x": 0.05, "y": 0.05, "z": 0.05, "roll": 0.25, "pitch": 0.25, "yaw": 0.35}
"""Greatest offset of the trunk [m, rad] by channel."""
DIAGONALS = (("FL", "RR"), ("FR", "RL"))
FRONT = ("FL", "FR")
ATTEMPTS = 40
"""Draws after which a kind that the check never refuses is a mistake of ours."""

Maker = Callable[[np.random.Generator], Timeline]


@dataclass(frozen=True, slots=True)
class RefusedMotion:
    """A motion with its origin.

    Attributes:
        kind: the maker's name.
        line: as it is written, with ``physics="as_written"``.
    """

    kind: str
    line: Timeline

    @property
    def nearest(self) -> Timeline:
        """The same, of which the nearest feasible motion is asked."""
        return replace(self.line, physics=NEAREST)


def refused_motion(seed: int, checker: FeasibilityChecker) -> RefusedMotion:
    """The motion of ``seed``: kinds take turns, numbers are drawn until the check refuses it.

    Raises:
        MotionError: if ``ATTEMPTS`` draws of the kind are all feasible.
    """
    kind, make = list(KINDS.items())[seed % len(KINDS)]
    rng = np.random.default_rng([seed, 11])
    for _ in range(ATTEMPTS):
        line = replace(make(rng), name=f"refused {seed}")
        if not checker.check(line).ok:
            return RefusedMotion(kind, line)
    raise MotionError(f"{ATTEMPTS} motions of the kind {kind!r} are feasible")


def _poses(rng: np.random.Generator, over: float) -> Timeline:
    """Two or three quick poses of the trunk on four feet."""
    line = Timeline()
    for _ in range(int(rng.integers(2, 4))):
        line = _moved(line, rng, over)
    return line.home(over=1.5 * over)


def _moved(line: Timeline, rng: np.random.Generator, over: float) -> Timeline:
    """To a pose that differs in two channels."""
    chosen = rng.choice(list(LARGEST), size=2, replace=False).tolist()
    pose = {name: float(rng.uniform(-1.0, 1.0)) * LARGEST[name] for name in chosen}
    x, y, z, roll, pitch, yaw = (pose.get(channel) for channel in LARGEST)
    return line.body(x=x, y=y, z=z, roll=roll, pitch=pitch, yaw=yaw, over=over)


def _quick_trunk(rng: np.random.Generator) -> Timeline:
    return Timeline().hold(0.2).then(_poses(rng, float(rng.uniform(0.12, 0.24)))).hold(0.2)


def _pair(rng: np.random.Generator) -> Timeline:
    """Two diagonal feet up and down; half of the authors let the trunk be balanced."""
    first, second = DIAGONALS[int(rng.integers(2))]
    up, down, z = float(rng.uniform(0.15, 0.25)), float(rng.uniform(0.15, 0.25)), rng.uniform
    line = Timeline(balance=bool(rng.random() < 0.5), shift_time=0.3).hold(0.3)
    line = line.foot(first, z=float(z(0.03, 0.07)), over=up).also()
    line = line.foot(second, z=float(z(0.03, 0.07)), over=up).hold(float(rng.uniform(0.02, 0.2)))
    line = line.down(first, over=down).also().down(second, over=down)
    return line.home(over=0.4).hold(0.3)


def _pair_while_moving(rng: np.random.Generator) -> Timeline:
    """Two diagonal feet up and down while the trunk goes to a pose and back."""
    first, second = DIAGONALS[int(rng.integers(2))]
    z, over = float(rng.uniform(0.03, 0.06)), float(rng.uniform(0.2, 0.3))
    feet = Timeline(balance=False).foot(first, z=z, over=over).also().foot(second, z=z, over=over)
    feet = feet.down(first, over=over).also().down(second, over=over)
    trunk = _moved(Timeline(), rng, 2.0 * over)
    return Timeline(balance=False).hold(0.2).together(feet, trunk).home(over=0.5).hold(0.3)


def _early_paw(rng: np.random.Generator) -> Timeline:
    """A front paw that is raised before the trunk is over the other feet."""
    leg, over = FRONT[int(rng.integers(2))], float(rng.uniform(0.2, 0.35))
    line = Timeline(balance=bool(rng.random() < 0.5), shift_time=float(rng.uniform(0.1, 0.2)))
    line = line.hold(0.2).foot(leg, x=float(rng.uniform(0.0, 0.06)), z=0.08, over=over)
    return line.hold(float(rng.uniform(0.1, 0.4))).down(leg, over=over).home(over=0.3).hold(0.3)


def _chain(rng: np.random.Generator) -> Timeline:
    """One of the others between stretches that can be done as they are written."""
    others = (_quick_trunk, _pair, _pair_while_moving, _early_paw)
    inner = others[int(rng.integers(len(others)))](rng)
    paw = FRONT[int(rng.integers(2))]
    before = Timeline().foot(paw, z=float(rng.uniform(0.05, 0.1)), over=0.7).home(over=0.8)
    after = _moved(Timeline(), rng, 0.9).home(over=0.9)
    return before.then(inner, after)


KINDS: dict[str, Maker] = {
    "quick trunk": _quick_trunk,
    "diagonal pair": _pair,
    "pair while moving": _pair_while_moving,
    "early paw": _early_paw,
    "chain": _chain,
}
"""In turns, by the seed."""
