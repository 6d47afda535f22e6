"""What a timeline is made of: keys, each a goal for one track in a span of time, and its easing."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, fields, replace
from enum import Enum
from typing import Any, ClassVar, Self

import numpy as np
from jaxtyping import Float

from go2_wbc.curves import Ease
from go2_wbc.errors import TimelineError
from go2_wbc.legs import Leg
from go2_wbc.motion_plan import Posture
from motions.arguments import is_number, word
from motions.dynamics.phases import ALL_FEET, Phase, PhaseProblem, whole_knots

NEAR = 1e-6  #: How far an own easing may be from 0 at its start and from 1 at its end
_EASES = {ease.value: ease for ease in Ease}
_TRIED = np.linspace(0.0, 1.0, 101).tolist()


@dataclass(frozen=True, slots=True)
class OwnEase:
    """Progress by an author's own function."""

    function: Callable[[float], float]
    """From the share of time that has passed, 0 to 1, to the share of the way."""
    is_reversed: bool = False  #: whether it is gone through backwards: 1 - f(1 - s)

    def progress(self, s: float) -> tuple[float, float, float]:
        """As ``Ease.progress``; the derivatives are not known and count as 0."""
        value = 1.0 - self.function(1.0 - s) if self.is_reversed else self.function(s)
        return float(value), 0.0, 0.0

    def ways(self, s: Float[np.ndarray, " n"]) -> Float[np.ndarray, " n"]:
        """As ``Ease.ways``."""
        return np.array([self.progress(value)[0] for value in s.tolist()])


Easing = Ease | OwnEase  #: Checked ways to go
EaseWord = Ease | OwnEase | str | Callable[[float], float]  #: What an author may write for one
_REVERSED: dict[Ease, Ease] = {Ease.IN: Ease.OUT, Ease.OUT: Ease.IN}


def easing(ease: EaseWord) -> Easing:
    """What ``ease`` means: a name, one of ``Ease``, or a function from [0, 1] to the share of way.

    Raises:
        TimelineError: for an unknown name, or a function that does not lead from 0 to 1.
    """
    if isinstance(ease, OwnEase):
        return ease
    if isinstance(ease, Ease | str):
        return word("ease", ease, _EASES)
    if not callable(ease):
        raise TimelineError(f"ease must be a name or a function of the share of time, got {ease!r}")
    for s in _TRIED:
        try:
            value = ease(s)
        except ArithmeticError as error:
            raise TimelineError(f"ease fails at {s:g}: {type(error).__name__}: {error}") from error
        if not is_number(value):
            raise TimelineError(f"ease must give a finite number, gave {value!r} at {s:g}")
    if abs(ease(0.0)) > NEAR or abs(ease(1.0) - 1.0) > NEAR:
        raise TimelineError(
            f"ease must lead from 0 at 0 to 1 at 1, got {ease(0.0):g} and {ease(1.0):g}"
        )
    return OwnEase(ease)


def backwards(ease: Easing) -> Easing:
    """The easing of the same move backwards in time.

    Raises:
        TimelineError: for ``hold``, which jumps at its end.
    """
    if isinstance(ease, OwnEase):
        return OwnEase(ease.function, not ease.is_reversed)
    if ease is Ease.HOLD:
        raise TimelineError("reverse() does not work with ease 'hold', which jumps at its end")
    return _REVERSED.get(ease, ease)


BODY_CHANNELS = ("x", "y", "z", "roll", "pitch", "yaw")
"""What of the trunk can move: places [m] and angles [rad], as offsets from the posture."""
_FLIPPED = frozenset({"y", "roll", "yaw"})


class Frame(Enum):
    """What a leg's goal is given in."""

    GROUND = "ground"
    BODY = "body"
    JOINTS = "joints"


@dataclass(frozen=True, slots=True)
class LegTarget:
    """Where a leg goes."""

    frame: Frame  #: what ``values`` mean
    values: tuple[float, float, float]
    """Offset x, y, z [m] of the foot from where it stands, fixed to the ground or to the trunk; or
    hip, thigh and calf angle [rad]."""

    @property
    def is_on_ground(self) -> bool:
        """Whether the foot stands on the ground, where it stood."""
        return self == ON_GROUND

    @property
    def mirrored(self) -> LegTarget:
        """The same goal of the leg across."""
        first, second, third = self.values
        is_angle = self.frame is Frame.JOINTS
        values = (-first, second, third) if is_angle else (first, -second, third)
        return replace(self, values=values)

    def scaled(self, amplitude: float) -> LegTarget:
        """Its offset multiplied; angles stay."""
        if self.frame is Frame.JOINTS:
            return self
        x, y, z = self.values
        return replace(self, values=(amplitude * x, amplitude * y, amplitude * z))


ON_GROUND = LegTarget(Frame.GROUND, (0.0, 0.0, 0.0))  #: The foot where it stands


@dataclass(frozen=True, slots=True)
class Key:
    """One move of one track."""

    instants: ClassVar[tuple[str, ...]] = ("start", "end")
    moves: ClassVar[str]  #: What moves, in words

    start: float  #: when [s]
    end: float  #: when [s]
    ease: Easing  #: how it goes from the last goal to this one

    @property
    def track(self) -> str:
        """What moves: keys of one track follow each other."""
        return self.moves.format(self)

    def later(self, seconds: float) -> Self:
        """The same key, moved in time."""
        return self._moved(lambda t: t + seconds)

    def slower(self, factor: float) -> Self:
        """The same key, all times multiplied."""
        return self._moved(lambda t: factor * t)

    def retimed(self, when: Callable[[float], float]) -> Self:
        """The same key, its instants where ``when`` puts them."""
        return self._moved(when)

    def _moved(self, when: Callable[[float], float]) -> Self:
        return replace(self, **{name: when(getattr(self, name)) for name in self.instants})

    @property
    def mirrored(self) -> Self:
        """Left and right exchanged."""
        across: dict[str, Any] = {f.name: _across(getattr(self, f.name)) for f in fields(self)}
        return replace(self, **across)

    def scaled(self, amplitude: float) -> Self:
        """Its offsets multiplied; what is no offset stays."""
        del amplitude
        return self


@dataclass(frozen=True, slots=True)
class BodyKey(Key):
    """The trunk moves along one channel to an offset [m or rad]."""

    moves: ClassVar[str] = "body {0.channel}"

    channel: str
    value: float

    @property
    def mirrored(self) -> Self:
        """Left and right exchanged."""
        return self.scaled(-1.0) if self.channel in _FLIPPED else self

    def scaled(self, amplitude: float) -> Self:
        """Its offset multiplied."""
        return replace(self, value=amplitude * self.value)

    def moved(self, offset: float) -> Self:
        """Its goal ``offset`` farther."""
        return replace(self, value=self.value + offset)


@dataclass(frozen=True, slots=True)
class BodyPathKey(BodyKey):
    """The trunk moves along one channel through several offsets [m or rad], without a stop."""

    through: tuple[float, ...]  #: offsets on the way to ``value``
    shares: tuple[float, ...]  #: shares of the time, between 0 and 1, at which they are passed

    def scaled(self, amplitude: float) -> Self:
        """Its offsets multiplied."""
        through = tuple(amplitude * value for value in self.through)
        return replace(self, value=amplitude * self.value, through=through)

    def moved(self, offset: float) -> Self:
        """All that it goes through ``offset`` farther."""
        through = tuple(value + offset for value in self.through)
        return replace(self, value=self.value + offset, through=through)


@dataclass(frozen=True, slots=True)
class PostureKey(Key):
    """The trunk moves to another resting posture, from which offsets count from then on."""

    moves: ClassVar[str] = "posture"

    posture: Posture


@dataclass(frozen=True, slots=True)
class LegKey(Key):
    """A leg moves to a target."""

    moves: ClassVar[str] = "foot {0.leg.name}"

    leg: Leg
    target: LegTarget

    def scaled(self, amplitude: float) -> Self:
        """Its offset multiplied; angles stay."""
        return replace(self, target=self.target.scaled(amplitude))


@dataclass(frozen=True, slots=True)
class JointKey(LegKey):
    """One joint of a leg moves to its angle in ``target``; the others stay as they are."""

    joint: int  #: which of the three


@dataclass(frozen=True, slots=True)
class StepKey(Key):
    """A foot swings to a new place and stands there."""

    instants: ClassVar[tuple[str, ...]] = ("start", "end", "since")
    moves: ClassVar[str] = "foot {0.leg.name}"

    leg: Leg  #: whose foot
    place: tuple[float, float, float]
    """x, y [m] and yaw [rad], in the frame of the four feet, its origin in their middle, x along
    their heading. Of a single step, the way of the foot, after the frame has turned by yaw with the
    foot on it; of a square one, the pose of the frame in which the foot then stands below its
    hip."""
    height: float  #: of the foot [m] above its way, at most
    since: float
    """Instant [s] whose frame of the feet it is; a foot in the air counts where it lands."""
    lead: float = 0.0  #: the trunk follows from so long [s] before the swing until so long after it
    is_square: bool = False  #: whether ``place`` is the pose of a frame

    def slower(self, factor: float) -> Self:
        """The same key, all times multiplied."""
        return replace(self._moved(lambda t: factor * t), lead=factor * self.lead)

    def scaled(self, amplitude: float) -> Self:
        """Its way multiplied."""
        x, y, yaw = self.place
        return replace(self, place=(amplitude * x, amplitude * y, amplitude * yaw))

    @property
    def mirrored(self) -> Self:
        """Left and right exchanged."""
        x, y, yaw = self.place
        return replace(self, leg=self.leg.mirror, place=(x, -y, -yaw))


@dataclass(frozen=True, slots=True)
class Mark(Key):
    """A named span of time: something is worth looking at."""

    moves: ClassVar[str] = "span {0.name!r}"

    name: str


@dataclass(frozen=True, slots=True)
class FootHold(Mark):
    """A named span in which a raised foot is held up: only then does the motion count as done."""

    leg: Leg


@dataclass(frozen=True, slots=True)
class BalanceShift(Key):
    """The trunk moves over the feet that stay when ``raised`` legs are in the air."""

    moves: ClassVar[str] = "balance"

    raised: frozenset[Leg]  #: these legs
    is_swaying: bool = False
    """Whether it is instead over those of the feet that stand while others step."""


@dataclass(frozen=True, slots=True)
class PhaseKey(Key):
    """The whole robot goes through phases, from standing at home to standing at home."""

    moves: ClassVar[str] = "the whole robot"

    phases: tuple[Phase, ...]  #: one after the other; together they last from ``start`` to ``end``
    is_open: bool  #: whether ``Timeline.phase`` may still add one

    @property
    def shift(self) -> Float[np.ndarray, "4 3"]:
        """Where each foot comes to stand [m], in the frame of the feet at the start."""
        return PhaseProblem(self.phases).shift

    def smaller(self, share: float) -> Self:
        """``share`` as high, as far and as steep, its flights as long as that takes; turns stay."""
        phases = tuple(_smaller(phase, share) for phase in self.phases)
        return replace(self, phases=phases, end=self.start + sum(p.duration for p in phases))

    def slower(self, factor: float) -> Self:
        """Gravity does not wait."""
        raise TimelineError(
            f"scale_time({factor:g}) does not work with a dynamic block, whose pace gravity sets; "
            "give its calls other numbers"
        )

    def retimed(self, when: Callable[[float], float]) -> Self:
        """The same block, started when ``when`` says; it lasts what it lasts."""
        return self.later(when(self.start) - self.start)

    def scaled(self, amplitude: float) -> Self:
        """Nor do heights scale without times."""
        raise TimelineError(
            f"scale({amplitude:g}) does not work with a dynamic block, whose heights and times go "
            "together; give its calls other numbers"
        )


def _smaller(phase: Phase, share: float) -> Phase:
    scaled = 2 if phase.stance == ALL_FEET else 5  # a crouch stays as deep
    body = phase.body and (
        *(share * part for part in phase.body[:scaled]), *phase.body[scaled:]
    )  # fmt: skip
    feet, less = phase.feet, 1.0 - share
    x, y = (sum(place[axis] for place in feet.values()) / max(len(feet), 1) for axis in (0, 1))
    moved = {leg: (a - less * x, b - less * y, share * c) for leg, (a, b, c) in feet.items()}
    fall = phase.duration if phase.stance else whole_knots(math.sqrt(share) * phase.duration)
    return replace(phase, duration=fall, body=body, feet=moved)


def _across(value: object) -> object:
    """``value``, of a field of a key, with left and right exchanged; what has no side stays."""
    if isinstance(value, Leg):
        return value.mirror
    if isinstance(value, LegTarget):
        return value.mirrored
    if isinstance(value, Phase):
        return _mirrored(value)
    if isinstance(value, tuple | frozenset):
        return type(value)(map(_across, value))
    return value


def _mirrored(phase: Phase) -> Phase:
    body = phase.body
    if body is not None:
        x, y, z, roll, pitch, yaw = body
        body = (x, -y, z, -roll, pitch, -yaw)
    feet = {leg.mirror: (x, -y, z) for leg, (x, y, z) in phase.feet.items()}
    stance = frozenset(leg.mirror for leg in phase.stance)
    return replace(phase, stance=stance, body=body, feet=feet)
