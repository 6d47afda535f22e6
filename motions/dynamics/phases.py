"""Dynamic motions as phases: what stands when, and where trunk and feet shall be at their ends.

Phases are what a solver is asked, not curves: between their ends everything follows from physics.
All places are offsets from the standing pose at the start of the problem, along its axes (x ahead,
y left, z up): those of the trunk from the base's place and attitude, those of a foot from where it
stood. A later phase counts from the same pose, whatever has moved in between.

Below are builders of jumps, hops, rears and lifts, each from standing to standing at rest.
Their numbers are own choices that solve, and land in simulation; whoever wants others writes the
phases. Durations are whole knots where nothing else decides them.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Collection, Iterable, Mapping
from dataclasses import dataclass, field
from types import MappingProxyType

import numpy as np
from jaxtyping import Float

from go2_wbc.arguments import typed
from go2_wbc.errors import TimelineError
from go2_wbc.legs import LEGS, Leg
from go2_wbc.robot.rotations import yaw_rotation
from motions.arguments import is_number, positive

BODY_COORDINATES = ("x", "y", "z", "roll", "pitch", "yaw")
ALL_FEET = frozenset(LEGS)
GRAVITY = 9.81  #: [m/s^2]
KNOT_PERIOD = 0.02
"""Time [s] between knots, nearly: phases last whole numbers of them. Half of it costs two to four
times the work, and the plans are no better (own experiments)."""
LONGEST_PHASE = 5.0
"""A phase longer than this [s] is no dynamic one, and solving takes as long as the motion: own
choice."""
FARTHEST_FOOT = 4.0
"""Distance [m] from the start beyond which a foot's place is taken for a mistake: own choice, more
than eight of the longest jumps that the robot can do in one problem."""

Progress = Callable[[int, float], None]
"""Called after every iteration of a solver, with their number and the cost."""


@dataclass(frozen=True, slots=True)
class Phase:
    """A span of time in which the same feet stand.

    Attributes:
        duration, stance: [s], and the feet that stand.
        body: x, y, z [m], roll, pitch, yaw [rad] of the trunk at the end, as offsets from where the
            problem starts; ``None`` leaves it free, as in flight.
        feet: of feet that are in the air: where they are at the end [m], relative to where they
            stood when the problem started. A foot that stands in the next phase lands there, so its
            z is 0. A foot in the air that is not named is free until it lands.
        label: what messages call the phase.

    Raises:
        TimelineError: for a duration, place or foot that makes no phase.
    """

    duration: float
    stance: frozenset[Leg] = ALL_FEET
    body: tuple[float, float, float, float, float, float] | None = None
    feet: Mapping[Leg, tuple[float, float, float]] = field(default_factory=dict)
    label: str = ""

    def __post_init__(self) -> None:
        """Check and freeze what was given."""
        stance = frozenset(_leg(leg) for leg in self.stance)
        object.__setattr__(self, "stance", stance)
        feet = {_leg(leg): self._place(leg, place) for leg, place in self.feet.items()}
        object.__setattr__(self, "feet", MappingProxyType(feet))
        if positive(f"{self} duration", self.duration) > LONGEST_PHASE:
            raise TimelineError(
                f"{self} lasts {self.duration:g} s; a dynamic phase lasts at most "
                f"{LONGEST_PHASE:g} s"
            )
        if self.body is not None and not _are_numbers(self.body, len(BODY_COORDINATES)):
            names = ", ".join(BODY_COORDINATES)
            raise TimelineError(f"{self} body must be six numbers ({names}), got {self.body!r}")
        standing = sorted(leg.name for leg in stance & feet.keys())
        if standing:
            raise TimelineError(f"{self}: {', '.join(standing)} cannot stand and move; choose one")

    def __str__(self) -> str:
        return f"phase {self.label!r}" if self.label else "a phase"

    def __hash__(self) -> int:
        """Mapping proxies have none."""
        return hash((self.duration, self.stance, self.body, *sorted(self.feet.items()), self.label))

    def __reduce__(self) -> tuple[object, ...]:
        """Nor can they be pickled."""
        return Phase, (self.duration, self.stance, self.body, dict(self.feet), self.label)

    def _place(self, leg: Leg, place: Iterable[float]) -> tuple[float, float, float]:
        values = tuple(place)
        if not _are_numbers(values, 3):
            raise TimelineError(f"{self}: {leg.name} foot must be x, y, z [m], got {values!r}")
        x, y, z = (float(value) for value in values)
        if z < 0.0:
            raise TimelineError(f"{self}: {leg.name} foot {z:g} m is under the ground; z is >= 0")
        if math.hypot(x, y, z) > FARTHEST_FOOT:
            raise TimelineError(f"{self}: {leg.name} foot is {math.hypot(x, y, z):g} m away")
        return x, y, z


@dataclass(frozen=True, slots=True)
class FullState:
    """Configuration and velocity of the whole robot."""

    q: Float[np.ndarray, "19"]
    """Base position [m], quaternion x y z w, 12 joint angles [rad], in the problem's frame: z up, x
    ahead, its origin on the ground in the middle of the feet at the start."""
    v: Float[np.ndarray, "18"]
    """Base linear [m/s] and angular [rad/s] velocity in the base frame, joints [rad/s]."""


@typed(error=TimelineError)
@dataclass(frozen=True, slots=True)
class Tolerance:
    """How far a plan may be from what was asked before it counts as none."""

    position: float = 0.05  #: [m]
    angle: float = math.radians(8.0)  #: [rad]

    def __post_init__(self) -> None:
        """Raise TimelineError for what is no tolerance."""
        positive("tolerance position", self.position)
        positive("tolerance angle", self.angle)


@dataclass(frozen=True, slots=True)
class PhaseProblem:
    """A dynamic motion to be solved.

    Raises:
        TimelineError: for phases that do not fit each other.
    """

    phases: tuple[Phase, ...]  #: one after the other; the last one stands on four feet
    initial: FullState | None = None  #: where it starts; None is standing at rest
    final: FullState | None = None
    """Where it ends; None is standing at rest over the last places of the feet."""
    tolerance: Tolerance = Tolerance()  #: how far the plan may be from the phases

    def __post_init__(self) -> None:
        """Check that every foot lands where it then stands."""
        object.__setattr__(self, "phases", tuple(self.phases))
        if not self.phases:
            raise TimelineError("a dynamic motion needs at least one phase")
        if self.phases[-1].stance != ALL_FEET:
            raise TimelineError(f"{self.phases[-1]} is the last one: it must stand on four feet")
        for phase, following in zip(self.phases, self.phases[1:], strict=False):
            for leg in sorted(phase.feet.keys() & following.stance):
                if phase.feet[leg][2] != 0.0:
                    raise TimelineError(
                        f"{phase}: {leg.name} lands, but its place is {phase.feet[leg][2]:g} m "
                        "high; give z = 0"
                    )

    @property
    def duration(self) -> float:
        """Length [s]."""
        return sum(phase.duration for phase in self.phases)

    @property
    def shift(self) -> Float[np.ndarray, "4 3"]:
        """Where each foot stands at the end [m], relative to where it stood at the start."""
        return self.foot_shifts[-1]

    @property
    def foot_shifts(self) -> Float[np.ndarray, "n 4 3"]:
        """Where each foot stands or shall be at the end of each phase [m], relative to the start.

        A foot in the air that the phase does not name keeps its last place.
        """
        shifts = np.zeros((len(self.phases), 4, 3))
        last = np.zeros((4, 3))
        for row, phase in enumerate(self.phases):
            for leg, place in phase.feet.items():
                last[leg] = place
            shifts[row] = last
        return shifts


def whole_knots(time: float) -> float:
    """``time`` [s] in whole knots."""
    return max(round(time / KNOT_PERIOD), 1) * KNOT_PERIOD


def _leg(leg: object) -> Leg:
    if not isinstance(leg, Leg):
        raise TimelineError(f"a foot must be one of {', '.join(map(str, LEGS))}, got {leg!r}")
    return leg


def _are_numbers(values: tuple[object, ...], size: int) -> bool:
    return len(values) == size and all(map(is_number, values))


FOOTPRINT = np.array([[0.1934, 0.142], [0.1934, -0.142], [-0.1934, 0.142], [-0.1934, -0.142]])
"""Where the feet stand [m] around their middle, ahead and to the left: below the hips."""
REAR_FEET, FRONT_FEET = frozenset({Leg.RL, Leg.RR}), frozenset({Leg.FL, Leg.FR})
CROUCH, LEAN = -0.06, -0.02  #: Heights of the trunk [m] from which it jumps and rears
GATHER, PUSH, LAND, RECOVER = 0.30, 0.20, 0.20, 0.30
"""Times [s] for crouching, pushing off, taking the landing, and rising to stand."""
LEAN_BACK = 0.40  #: Time [s] in which the weight goes to the rear feet before rearing
PENDULUM_TIME = 0.175
"""sqrt(h / g) [s] of a CoM 0.30 m above its feet, as which a trunk on two feet tips."""
REAR_RISE = 0.03  #: By how much [m] the trunk's middle rises when rearing
FARTHEST = {"x": 1.0, "y": 0.6, "yaw": math.pi, "height": 0.40}
"""Beyond these a jump is refused unsolved [m, rad]; nearer ones may still have no plan."""
LONGEST_FLIGHT = 1.0
"""Time [s] in the air beyond which a jump is refused unsolved: twice that of the highest."""
LOWEST = 0.02  #: Least height [m] of a jump's feet: less is a step
_HERE = (0.0, 0.0, 0.0)
_HOME = (0.0, 0.0, 0.0, 0.0, 0.0, 0.0)


def jump(
    x: float = 0.0,
    y: float = 0.0,
    yaw: float = 0.0,
    height: float = 0.15,
    *,
    flight: float | None = None,
) -> tuple[Phase, ...]:
    """A jump ``x``, ``y`` [m] and ``yaw`` [rad] away, its feet ``height`` [m] high at the top.

    ``flight`` is the time in the air [s], in whole knots, by default what a fall from ``height``
    takes, so the trunk rises by that much; in less, the legs are drawn up for the rest.

    Raises:
        TimelineError: for what no Go2 can jump.
    """
    for name, value in (("x", x), ("y", y), ("height", height)):
        _require(f"a jump's {name}", value, -FARTHEST[name], FARTHEST[name])
    _require_angle("a jump's yaw", yaw, -FARTHEST["yaw"], FARTHEST["yaw"])
    _require("a jump's height", height, LOWEST, FARTHEST["height"])
    half = _half_flight(height)
    if flight is not None:
        _require("a jump's time in the air", flight, 2.0 * KNOT_PERIOD, LONGEST_FLIGHT)
        half = whole_knots(0.5 * flight)
    return (
        Phase(GATHER, body=_at(z=CROUCH), label="crouch"),
        Phase(PUSH, label="push"),
        Phase(half, frozenset(), feet=_moved(0.5, (x, y, yaw), height), label="rise"),
        Phase(half, frozenset(), feet=_moved(1.0, (x, y, yaw), 0.0), label="fall"),
        Phase(LAND, label="land"),
        Phase(RECOVER, body=(x, y, 0.0, 0.0, 0.0, yaw), label="stand"),
    )


def hop(times: int = 3, period: float = 0.5, height: float = 0.05) -> tuple[Phase, ...]:
    """Hops in place, ``height`` [m] high; the feet touch down once a ``period`` [s].

    Raises:
        TimelineError: for no hop, or a period that leaves no time on the ground.
    """
    if isinstance(times, bool) or not isinstance(times, int) or not 1 <= times <= 10:
        raise TimelineError(f"hops must be a whole number from 1 to 10, got {times!r}")
    _require("a hop's height", height, LOWEST, FARTHEST["height"])
    half = _half_flight(height)
    _require("the period of hops", period, 2.0 * half + PUSH, 5.0)
    up, down = (_moved(1.0, _HERE, z) for z in (height, 0.0))
    phases = [Phase(GATHER, body=_at(z=CROUCH), label="crouch")]
    for count in range(1, times + 1):
        ground = PUSH if count == 1 else period - 2.0 * half
        phases += [
            Phase(ground, label=f"push {count}"),
            Phase(half, frozenset(), feet=up, label=f"rise {count}"),
            Phase(half, frozenset(), feet=down, label=f"fall {count}"),
        ]
    return (*phases, Phase(LAND, label="land"), Phase(RECOVER, body=_HOME, label="stand"))


def rear(pitch: float = math.radians(-25.0), hold: float = 0.6) -> tuple[Phase, ...]:
    """Rears up on the rear feet to ``pitch`` [rad], negative is front up, and comes down again.

    The trunk goes up and back like a pendulum on its head, so that it returns by itself: the longer
    the front feet are to be off the ground (``hold`` [s]), the nearer it comes to above the rear
    feet.

    Raises:
        TimelineError: for a pitch or time that the robot cannot do.
    """
    _require_angle("the pitch of rearing", pitch, math.radians(-60.0), math.radians(-5.0))
    _require("the time of rearing", hold, 0.2, 1.0)
    half = whole_knots(0.5 * hold)
    back = float(FOOTPRINT[Leg.RL, 0]) * (1.0 - 1.0 / math.cosh(half / PENDULUM_TIME))
    return (
        Phase(LEAN_BACK, body=_at(z=LEAN), label="lean"),
        Phase(PUSH, label="push"),
        Phase(half, REAR_FEET, body=(back, 0.0, REAR_RISE, 0.0, pitch, 0.0), label="rear up"),
        Phase(half, REAR_FEET, feet=dict.fromkeys(FRONT_FEET, _HERE), label="come down"),
        Phase(LAND, label="land"),
        Phase(RECOVER, body=_HOME, label="stand"),
    )


def lift(
    legs: Collection[Leg] = (Leg.FL, Leg.RR), hold: float = 0.35, height: float = 0.06
) -> tuple[Phase, ...]:
    """Lifts one foot or two ``height`` [m] for ``hold`` seconds, puts them where they stood.

    Raises:
        TimelineError: for more legs, or a time or height that the robot cannot do.
    """
    if not 1 <= len(set(legs)) <= 2:
        raise TimelineError(f"lift one or two legs, got {len(set(legs))}; with all four, jump")
    _require("the time of lifting", hold, 0.1, 1.0)
    _require("the height of lifting", height, LOWEST, 0.15)
    stance, half = ALL_FEET - frozenset(legs), 0.5 * hold
    up: Mapping[Leg, tuple[float, float, float]] = dict.fromkeys(legs, (0.0, 0.0, height))
    return (
        Phase(LEAN_BACK, label="shift"),
        Phase(half, stance, feet=up, label="lift"),
        Phase(half, stance, feet=dict.fromkeys(legs, _HERE), label="lower"),
        Phase(LAND, label="land"),
        Phase(RECOVER, body=_HOME, label="stand"),
    )


def _at(z: float) -> tuple[float, float, float, float, float, float]:
    return 0.0, 0.0, z, 0.0, 0.0, 0.0


def _half_flight(height: float) -> float:
    """Time [s] to fall from ``height``, in whole knots."""
    return whole_knots(math.sqrt(2.0 * height / GRAVITY))


def _moved(
    share: float, way: tuple[float, float, float], z: float
) -> dict[Leg, tuple[float, float, float]]:
    """Shifts of the feet after ``share`` of the way x, y [m], yaw [rad], at height ``z``."""
    x, y, yaw = (share * part for part in way)
    moved = FOOTPRINT @ yaw_rotation(yaw)[:2, :2].T - FOOTPRINT + [x, y]
    return {leg: (float(moved[leg, 0]), float(moved[leg, 1]), z) for leg in LEGS}


def _require_angle(what: str, angle: float, least: float, greatest: float) -> None:
    """As ``_require``, with what may have been meant: degrees, or the other sign."""
    if is_number(angle) and not least <= angle <= greatest:
        degrees = math.radians(angle)
        meant = {f"deg({angle:g})": degrees, f"{-angle:g}": -angle, f"-deg({angle:g})": -degrees}
        for text, value in meant.items():
            if least <= value <= greatest:
                raise TimelineError(
                    f"{what} must be from {least:.3g} to {greatest:.3g} rad, got {angle!r}: did "
                    f"you mean {text}?"
                )
    _require(what, angle, least, greatest)


def _require(what: str, value: float, least: float, greatest: float) -> None:
    if not (is_number(value) and least <= value <= greatest):
        raise TimelineError(f"{what} must be from {least:.3g} to {greatest:.3g}, got {value!r}")
