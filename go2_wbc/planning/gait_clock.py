"""Where in its stride a gait is, while the gait itself may change.

Period, duty, offsets and width are state: they move towards those that are wanted, at rates below
that at which a foot's phase passes. So any gait becomes any other at any moment, and no foot that
has lifted off is told that it still stands.

Offsets and duty arrive together with the period. Ahead of it, a walk had become a pace or a bound
with strides of half a second, in which the robot tips over the one pair of feet that stands, and a
bound a walk with swings of a tenth of a second.
"""

from __future__ import annotations

from dataclasses import replace

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
    Stride,
)


def resting_gait(gait: Gait) -> Gait:
    """The gait in which a robot that walks with ``gait`` starts and comes to rest."""
    is_own = gait.starts_at_once or (gait.lands_on_four and not gait.needs_mpc)
    return gait if is_own else GAITS["trot"]


class GaitClock:
    """Phase and form of the gait.

    Attributes:
        gait: as it is now.
        rest: the one in which the robot comes to rest.
        time: since the stride's start or a whole number of strides before [s].
    """

    def __init__(self, gait: Gait, stride: Stride | None) -> None:
        """Args: gait: wanted; stride: how it follows the speed, or None."""
        self.change(gait, stride)
        self.restart()

    def change(self, gait: Gait, stride: Stride | None) -> None:
        """Move towards another gait from now on."""
        self._wanted, self.rest, self._stride = gait, resting_gait(gait), stride

    def restart(self) -> None:
        """Begin the first stride."""
        self.gait, self.time = self.rest, 0.0
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
        if self._stride is not None and not is_resting:
            period, duty = self._stride.at(speed)
            fall = DUTY_FALL if is_thrown else DUTY_RATE
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


def _moved(value: float, goal: float, most: float) -> float:
    return value + min(max(goal - value, -most), most)


def _turned(phase: float, goal: float, most: float, share: float) -> float:
    """``phase`` moved the shorter way round to ``goal``, by ``most`` or ``share`` of the way."""
    way = (goal - phase + 0.5) % 1.0 - 0.5
    most = min(most, abs(way) * share)
    if abs(way) <= most:
        return goal
    return (phase + (most if way > 0.0 else -most)) % 1.0
