"""A foot's swing: from lift-off over an apex to a touchdown that may still move, to its contact.

With the share ``u`` of a span of ``T`` seconds and the ease ``s(u) = 3 u^2 - 2 u^3``, a coordinate
goes from ``a`` to ``b`` as ``p = a + s (b - a)``; so ``v = s' (b - a) / T`` and
``a = s'' (b - a) / T^2``. Horizontally the span is the swing, or what is left of it after a delay
and, up stairs, before its end; vertically each half of it; on rough ground and on slopes its two
parts are as the square roots of the ways up and down, so that the foot speeds up no more on one
than on the other: halves made feet that rose to the next step push the robot down with its weight,
and throw it when they slowed down. At 1 m/s on 18 deg two feet that went down by 0.22 m in half of
the time took all load off those that stood, for 40 ms in each stride.

How high a foot is raised, and how late it goes ahead, is settled when it leaves the ground. What is
learnt of the ground meanwhile is for the next swing: a curve that was changed on the way jumped by
5 cm, and feet that swung beside the one that had stumbled came down too early, too far back. A foot
that is stopped in the middle of its swing begins another one where it is, in the time that is left:
it rises along what it has met before it goes on, and comes down well beyond: at the edge of a step,
where it was led before, it slipped off, the trunk dropped, and its nose met the face of the next.
Where the robot is faster than it shall be on rough ground, the gait waits while such a foot rises,
which does not stand by touching the face meanwhile.

Those feet of a gait stand that shall, and those that have found a step before they do. A foot that
meets something above the ground, late in its swing, stands from then on. If it went on towards its
place it would push against the step. On ground as expected it stands when it is planned to, so that
a trot on the level is as exact as its clock.

A foot that is late stands too, from when it is planned to. Its leg carries its share of the force,
which puts it down within milliseconds. To let it swing down instead until it is met, at 0.4 to
1.5 m/s, made the trot fall in 4 of 6 runs over boxes of 12 cm and up stairs of 10 cm, which it
walked in 6 and 5 without (own simulation).

``tracking.landing`` does the like for motions.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from go2_wbc.compilation import subroutine
from go2_wbc.contacts import TIE
from go2_wbc.planning.gait_clock import Clock, foot_phase, pace
from go2_wbc.planning.ground import (
    STEEP,
    Ground,
    RoughConfig,
    apex_raise,
    delay,
    earliness,
    is_met_rough,
    is_rough,
)
from go2_wbc.records import Array3, Record
from go2_wbc.robot.state import Snapshot
from go2_wbc.validation import NOT_NEGATIVE, POSITIVE, ranged

EARLIEST = 0.7  #: Share of the swing from which on a contact may be a landing
STEP = 0.015
"""Height [m] above the ground from which on it is one. Both are from a search in simulation."""

BEYOND, ABOVE = 0.08, 0.08
"""How far [m] a foot that was stopped on rough ground is put down beyond that place at least, and
by how much higher [m] than on smooth ground a whole swing of it would be."""


class FootContact(Record):
    """What is known of a foot's contact."""

    is_early: bool  #: whether it stands ahead of its plan
    since: float
    """For how long [s] it has done so; infinite if it has come down when it was planned to."""
    was_stance: bool  #: whether it was planned to stand at the tick before
    is_awaited: bool  #: whether it shall stand and has not met the ground yet


@subroutine
def follow_contact(
    foot: FootContact, above: float, touches: bool, planned: bool, progress: float, dt: float
) -> bool:
    """Bring a foot to this tick, ``dt`` seconds after the last; returns whether it stands.

    Args:
        above: height [m] of the foot above the ground as it is known.
        touches: whether a contact is measured.
        planned: whether it shall stand.
        progress: share of its swing that has passed, anew if it was stopped in that.
    """
    if planned:
        foot.is_early = False
    elif not foot.is_early:
        foot.since = np.inf
        if touches and above > STEP and progress >= EARLIEST - TIE:
            foot.is_early, foot.since = True, 0.0
    foot.since += dt
    return planned or foot.is_early


@subroutine
def loaded_time(foot: FootContact, planned: bool, elapsed: float, remaining: float) -> float:
    """Time [s] to the nearest change of a standing foot's contact, since when it came down."""
    begun = foot.since if foot.since < np.inf else elapsed
    return min(begun, remaining) if planned else begun


@dataclass(frozen=True, slots=True)
@ranged(POSITIVE, touchdown_depth=NOT_NEGATIVE)
class SwingConfig:
    """Shape of a swing.

    Attributes:
        apex: height [m] of the foot above the higher of lift-off and touchdown. Over boxes of up
            to 8 cm at 1.0 m/s the trot fell in 5 of 20 runs with 6 cm, in none with 9 or 10; on
            the flat, 10 cm takes a third more torque at 1.5 m/s than 9.
        touchdown_depth: distance [m] below the ground at which touchdown is aimed, so that the
            foot arrives with certainty.
        full_depth_way: length [m] of a swing up to which that is the depth; beyond, it shrinks with
            the square of the length. A foot that is aimed below the ground by a share ``s`` of the
            apex meets it while it still moves ahead, at ``3 sqrt(s / 3)`` times its mean speed: 2
            m/s at 3 m/s, which threw 4 of 10 robots, all on floors of 0.8 and more; 0.9 as it is.
    """

    apex: float = 0.09
    touchdown_depth: float = 0.008
    full_depth_way: float = 0.4

    def at_most(self, apex: float) -> SwingConfig:
        """The same with an apex [m] of ``apex`` if that is lower."""
        return replace(self, apex=min(self.apex, apex))


class Swing(Record):
    """How the swing of one foot has begun."""

    start: Array3  #: where the foot was [m]
    raised: float  #: height [m] by which its apex is higher than on smooth ground
    delay: float  #: share of it in which the foot only rises
    early: float  #: share of it that is left when the foot has arrived above its goal
    begun: float  #: share of the gait's swing that had passed by then
    beyond: float  #: how far [m] ahead of its start it ends at least; 0 for wherever it is led
    is_awaited: bool  #: whether the gait waits while it rises, stopped in a fast way
    peak: float
    """Share of it at which the foot is highest; 0 until that is settled, at its first tick."""


class Step(Record):
    """Where and how a foot swings that is placed by sight; see ``sighted_steps``."""

    is_sighted: bool  #: whether this swing is
    next: float  #: when [s] the foothold is chosen again
    chosen: Array3  #: the foothold, for the centre of the foot [m]
    goal: Array3  #: where the foot is led, on its way there [m]
    top: float  #: greatest height of the swing [m]
    peak: float  #: share of the swing at which it is there
    begin: float  #: share from which on the foot goes ahead
    end: float  #: share until which it does


@subroutine
def begin_swing(
    swing: Swing, p_foot: Array3, ground: Ground, c: RoughConfig, ahead: tuple[float, float]
) -> None:
    """A foot leaves the ground, of a robot on its way ``ahead`` [m/s]."""
    swing.start[:] = p_foot
    swing.raised, swing.delay, swing.begun = apex_raise(ground, c), delay(ground), 0.0
    swing.beyond, swing.is_awaited, swing.early = 0.0, False, earliness(ground, ahead)
    is_steep = np.hypot(ground.slope[0], ground.slope[1]) > STEEP
    swing.peak = 0.0 if is_rough(ground) or is_steep else 0.5


@subroutine
def resume_swing(
    swing: Swing, leg: int, now: Snapshot, ground: Ground, progress: float, is_fast: bool
) -> None:
    """A foot has been stopped at ``progress``; it goes on from there, once in a swing.

    It is raised as high as the time allows that is left: to lift one by 7 cm more within 44 ms took
    590 N from the standing feet. The gait waits for it if the robot ``is_fast``.
    """
    if swing.begun == 0.0:
        is_step = is_rough(ground) or is_met_rough(ground, now)
        swing.start[:] = now.p_world_feet[leg]
        swing.raised, swing.beyond = (ABOVE, BEYOND) if is_step else (0.0, 0.0)
        swing.delay, swing.begun, swing.early = delay(ground), progress, 0.0
        swing.peak, swing.is_awaited = 0.5, is_step and is_fast


@subroutine
def own_progress(swing: Swing, progress: float) -> float:
    """Share that has passed of a swing that may have begun anew, at ``progress`` of the gait's."""
    return (progress - swing.begun) / (1.0 - swing.begun)


@subroutine
def is_held_up(swing: Swing, foot: FootContact, clock: Clock, leg: int) -> bool:
    """Whether a foot that the gait waits for rises yet."""
    if foot.is_early or not swing.is_awaited:
        return False
    stands, elapsed, remaining = foot_phase(clock, leg)
    return not stands and own_progress(swing, elapsed / (elapsed + remaining)) < swing.peak


@subroutine
def lead_beyond(swing: Swing, velocity: tuple[float, float], ground: Ground, goal: Array3) -> None:
    """Move a goal [m] ahead, on the robot's way at ``velocity`` [m/s], as far as a swing asks."""
    if swing.beyond == 0.0:
        return
    speed = max(np.hypot(velocity[0], velocity[1]), TIE)
    x, y = velocity[0] / speed, velocity[1] / speed
    way = (goal[0] - swing.start[0]) * x + (goal[1] - swing.start[1]) * y
    missing = max(swing.beyond - way, 0.0)
    goal[0] += missing * x
    goal[1] += missing * y
    goal[2] += missing * (ground.slope[0] * x + ground.slope[1] * y)


@subroutine
def cubic(x: float) -> tuple[float, float, float]:
    """s = 3 x^2 - 2 x^3 and its two derivatives."""
    return x * x * (3 - 2 * x), 6 * x * (1 - x), 6 - 12 * x


@subroutine
def swing_foot(
    swing: Swing,
    clock: Clock,
    c: SwingConfig,
    progress: float,
    goal: Array3,
    land: float,
    p: Array3,
    v: Array3,
    a: Array3,
) -> None:
    """Fill position [m], velocity [m/s] and acceleration [m/s^2] of the foot centre in the world.

    Horizontally one cubic: it follows late changes of the goal better than minimum jerk, whose
    speed is gone sooner. Vertically two that meet, at rest, at the apex.

    Args:
        swing: how it has begun.
        clock: of the gait, whose swing it is.
        c: apex and touchdown depth.
        progress: share of the gait's swing that has passed, 0 to 1.
        goal: the place that the foot passes its apex above [m]; may change from call to call.
        land: height [m] at which it shall touch down there.
    """
    share = 1.0 - swing.begun
    progress = own_progress(swing, progress)
    duration = share * (1.0 - clock.duty) * clock.period / pace(clock)
    start, late, end = swing.start, swing.delay, 1.0 - swing.early
    span = duration * (end - late)
    x, dx, ddx = 0.0, 0.0, 0.0
    if progress > end:
        x = 1.0
    elif progress >= late - TIE:
        x, dx, ddx = cubic((progress - late) / (end - late))
    for i in range(2):
        delta = goal[i] - start[i]
        p[i] = start[i] + x * delta
        v[i] = dx / span * delta
        a[i] = ddx / span**2 * delta
    # a gait passes the middle in whole ticks, where the acceleration changes its sign
    apex = max(start[2], goal[2]) + share * (c.apex + swing.raised)
    way = np.hypot(goal[0] - start[0], goal[1] - start[1])
    depth = c.touchdown_depth * min(1.0, c.full_depth_way / max(way, TIE)) ** 2
    if swing.peak == 0.0:
        up, down = np.sqrt(apex - start[2]), np.sqrt(apex - land + depth)
        swing.peak = up / (up + down)
    is_rising = progress < swing.peak - TIE
    begin, past = (start[2], 0.0) if is_rising else (apex, swing.peak)
    delta = (apex if is_rising else land - depth) - begin
    share = swing.peak if is_rising else 1.0 - swing.peak
    x, dx, ddx = cubic((progress - past) / share)
    p[2] = begin + x * delta
    v[2] = dx * delta / (share * duration)
    a[2] = ddx * delta / (share * duration) ** 2
