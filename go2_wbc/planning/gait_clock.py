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

from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Float

from go2_wbc.compilation import subroutine
from go2_wbc.contacts import GAITS, TIE, Gait, Stride
from go2_wbc.planning.ground import RoughConfig
from go2_wbc.records import Record

PERIOD_RATE, DUTY_RATE, OFFSET_RATE = 0.2, 0.5, 0.8
"""Greatest change of a gait in a second: of its period [s/s], duty and offsets [1/s]. A foot's
phase passes at 2 per second or more, so that no foot is put back to where it was."""
WIDTH_RATE = 2.0
"""Greatest change of a gait's width in a second, so that no swing's goal jumps [1/s]."""
DUTY_FALL = 4.0
"""Greatest fall [1/s] of the duty of a robot that has been thrown: a foot that lifts off sooner
is not put back. At 0.5 a push of 50 N s ahead threw a trot of 0.5 m/s over feet that stood on."""
SEEN_STRIDE = Stride(reach=0.25, stance_min=0.25, stance_max=0.25, swing=0.25, swing_slope=0.0)
"""Of a trot on uneven ground that is seen."""
Phases = tuple[float, float, float, float]  #: At which the feet touch down, of FL, FR, RL and RR
WAITING = 0.5
"""How fast, as a share, the gait goes on while a foot that was stopped at a step rises. At 1 m/s it
had 40 ms for that: it was still below the edge as the pair that stood was lifted, nothing stood for
up to 0.1 s, and the trunk fell onto the step."""
_RESOLUTION = 1e12  #: Of phases, that adding and dividing may have blurred, in steps a turn


@dataclass(frozen=True, slots=True)
class GaitForm:
    """What of a gait may change while it is walked; see ``contacts.Gait``."""

    period: float
    duty: float
    offsets: Phases
    width: float

    @staticmethod
    def of(gait: Gait) -> GaitForm:
        """That of a gait as it is written."""
        return GaitForm(gait.period, gait.duty, gait.offsets, gait.width)


@dataclass(frozen=True, slots=True)
class Cadence:
    """Which gait is wanted."""

    wanted: GaitForm  #: its form, where it does not follow the speed
    rest: GaitForm  #: the one in which the robot starts and comes to rest
    stride: Stride  #: how period and duty follow the speed
    rough_stride: Stride  #: the same on rough ground
    seen_stride: Stride  #: the same on uneven ground that is seen
    follows_speed: bool  #: whether they do

    @staticmethod
    def of(gait: Gait, rough: RoughConfig | None = None) -> Cadence:
        """That of a robot that walks with ``gait``, on rough ground as told."""
        rest, stride, c = resting_gait(gait), gait.stride or Stride(), rough or RoughConfig()
        longest = max(min(stride.stance_max, c.stance), stride.stance_min)
        on_rough = replace(stride, swing=stride.swing + c.swing, stance_max=longest)
        forms = GaitForm.of(gait), GaitForm.of(rest)
        return Cadence(*forms, stride, on_rough, SEEN_STRIDE, gait.stride is not None)


class Clock(Record):
    """Phase and form of the gait."""

    time: float  #: since the stride's start or a whole number of strides before [s]
    period: float  #: [s] of the gait as it is now, whose form the next three are, too
    duty: float  #: of the same
    offsets: Float[np.ndarray, "4"]  #: of the same
    width: float  #: of the same
    goal: Float[np.ndarray, "4"]  #: offsets to which those of now were aligned
    is_waiting: bool  #: whether it goes on slowly, for a foot that was stopped
    is_rough: bool  #: whether its strides are those on rough ground
    is_seen: bool  #: whether they are those on uneven ground that is seen


def resting_gait(gait: Gait) -> Gait:
    """The gait in which a robot that walks with ``gait`` starts and comes to rest."""
    is_own = gait.starts_at_once or (gait.lands_on_four and not gait.has_flight)
    return gait if is_own else GAITS["trot"]


@subroutine
def restart(clock: Clock, c: Cadence) -> None:
    """Begin the first stride."""
    clock.time = 0.0
    clock.period, clock.duty, clock.width = c.rest.period, c.rest.duty, c.rest.width
    clock.offsets[:] = c.rest.offsets
    clock.goal[:] = c.rest.offsets


@subroutine
def foot_phase(clock: Clock, leg: int) -> tuple[bool, float, float]:
    """Whether a foot is in stance now, since when, and for how long yet [s]."""
    period, duty = clock.period, clock.duty
    if duty >= 1.0:
        return True, np.inf, np.inf
    stance_time = duty * period
    elapsed = (clock.time - clock.offsets[leg] * period + TIE) % period - TIE
    if elapsed < stance_time - TIE:
        return True, max(elapsed, 0.0), stance_time - elapsed
    return False, max(elapsed - stance_time, 0.0), period - elapsed


@subroutine
def pace(clock: Clock) -> float:
    """How fast the gait goes on, as a share."""
    return WAITING if clock.is_waiting else 1.0


@subroutine
def alignment(offsets: Float[np.ndarray, "4"], goal: Float[np.ndarray, "4"]) -> float:
    """By how much to shift all ``offsets`` so that the longest way of any to its goal is least.

    The ways are points on a circle: the greatest gap between two neighbours is where none is, and
    the middle of the arc that is left comes to lie at no way at all.
    """
    ways = np.empty(4)
    for leg in range(4):
        ways[leg] = (goal[leg] - offsets[leg]) % 1.0
    ways.sort()
    widest, last = 0.0, 3
    for k in range(4):
        gap = ways[k + 1] - ways[k] if k < 3 else 1.0 - (ways[3] - ways[0])
        gap = np.floor(gap * _RESOLUTION + 0.5)
        if gap > widest:
            widest, last = gap, k
    return ways[(last + 1) % 4] + (1.0 - widest / _RESOLUTION) / 2.0


@subroutine
def shifted(phase: float, shift: float) -> float:
    """A phase later by ``shift``, in [0, 1): rounded, as less than nothing is 1.0 at first."""
    return np.floor((phase + shift) * _RESOLUTION + 0.5) / _RESOLUTION % 1.0 % 1.0


@subroutine
def align(clock: Clock, goal: Float[np.ndarray, "4"]) -> None:
    """Name the phases of now so that they are near to the ``goal``; no foot notices."""
    shift = alignment(clock.offsets, goal)
    for leg in range(4):
        clock.offsets[leg] = shifted(clock.offsets[leg], shift)
        clock.goal[leg] = goal[leg]
    clock.time = (clock.time + shift * clock.period) % clock.period


@subroutine
def differ(a: Float[np.ndarray, "4"], b: Float[np.ndarray, "4"]) -> bool:
    """Whether any number does."""
    return a[0] != b[0] or a[1] != b[1] or a[2] != b[2] or a[3] != b[3]


@subroutine
def stride_at(c: Stride, speed: float) -> tuple[float, float]:
    """Period [s] and duty at a ``speed`` [m/s]."""
    stance = min(max(c.reach / max(speed, TIE), c.stance_min), c.stance_max)
    period = stance + c.swing + c.swing_slope * (speed - 1.0)
    return period, stance / period


@subroutine
def adapt(
    clock: Clock, c: Cadence, dt: float, speed: float, is_resting: bool, is_thrown: bool
) -> None:
    """Let ``dt`` [s] of change pass, towards the gait for ``speed`` [m/s] or for resting.

    A robot that ``is_thrown``, faster than it shall be, lifts its feet sooner at once.
    """
    period, duty, width, offsets = c.wanted.period, c.wanted.duty, c.wanted.width, np.empty(4)
    offsets[:] = c.wanted.offsets
    rise = fall = DUTY_RATE
    hurries = False
    if is_resting:
        period, duty, width = c.rest.period, c.rest.duty, c.rest.width
        offsets[:] = c.rest.offsets
    elif c.follows_speed:
        if is_thrown:
            fall, hurries = DUTY_FALL, True
        if clock.is_seen:
            period, duty = stride_at(c.seen_stride, speed)
        else:
            period, duty = stride_at(c.rough_stride if clock.is_rough else c.stride, speed)
    if differ(offsets, clock.goal):
        align(clock, offsets)
    left = abs(clock.period - period) / PERIOD_RATE
    if left > 0.0 and not hurries and differ(offsets, clock.offsets):
        rise = fall = min(fall, abs(duty - clock.duty) / left)
    if period != clock.period:
        most = PERIOD_RATE * dt
        moved = clock.period + min(max(period - clock.period, -most), most)
        clock.time = clock.time % clock.period * moved / clock.period
        clock.period = moved
    clock.duty += min(max(duty - clock.duty, -fall * dt), rise * dt)
    most = WIDTH_RATE * dt
    clock.width += min(max(width - clock.width, -most), most)
    share = dt / left if left > dt else 1.0
    for leg in range(4):
        turn(clock, leg, offsets[leg], dt, share)


@subroutine
def turn(clock: Clock, leg: int, goal: float, dt: float, share: float) -> None:
    """Move a foot's phase the shorter way round to its goal, by ``share`` of the way at most."""
    if goal == clock.offsets[leg]:
        return
    way = (goal - clock.offsets[leg] + 0.5) % 1.0 - 0.5
    most = min(OFFSET_RATE * dt, abs(way) * share)
    if abs(way) <= most:
        clock.offsets[leg] = goal
    else:
        clock.offsets[leg] = (clock.offsets[leg] + (most if way > 0.0 else -most)) % 1.0 % 1.0


def time_between(gait: Gait, other: Gait) -> float:
    """Time [s] in which one gait becomes the other."""
    offsets, goal = np.array(gait.offsets), np.array(other.offsets)
    shift = alignment(offsets, goal)
    ways = (goal - [shifted(phase, shift) for phase in offsets] + 0.5) % 1.0 - 0.5
    return max(
        abs(other.period - gait.period) / PERIOD_RATE,
        abs(other.duty - gait.duty) / DUTY_RATE,
        float(np.abs(ways).max()) / OFFSET_RATE,
        abs(other.width - gait.width) / WIDTH_RATE,
    )
