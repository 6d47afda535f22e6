"""Steps: feet that land in new places, one at a time or in a gait."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, Self

import numpy as np

from go2_wbc.curves import Ease
from go2_wbc.errors import TimelineError, unknown_name
from go2_wbc.legs import Leg
from motions import arguments
from motions.arguments import positive, quantity
from motions.language.keys import BalanceShift, Key, StepKey
from motions.language.step_gaits import (
    STEP_GAITS,
    Rhythm,
    StepGait,
    Way,
    least_time,
    rhythm_for,
    rhythm_within,
    steps_of,
)
from motions.language.timeline_data import SAME, TimelineData

STEP_HEIGHT = 0.05
"""Height [m] of a foot above the ground in the middle of a step: own choice."""
FARTHEST_WALK = 20.0
"""A walk that is longer [m] is a mistake in units: it would take five minutes."""
POINTS = 65
"""Poses between two points of a way: own choice, a millimetre apart at the end of a stride."""


class Steps(TimelineData):
    """Where the robot goes."""

    __slots__ = ()

    def step(
        self,
        leg: Leg | str,
        x: float = 0.0,
        y: float = 0.0,
        *,
        yaw: float = 0.0,
        over: float,
        height: float = STEP_HEIGHT,
    ) -> Self:
        """Put a foot down in a new place; from then on offsets and ``home`` count from there.

        Args:
            leg: whose foot, on the ground.
            x, y: its way [m] along the heading of the four feet, and to the left of it.
            yaw: angle [rad] by which it also goes round the middle of the four feet.
            over: how long the foot is in the air.
            height: of the foot [m] in the middle of its way.
        """
        which = arguments.foot(leg)
        if which in self.raised:
            raise TimelineError(f"step(): foot {which.name} is raised: put it down() before")
        place = (quantity("x", x), quantity("y", y), quantity("yaw", yaw))
        rise = positive("height", quantity("height", height))
        line = self._shifted(self.raised | {which})
        start, end = line._span(over)
        key = StepKey(start, end, Ease.MINIMUM_JERK, which, place, rise, since=start)
        return line._longer([key], end)

    def walk(
        self,
        x: float = 0.0,
        y: float = 0.0,
        turn: float = 0.0,
        over: float | None = None,
        *,
        gait: str = "walk",
    ) -> Self:
        """Walk there: straight, and turning evenly on the way. All feet end below their hips.

        Args:
            x, y: where to [m], along the heading of the four feet and to the left of it.
            turn: angle [rad] by which the heading has turned then, to the left.
            over: how long it takes; by default as long as the gait needs. Alone, steps on the spot.
            gait: ``"walk"``, one foot after the other, or ``"trot"``, pairs across.
        """
        goal = [quantity(name, v, FARTHEST_WALK) for name, v in (("x", x), ("y", y))]
        goal.append(quantity("turn", turn))
        if over is None and not any(goal):
            raise TimelineError(
                "walk() needs x, y or turn: where to; or over: how long to step on the spot"
            )
        shares = np.linspace(0.0, 1.0, POINTS)[:, None]
        return self._stepped("walk()", Way(shares * np.array(goal)), over, gait)

    def turn(self, angle: float, over: float | None = None, *, gait: str = "walk") -> Self:
        """Turn on the spot by ``angle`` [rad], to the left; see ``walk``."""
        return self.walk(turn=angle, over=over, gait=gait)

    def side_step(self, y: float, over: float | None = None, *, gait: str = "walk") -> Self:
        """Go aside by ``y`` [m], to the left; see ``walk``."""
        return self.walk(y=y, over=over, gait=gait)

    def path(
        self,
        points: Sequence[Sequence[float]],
        over: float | None = None,
        *,
        gait: str = "walk",
    ) -> Self:
        """Walk along a smooth curve through ``points``; see ``walk``.

        Args:
            points: (x, y) [m] from where the feet are, in their heading, and the robot heads where
                it goes; or (x, y, turn) with the angle [rad] by which it has turned there.
            over: how long it takes.
            gait: as for ``walk``.
        """
        return self._stepped("path()", _way_through(points), over, gait)

    def _stepped(self, what: str, way: Way, over: float | None, name: str) -> Self:
        if name not in STEP_GAITS:
            raise TimelineError(unknown_name("gait", str(name), STEP_GAITS))
        if self.raised:
            names = " and ".join(leg.name for leg in sorted(self.raised))
            raise TimelineError(f"{what}: foot {names} is raised: put it down() before")
        start, gait = self.cursor, STEP_GAITS[name]
        rhythm = self._rhythm(what, way.rounds(gait), over, name)
        end = start + rhythm.over
        keys: list[Key] = list(steps_of(way, gait, rhythm, start))
        if self.balance:
            sway = BalanceShift(start, end, Ease.MINIMUM_JERK, frozenset(), is_swaying=True)
            keys.append(sway)
        return self._longer(keys, end)

    def _rhythm(self, what: str, rounds: int, over: float | None, name: str) -> Rhythm:
        gait: StepGait = STEP_GAITS[name]
        if over is None:
            start, next_beat = self._span(1.0)
            return rhythm_for(gait, rounds, next_beat - start if self.shift_beats else None)
        start, end = self._span(over)
        least = least_time(gait, rounds)
        if end - start < least - SAME:
            hint = "" if name == "trot" else ', or try gait="trot"'
            raise TimelineError(
                f"{what}: {end - start:.2f} s are too short: {rounds} rounds of gait {name!r} take "
                f"{least:.2f} s at the fastest; give it more time{hint}"
            )
        return rhythm_within(gait, rounds, end - start)


def _way_through(points: Sequence[Sequence[float]]) -> Way:
    """The way through ``points``: cubic splines over the distances between them."""
    from scipy.interpolate import CubicSpline  # only who writes a path waits for it

    given = _numbers(points)
    corners = np.vstack([np.zeros(given.shape[1]), given])
    lengths = np.linalg.norm(np.diff(corners[:, :2], axis=0), axis=1)
    if (lengths < SAME).any():
        number = int(np.argmin(lengths))
        raise TimelineError(
            f"path(): point {number} is where the one before it is: a path goes from the place of "
            "the robot through points that differ; to turn on the spot there is turn()"
        )
    s = np.concatenate([[0.0], np.cumsum(lengths)])
    fine = np.interp(np.arange(POINTS * len(lengths)) / POINTS, np.arange(len(s)), s)
    fine = np.append(fine, s[-1])
    if corners.shape[1] == _POSE:
        return Way(CubicSpline(s, corners, bc_type="natural")(fine))
    ends: Any = ((1, np.array([1.0, 0.0])), (2, np.zeros(2)))  # SciPy's stubs know words only
    curve = CubicSpline(s, corners, bc_type=ends)
    ahead = curve(fine, 1)
    heading = np.unwrap(np.arctan2(ahead[:, 1], ahead[:, 0]))
    return Way(np.column_stack([curve(fine), heading]))


def _numbers(points: object) -> np.ndarray:
    is_list = isinstance(points, Sequence | np.ndarray)
    rows = (
        [tuple(p) if isinstance(p, Sequence | np.ndarray) else () for p in points]
        if is_list
        else []
    )
    sizes = {len(row) for row in rows}
    if sizes not in ({2}, {_POSE}):
        raise TimelineError(
            f"path() needs points (x, y), or all of them (x, y, turn): at least one, got {points!r}"
        )
    names = ("x", "y", "turn")
    table = [
        [quantity(name, value, FARTHEST_WALK) for name, value in zip(names, row, strict=False)]
        for row in rows
    ]
    return np.array(table)


_POSE = 3
