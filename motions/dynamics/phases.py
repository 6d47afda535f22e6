"""Dynamic motions as phases: what stands when, and where trunk and feet shall be at their ends.

Phases are what a solver is asked, not curves: between their ends everything follows from physics.
All places are offsets from the standing pose at the start of the problem, along its axes (x ahead,
y left, z up): those of the trunk from the base's place and attitude, those of a foot from where it
stood. A later phase counts from the same pose, whatever has moved in between.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, field
from types import MappingProxyType

import numpy as np
from jaxtyping import Float

from go2_wbc.arguments import typed
from go2_wbc.errors import TimelineError
from go2_wbc.legs import LEGS, Leg
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
        duration: [s].
        stance: the feet that stand.
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
    """Configuration and velocity of the whole robot.

    Attributes:
        q: base position [m], quaternion x y z w, 12 joint angles [rad], in the problem's frame: z
            up, x ahead, its origin on the ground in the middle of the feet at the start.
        v: base linear [m/s] and angular [rad/s] velocity in the base frame, joints [rad/s].
    """

    q: Float[np.ndarray, "19"]
    v: Float[np.ndarray, "18"]


@typed(error=TimelineError)
@dataclass(frozen=True, slots=True)
class Tolerance:
    """How far a plan may be from what was asked before it counts as none.

    Attributes:
        position: [m]; 50 mm unless said otherwise.
        angle: [rad]; 8 deg unless said otherwise.
    """

    position: float = 0.05
    angle: float = math.radians(8.0)

    def __post_init__(self) -> None:
        """Raise TimelineError for what is no tolerance."""
        positive("tolerance position", self.position)
        positive("tolerance angle", self.angle)


@dataclass(frozen=True, slots=True)
class PhaseProblem:
    """A dynamic motion to be solved.

    Attributes:
        phases: one after the other; the last one stands on four feet.
        initial: where it starts; ``None`` is standing at rest.
        final: where it ends; ``None`` is standing at rest over the last places of the feet.
        tolerance: how far the plan may be from the phases.

    Raises:
        TimelineError: for phases that do not fit each other.
    """

    phases: tuple[Phase, ...]
    initial: FullState | None = None
    final: FullState | None = None
    tolerance: Tolerance = Tolerance()

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
