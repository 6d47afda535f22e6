"""Steps: feet that land in new places, one at a time or in a gait."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Self

import numpy as np
from jaxtyping import Float

from go2_wbc.arguments import typed
from go2_wbc.curves import Ease
from go2_wbc.errors import TimelineError, unknown_name
from go2_wbc.legs import LEGS, Leg
from motions import arguments
from motions.arguments import positive, quantity
from motions.language.keys import BalanceShift, Key, StepKey
from motions.language.timeline_data import SAME, TimelineData

STEP_HEIGHT = 0.05  #: Height [m] of a foot above the ground in the middle of a step: own choice
FARTHEST_WALK = 20.0  #: A walk that is longer [m] is a mistake in units: it would take five minutes
POINTS = 65
"""Poses between two points of a way: own choice, a millimetre apart at the end of a stride."""
HALVES, THIRDS = (0.25, 0.5, 1.0, 2.0, 4.0), (1.0 / 3.0, 2.0 / 3.0, 3.0)
"""Beats between two landings, in the order in which they are tried."""


@dataclass(frozen=True, slots=True)
class StepGait:
    """In which order feet step, and how far and fast: own choice, checked and in simulation."""

    offsets: tuple[float, float, float, float]
    """Of FL, FR, RL, RR: shares of a round at which their swings start."""
    period: float  #: time [s] of a round, unless it is asked for faster or slower
    least_period: float  #: of the fastest round [s]
    most_period: float  #: of the slowest round [s]
    duty: float  #: share of a round in which each foot stands
    stride: float  #: longest way [m] ahead in a round
    side_stride: float  #: longest way [m] aside
    turn: float  #: largest turn [rad] in a round
    rest: float
    """Time [s] on four feet before the first step and after the last one, at least: the trunk moves
    over the feet that will stand."""
    height: float  #: of the feet [m] in the middle of a step
    landings: int  #: how often in a round feet land

    @property
    def last(self) -> float:
        """When the last foot of a round lands, in shares of a round after its start."""
        return max(self.offsets) + 1.0 - self.duty


STEP_GAITS: Mapping[str, StepGait] = {
    "walk": StepGait(
        offsets=(0.25, 0.75, 0.0, 0.5),
        period=2.0,
        least_period=1.8,
        most_period=4.0,
        duty=0.82,
        stride=0.12,
        side_stride=0.08,
        turn=0.3,
        rest=0.9,
        height=0.05,
        landings=4,
    ),
    "trot": StepGait(
        offsets=(0.0, 0.5, 0.5, 0.0),
        period=0.4,
        least_period=0.36,
        most_period=0.62,
        duty=0.6,
        stride=0.12,
        side_stride=0.08,
        turn=0.25,
        rest=0.4,
        height=0.05,
        landings=2,
    ),
}
"""By their names. ``walk``: one foot after the other, the CoM always over three. ``trot``: pairs
across, with 40 ms on four feet between them."""


@dataclass(frozen=True, slots=True)
class Way:
    """Where the frame of the feet goes, seen from where it starts."""

    poses: Float[np.ndarray, "k 3"]
    """(k, 3) x, y [m] and yaw [rad] along the way, close to each other."""

    def efforts(self, gait: StepGait) -> Float[np.ndarray, " k"]:
        """Rounds of ``gait`` that it takes to get to each pose."""
        steps = np.diff(self.poses, axis=0)
        yaw = (self.poses[1:, 2] + self.poses[:-1, 2]) / 2
        ahead = np.cos(yaw) * steps[:, 0] + np.sin(yaw) * steps[:, 1]
        aside = np.cos(yaw) * steps[:, 1] - np.sin(yaw) * steps[:, 0]
        walked = np.hypot(ahead / gait.stride, aside / gait.side_stride)
        return np.concatenate([[0.0], np.cumsum(walked + np.abs(steps[:, 2]) / gait.turn)])

    def rounds(self, gait: StepGait) -> int:
        """Whole rounds of ``gait``, one at least."""
        return max(math.ceil(float(self.efforts(gait)[-1]) - SAME), 1)

    def frames(self, gait: StepGait, rounds: int) -> Float[np.ndarray, "n 3"]:
        """Poses after each of so many rounds, which take equal efforts."""
        efforts, shares = self.efforts(gait), np.arange(1, rounds + 1) / rounds
        wanted = shares * efforts[-1]
        columns = [np.interp(wanted, efforts, column) for column in self.poses.T]
        return np.column_stack(columns) if efforts[-1] > 0.0 else np.zeros((rounds, 3))


@dataclass(frozen=True, slots=True)
class Rhythm:
    """When the steps of a stretch are."""

    rounds: int  #: how many
    period: float  #: [s] of each
    before: float  #: time [s] on four feet before the first step
    over: float  #: time [s] of all of it


def rhythm_for(gait: StepGait, rounds: int, beat: float | None) -> Rhythm:
    """The rhythm of so many rounds; with a ``beat`` [s], feet land on beats or parts of them."""
    period, before = gait.period, gait.rest
    if beat is not None:
        period = _period_on(gait, beat)
        swing = (1.0 - gait.duty) * period
        before = math.ceil((gait.rest + swing) / beat - SAME) * beat - swing
    stepping = (rounds - 1.0 + gait.last) * period
    over = before + stepping + gait.rest
    if beat is not None:
        over = math.ceil(over / beat - SAME) * beat
    return Rhythm(rounds, period, before, over)


def _period_on(gait: StepGait, beat: float) -> float:
    """The period [s] nearest to the gait's own in which feet land on halves of beats, or thirds."""
    for parts in (HALVES, THIRDS):
        periods = [gait.landings * part * beat for part in parts]
        fit = [p for p in periods if gait.least_period <= p + SAME and p <= gait.most_period + SAME]
        if fit:
            return min(fit, key=lambda p: abs(math.log(p / gait.period)))
    return gait.period


def rhythm_within(gait: StepGait, rounds: int, over: float) -> Rhythm:
    """At least so many rounds in ``over`` seconds, as many as come nearest to the gait's own."""
    stepping = over - 2.0 * gait.rest
    rounds = max(rounds, round(stepping / gait.period + 1.0 - gait.last))
    return Rhythm(rounds, stepping / (rounds - 1.0 + gait.last), gait.rest, over)


def steps_of(way: Way, gait: StepGait, rhythm: Rhythm, start: float) -> Iterator[StepKey]:
    """The steps of a stretch that starts at ``start`` [s].

    The trunk follows every foot over a whole round, with the swing in its middle; so it goes evenly
    (within 6 % of its speed), though feet start and stop.
    """
    swing = (1.0 - gait.duty) * rhythm.period
    frames = way.frames(gait, rhythm.rounds).tolist()
    for number, (x, y, yaw) in enumerate(frames):
        for leg in LEGS:
            lift_off = start + rhythm.before + (number + gait.offsets[leg]) * rhythm.period
            yield StepKey(
                start=lift_off,
                end=lift_off + swing,
                ease=Ease.MINIMUM_JERK,
                leg=Leg(leg),
                place=(x, y, yaw),
                height=gait.height,
                since=start,
                lead=gait.duty * rhythm.period / 2.0,
                is_square=True,
            )


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

        Raises:
            TimelineError: for an unknown or raised foot, or a wrong value.
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

    @typed("gait", error=TimelineError)
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

        Raises:
            TimelineError: for no way to go, an unknown gait, a raised foot, or a wrong value.
        """
        goal = [quantity(name, v, FARTHEST_WALK) for name, v in (("x", x), ("y", y))]
        goal.append(quantity("turn", turn))
        return self._straight("walk()", "x, y or turn", goal, over, gait)

    @typed("gait", error=TimelineError)
    def turn(self, angle: float, over: float | None = None, *, gait: str = "walk") -> Self:
        """Turn on the spot by ``angle`` [rad], to the left; see ``walk``.

        Raises:
            TimelineError: as ``walk``.
        """
        goal = [0.0, 0.0, quantity("turn", angle)]
        return self._straight("turn()", "an angle", goal, over, gait)

    @typed("gait", error=TimelineError)
    def side_step(self, y: float, over: float | None = None, *, gait: str = "walk") -> Self:
        """Go aside by ``y`` [m], to the left; see ``walk``.

        Raises:
            TimelineError: as ``walk``.
        """
        goal = [0.0, quantity("y", y, FARTHEST_WALK), 0.0]
        return self._straight("side_step()", "y", goal, over, gait)

    @typed("gait", error=TimelineError)
    def path(
        self, points: Sequence[Sequence[float]], over: float | None = None, *, gait: str = "walk"
    ) -> Self:
        """Walk along a smooth curve through ``points``; see ``walk``.

        Args:
            points: (x, y) [m] from where the feet are, in their heading, and the robot heads where
                it goes; or (x, y, turn) with the angle [rad] by which it has turned there.
            over: how long it takes.
            gait: as for ``walk``.

        Raises:
            TimelineError: for an unknown gait, a raised foot, or a point twice in a row.
        """
        return self._stepped("path()", _way_through(points), over, gait)

    def _straight(
        self, what: str, needs: str, goal: Sequence[float], over: float | None, gait: str
    ) -> Self:
        if over is None and not any(goal):
            raise TimelineError(
                f"{what} needs {needs}: where to; or over: how long to step on the spot"
            )
        shares = np.linspace(0.0, 1.0, POINTS)[:, None]
        return self._stepped(what, Way(shares * np.array(goal)), over, gait)

    def _stepped(self, what: str, way: Way, over: float | None, name: str) -> Self:
        if name not in STEP_GAITS:
            raise TimelineError(unknown_name("gait", str(name), STEP_GAITS))
        if self.raised:
            names = " and ".join(leg.name for leg in sorted(self.raised))
            raise TimelineError(f"{what}: foot {names} is raised: put it down() before")
        start, gait = self.cursor, STEP_GAITS[name]
        rhythm = self._rhythm(what, way.rounds(gait), over, name)
        end = start + rhythm.over
        self._require_length(end)
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
        least = 2.0 * gait.rest + (rounds - 1.0 + gait.last) * gait.least_period
        if end - start < least - SAME:
            hint = "" if name == "trot" else ', or try gait="trot"'
            take = (
                f"rounds of gait {name!r} take" if rounds > 1 else f"round of gait {name!r} takes"
            )
            raise TimelineError(
                f"{what}: {end - start:.2f} s are too short: {rounds} {take} {least:.2f} s at the "
                f"fastest; give it more time{hint}"
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
