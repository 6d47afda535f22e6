"""Which feet touch the ground when: contact schedules as data.

A schedule is a list of events (a time, and the feet in stance from then on). Intervals are
half-open: at the exact time of an event the new mode is in force; times within ``TIE`` of an event
count as the event. A periodic schedule (a gait) repeats; any other holds its first and last mode.
"""

from __future__ import annotations

import math
from bisect import bisect_right
from dataclasses import InitVar, dataclass, field

import numpy as np
from jaxtyping import Bool, Float

from go2_wbc.arguments import typed
from go2_wbc.brief import brief
from go2_wbc.errors import CommandError, ConfigError, unknown_name
from go2_wbc.legs import LEGS
from go2_wbc.validation import NOT_NEGATIVE, POSITIVE, SHARE, Retired, ranged, retires

TIE = 1e-9
"""Times this close [s] to an event count as the event: absorbs rounding of summed time steps."""


@dataclass(frozen=True, slots=True)
class ContactPhase:
    """The contacts at one instant, or (n, 4) at many."""

    stance: Bool[np.ndarray, "*n 4"]  #: feet in stance
    elapsed: Float[np.ndarray, "*n 4"]
    """Seconds since each foot's last change (inf if it never changed)."""
    remaining: Float[np.ndarray, "*n 4"]
    """Seconds until each foot's next change (inf if it never changes)."""

    @property
    def progress(self) -> Float[np.ndarray, "*n 4"]:
        """Elapsed share of each foot's present interval, in [0, 1); 0 where it has no end."""
        total = self.elapsed + self.remaining
        finite = np.isfinite(total) & (total > 0)
        return np.where(finite, self.elapsed / np.where(finite, total, 1.0), 0.0)

    def load_share(self, ramp: float) -> Float[np.ndarray, "*n 4"]:
        """Share of its load that each foot may bear: 1 in stance, 0 in the air.

        It rises over ``ramp`` seconds after a touchdown and falls over as long before a lift-off,
        so that contact forces change without a jump.
        """
        nearest_change = np.minimum(self.elapsed, self.remaining)
        return np.where(self.stance, np.clip(nearest_change / max(ramp, TIE), 0.0, 1.0), 0.0)


@typed()
@dataclass(frozen=True, slots=True)
class ContactSchedule:
    """Events in increasing order: from ``times[i]`` on, the feet ``modes[i]`` are in stance.

    Attributes:
        times: event times [s]; ``times[0]`` is the start (0 for a periodic schedule).
        modes: (n, 4) feet in stance from each event on.
        period: seconds after which a gait repeats, or None.
        since: (n, 4) when each foot's contact changed last, between an event and the next [s];
            -inf if never.
        until: (n, 4) when it changes next [s]; inf if never.
    """

    times: tuple[float, ...]
    modes: Bool[np.ndarray, "n 4"]
    period: float | None = None
    since: Float[np.ndarray, "n 4"] = field(init=False, repr=False)
    until: Float[np.ndarray, "n 4"] = field(init=False, repr=False)

    __repr__ = brief

    def __post_init__(self) -> None:
        """Check the order of the events and find each foot's changes."""
        rising = all(b > a for a, b in zip(self.times[:-1], self.times[1:], strict=True))
        if not self.times or not rising or len(self.modes) != len(self.times):
            raise CommandError(
                f"contact events need increasing times, and as many modes, got {self.times}"
            )
        if self.period is not None and (self.times[0] != 0.0 or self.times[-1] >= self.period):
            raise CommandError(
                f"periodic contact events must start at 0 and end before the period of "
                f"{self.period} s, got {self.times}"
            )
        changes = [self._changes_of(leg) for leg in LEGS]
        upcoming = [np.searchsorted(times, self.times, side="right") for times in changes]
        pairs = list(zip(changes, upcoming, strict=True))
        object.__setattr__(self, "since", np.column_stack([times[i - 1] for times, i in pairs]))
        object.__setattr__(self, "until", np.column_stack([times[i] for times, i in pairs]))

    def _changes_of(self, leg: int) -> Float[np.ndarray, " k"]:
        """When the foot's contact changes, with the last time before these and the next after."""
        column = self.modes[:, leg]
        previous = np.roll(column, 1)
        if self.period is None:
            previous[0] = column[0]
        changes = np.asarray(self.times, float)[column != previous]
        before, after = -np.inf, np.inf
        if self.period is not None and len(changes):
            before, after = changes[-1] - self.period, changes[0] + self.period
        return np.array([before, *changes, after])

    @typed(late=True)
    def at(self, t: float) -> ContactPhase:
        """The contacts at ``t`` seconds after the schedule's start."""
        if self.period is not None:
            t = (t + TIE) % self.period
            t = max(t - TIE, 0.0)
        index = max(bisect_right(self.times, t + TIE) - 1, 0)
        elapsed = np.maximum(t - self.since[index], 0.0)
        return ContactPhase(self.modes[index].copy(), elapsed, self.until[index] - t)

    @typed(late=True)
    def at_times(self, times: Float[np.ndarray, " n"]) -> ContactPhase:
        """The contacts at many instants [s], (n, 4): those that ``at`` gives for each."""
        if self.period is not None:
            times = np.maximum((times + TIE) % self.period - TIE, 0.0)
        index = np.maximum(np.searchsorted(self.times, times + TIE, side="right") - 1, 0)
        elapsed = np.maximum(times[:, None] - self.since[index], 0.0)
        return ContactPhase(self.modes[index], elapsed, self.until[index] - times[:, None])


@dataclass(frozen=True, slots=True)
@ranged(POSITIVE, swing_slope=NOT_NEGATIVE)
class Stride:
    """How a stride follows the speed: a foot stands as long as it takes to pass below the hip.

    Those of a slow trot are as long as they can be: the way of the feet up and down costs the same
    energy each time. At 0.5 m/s a trot of 0.33 s took 1.07 of its weight times its way, this one of
    0.40 s 0.74 (on sensors, in the mean of three seeds).
    """

    reach: float = 0.20  #: way [m] of the trunk over a standing foot
    stance_min: float = 0.08  #: least time [s] that a foot stands
    stance_max: float = 0.20  #: greatest time [s] that a foot stands
    swing: float = 0.20  #: time [s] of the swing at 1 m/s
    swing_slope: float = 0.01  #: what each m/s more adds to it [s^2/m]

    def __post_init__(self) -> None:
        """Raise ConfigError for bounds or a swing that leave no stride."""
        if self.stance_min > self.stance_max or self.swing <= self.swing_slope:
            raise ConfigError(
                f"Stride needs stance_min <= stance_max and swing > swing_slope, got {self}"
            )


@typed()
@dataclass(frozen=True, slots=True)
@retires(needs_mpc=Retired(True, "the forces of every gait are planned ahead"))
@ranged(period=POSITIVE, duty=SHARE, envelope_share=SHARE, width=SHARE)
class Gait:
    """A periodic pattern of steps.

    Attributes:
        name: what users call it.
        period: stride period [s].
        duty: share of the period that a foot is in stance, in (0, 1].
        offsets: phase in [0, 1) at which each foot (FL, FR, RL, RR) touches down.
        stride: how period and duty follow the speed; None if they are fixed.
        apex: height [m] of a swing, as ``SwingConfig.apex``, in whose place it is if it is lower; a
            low swing leaves more of the motors to the feet that stand.
        envelope_share: share of the trot's velocity envelope in which a gait of one's own is
            walked, (0, 1]; those with a name have a measured one (``planning.envelopes``).
        starts_at_once: whether the first stride is already this gait's, and not the trot's: for a
            robot that does not stand still.
        width: of the feet from the middle, as a share of the standing robot's, (0, 1]. Who stands
            on both feet of a side pushes along the ground by half of what they carry, or tips over:
            of 285 changes from a flying trot to a pace as wide as a trot 4 fell, of 300 to one of
            0.65 none.
    """

    name: str
    period: float
    duty: float
    offsets: tuple[float, float, float, float]
    stride: Stride | None = None
    apex: float = math.inf
    needs_mpc: InitVar[bool] = True
    envelope_share: float = 1.0
    starts_at_once: bool = False
    width: float = 1.0

    __repr__ = brief

    def __post_init__(self, needs_mpc: bool) -> None:
        """Raise ConfigError for an apex or offset that is out of range."""
        if not self.apex > 0.0:
            raise ConfigError(f"Gait.apex must be positive, got {self.apex!r}")
        if len(self.offsets) != 4 or not all(0.0 <= offset < 1.0 for offset in self.offsets):
            raise ConfigError(f"Gait.offsets must be four phases in [0, 1), got {self.offsets}")

    @property
    def stance_time(self) -> float:
        """Seconds that a foot stands in each stride."""
        return self.duty * self.period

    @property
    def swing_time(self) -> float:
        """Seconds that a foot swings in each stride."""
        return (1.0 - self.duty) * self.period

    @typed()
    def placed(self, p_base_feet: Float[np.ndarray, "4 3"]) -> Float[np.ndarray, "4 3"]:
        """The standing robot's feet, or what else has two sides, as far apart as in this gait."""
        return p_base_feet * [1.0, self.width, 1.0]

    @property
    def lands_on_four(self) -> bool:
        """Whether at some touchdown no other foot is in the air, so that the robot can stop."""
        offsets = np.array(self.offsets)
        phase = (offsets[:, None] - offsets + TIE) % 1.0 - TIE
        return bool((phase <= self.duty + TIE).all(axis=1).any())

    @property
    def stands_beside_com(self) -> bool:
        """Whether at times only the feet of one side, or of one end, stand."""
        pairs = {frozenset(pair) for pair in ((0, 2), (1, 3), (0, 1), (2, 3))}
        return any(frozenset(np.flatnonzero(mode)) in pairs for mode in self.schedule().modes)

    @property
    def has_flight(self) -> bool:
        """Whether there are moments without a foot on the ground."""
        return not self.schedule().modes.any(axis=1).all()

    def schedule(self) -> ContactSchedule:
        """This gait as a periodic schedule that starts at phase 0."""
        liftoffs = [(o + self.duty) % 1.0 for o in self.offsets]
        phases = np.unique(np.round([0.0, *self.offsets, *liftoffs], 12) % 1.0)
        phase_of = (phases[:, None] - self.offsets + TIE) % 1.0
        return ContactSchedule(
            tuple(float(p) * self.period for p in phases), phase_of < self.duty, self.period
        )


def standing() -> ContactSchedule:
    """All four feet in stance, for ever."""
    return ContactSchedule((0.0,), np.ones((1, 4), dtype=bool))


BOUNDING = Stride(reach=0.15, stance_min=0.08, stance_max=0.15, swing=0.16, swing_slope=0.0)
GALLOPING = Stride(reach=0.15, stance_min=0.08, stance_max=0.18, swing=0.15, swing_slope=0.0)
"""A foot stands about half the period at low speed. One end of the robot carries it at a time, and
its thighs hold the trunk level: with a duty of 0.4 some motor gave all it has in 8 % of the ticks,
with swings of 9 cm in 8 % (bound and gallop, 0.4 to 1.2 m/s, seeds 0 to 9)."""

GAITS: dict[str, Gait] = {
    gait.name: gait
    for gait in (
        Gait("trot", 0.36, 0.5, (0.5, 0.0, 0.0, 0.5), Stride()),
        Gait("flying_trot", 0.30, 0.35, (0.5, 0.0, 0.0, 0.5)),
        Gait("walk", 0.60, 0.70, (0.0, 0.5, 0.75, 0.25)),
        Gait("pace", 0.24, 0.45, (0.0, 0.5, 0.0, 0.5), width=0.65),
        Gait("pronk", 0.36, 0.50, (0.0, 0.0, 0.0, 0.0)),
        Gait("bound", 0.31, 0.15 / 0.31, (0.0, 0.0, 0.5, 0.5), BOUNDING, 0.06),
        Gait("gallop", 0.33, 0.18 / 0.33, (0.0, 0.2, 0.5, 0.7), GALLOPING, 0.05),
    )
}
"""The gaits by name. The trot is the one in which the robot starts to walk and comes to rest."""


def find_gait(name: str | Gait) -> Gait:
    """The gait of that name; a gait is itself.

    Raises:
        CommandError: for an unknown name; lists the valid ones.
    """
    if isinstance(name, Gait):
        return name
    if name not in GAITS:
        raise CommandError(unknown_name("gait", name, GAITS))
    return GAITS[name]
