"""Where in its stride a gait is, while the gait itself may change.

Period, duty, offsets and width are state: they move towards those that are wanted, at rates below
that at which a foot's phase passes. So any gait becomes any other at any moment, and no foot that
has lifted off is told that it still stands.

Offsets and duty arrive together with the period. Ahead of it, a walk had become a pace or a bound
with strides of half a second, in which the robot tips over the one pair of feet that stands, and a
bound a walk with swings of a tenth of a second.

A gait whose feet are all shifted by the same phase is the same gait: it only begins elsewhere.
So before phases move to other ones, those of now, and the time in the stride with them, are shifted
to where the longest way of any foot is shortest (``aligned``): a walk becomes a trot by an eighth
of a stride of each foot. By the phases as they are written its front feet went half a stride,
through a pace.
"""

from __future__ import annotations

from dataclasses import replace
from itertools import pairwise

from go2_wbc.contacts import (
    DUTY_FALL,
    DUTY_RATE,
    GAITS,
    OFFSET_RATE,
    PERIOD_RATE,
    WIDTH_RATE,
    ContactPhase,
    ContactSchedule,
    Gait,
)

Phases = tuple[float, float, float, float]
"""At which the feet touch down, of FL, FR, RL and RR."""
_DIGITS = 12
"""Of a phase: what adding and dividing leaves is none."""


def resting_gait(gait: Gait) -> Gait:
    """The gait in which a robot that walks with ``gait`` starts and comes to rest."""
    is_own = gait.starts_at_once or (gait.lands_on_four and not gait.has_flight)
    return gait if is_own else GAITS["trot"]


class GaitClock:
    """Phase and form of the gait.

    Attributes:
        gait: as it is now.
        rest: the one in which the robot comes to rest.
        time: since the stride's start or a whole number of strides before [s].
    """

    def __init__(self, gait: Gait) -> None:
        """Start for ``gait``."""
        self.change(gait)
        self.restart()

    def change(self, gait: Gait) -> None:
        """Move towards another gait from now on."""
        self._wanted, self.rest = gait, resting_gait(gait)

    def restart(self) -> None:
        """Begin the first stride."""
        self.gait, self.time = self.rest, 0.0
        self._goal = self.gait.offsets
        self._schedule: ContactSchedule = self.gait.schedule()

    def now(self) -> ContactPhase:
        """The contacts of this instant."""
        return self._schedule.at(self.time)

    def adapt(self, dt: float, speed: float, *, is_resting: bool, is_thrown: bool) -> None:
        """Let ``dt`` [s] of change pass, towards the gait for ``speed`` [m/s] or for resting.

        A robot that ``is_thrown``, faster than it shall be, lifts its feet sooner at once.
        """
        wanted = self.rest if is_resting else self._wanted
        period, duty, rise, fall = wanted.period, wanted.duty, DUTY_RATE, DUTY_RATE
        if wanted.stride is not None and not is_resting:
            period, duty = wanted.stride.at(speed)
            fall = DUTY_FALL if is_thrown else DUTY_RATE
        if wanted.offsets != self._goal:
            self._align(wanted.offsets)
        before = self.gait
        left = abs(period - before.period) / PERIOD_RATE
        if left > 0.0 and fall == DUTY_RATE and wanted.offsets != before.offsets:
            rise = fall = min(fall, abs(duty - before.duty) / left)
        share = dt / left if left > dt else 1.0
        pairs = zip(before.offsets, wanted.offsets, strict=True)
        offsets = tuple(_turned(now, goal, OFFSET_RATE * dt, share) for now, goal in pairs)
        period = _moved(before.period, period, PERIOD_RATE * dt)
        duty = before.duty + min(max(duty - before.duty, -fall * dt), rise * dt)
        width = _moved(before.width, wanted.width, WIDTH_RATE * dt)
        form = (period, duty, offsets, width)
        if form == (before.period, before.duty, before.offsets, before.width):
            return
        if period != before.period:
            self.time = self.time % before.period * period / before.period
        self.gait = replace(wanted, period=period, duty=duty, offsets=offsets, width=width)
        self._schedule = self.gait.schedule()

    def _align(self, goal: Phases) -> None:
        """Name the phases of now so that they are near to the ``goal``; no foot notices."""
        offsets = aligned(self.gait.offsets, goal)
        shift = (offsets[0] - self.gait.offsets[0]) % 1.0
        self.time = (self.time + shift * self.gait.period) % self.gait.period
        self.gait = replace(self.gait, offsets=offsets)
        self._schedule, self._goal = self.gait.schedule(), goal


def time_between(gait: Gait, other: Gait) -> float:
    """Time [s] in which one gait becomes the other."""
    offsets = aligned(gait.offsets, other.offsets)
    ways = (abs((b - a + 0.5) % 1.0 - 0.5) for a, b in zip(offsets, other.offsets, strict=True))
    return max(
        abs(other.period - gait.period) / PERIOD_RATE,
        abs(other.duty - gait.duty) / DUTY_RATE,
        max(ways) / OFFSET_RATE,
        abs(other.width - gait.width) / WIDTH_RATE,
    )


def aligned(offsets: Phases, goal: Phases) -> Phases:
    """``offsets``, all shifted by as much, such that the longest way of any to its goal is least.

    The ways are points on a circle: the greatest gap between two neighbours is where none is, and
    the middle of the arc that is left comes to lie at no way at all.
    """
    ways = sorted((b - a) % 1.0 for a, b in zip(offsets, goal, strict=True))
    gaps = [round(b - a, _DIGITS) for a, b in pairwise(ways)]
    gaps.append(round(1.0 - (ways[-1] - ways[0]), _DIGITS))
    last = gaps.index(max(gaps))
    first, arc = ways[(last + 1) % len(ways)], 1.0 - gaps[last]
    shift = first + arc / 2.0
    fl, fr, rl, rr = (_phase(round(offset + shift, _DIGITS)) for offset in offsets)
    return fl, fr, rl, rr


def _phase(turns: float) -> float:
    """The part of a turn, in [0, 1): less than nothing by rounding is 1.0 after one division."""
    return turns % 1.0 % 1.0


def _moved(value: float, goal: float, most: float) -> float:
    return value + min(max(goal - value, -most), most)


def _turned(phase: float, goal: float, most: float, share: float) -> float:
    """``phase`` moved the shorter way round to ``goal``, by ``most`` or ``share`` of the way."""
    way = (goal - phase + 0.5) % 1.0 - 0.5
    most = min(most, abs(way) * share)
    if abs(way) <= most:
        return goal
    return _phase(phase + (most if way > 0.0 else -most))
