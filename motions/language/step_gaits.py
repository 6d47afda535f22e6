"""Gaits of authored steps: in which order feet step, how far, and when."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from go2_wbc.curves import Ease
from go2_wbc.legs import LEGS, Leg
from motions.language.keys import StepKey

SAME = 1e-9
"""Shares and times this close are the same: absorbs rounding."""
HALVES, THIRDS = (0.25, 0.5, 1.0, 2.0, 4.0), (1.0 / 3.0, 2.0 / 3.0, 3.0)
"""Beats between two landings, in the order in which they are tried."""


@dataclass(frozen=True, slots=True)
class StepGait:
    """In which order feet step, and how far and fast. Own choice, by the check and in simulation.

    Attributes:
        offsets: of FL, FR, RL, RR: shares of a round at which their swings start.
        period: time [s] of a round, unless it is asked for faster or slower.
        least_period, most_period: of the fastest and of the slowest round [s].
        duty: share of a round in which each foot stands.
        stride: longest way [m] ahead in a round.
        side_stride: longest way [m] aside.
        turn: largest turn [rad] in a round.
        rest: time [s] on four feet before the first step and after the last one, at least: the
            trunk moves over the feet that will stand.
        height: of the feet [m] in the middle of a step.
        landings: how often in a round feet land.
    """

    offsets: tuple[float, float, float, float]
    period: float
    least_period: float
    most_period: float
    duty: float
    stride: float
    side_stride: float
    turn: float
    rest: float
    height: float
    landings: int

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
    """Where the frame of the feet goes, seen from where it starts.

    Attributes:
        poses: (k, 3) x, y [m] and yaw [rad] along the way, close to each other.
    """

    poses: Float[np.ndarray, "k 3"]

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
    """When the steps of a stretch are.

    Attributes:
        rounds: how many.
        period: of each [s].
        before: time [s] on four feet before the first step.
        over: of all of it [s].
    """

    rounds: int
    period: float
    before: float
    over: float


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


def least_time(gait: StepGait, rounds: int) -> float:
    """Seconds of so many rounds at the fastest."""
    return 2.0 * gait.rest + (rounds - 1.0 + gait.last) * gait.least_period


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
