"""Smooth functions of time, each with its own first and second derivative.

A curve is evaluated anywhere; outside [0, duration] it holds its end values with zero rate.
Minimum jerk (Flash & Hogan 1985) is the default for motions of the body: it starts and ends at rest
with zero acceleration. ``keyframes`` chains such pieces.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from enum import Enum

import numpy as np
from jaxtyping import Float

from go2_wbc.errors import CommandError


@dataclass(frozen=True, slots=True)
class CurvePoint:
    """Value of a curve with its first and second time derivative, each (n,)."""

    value: Float[np.ndarray, " n"]
    rate: Float[np.ndarray, " n"]
    acceleration: Float[np.ndarray, " n"]


class Ease(Enum):
    """How a piece goes from its start to its end: progress over normalised time s in [0, 1].

    Minimum jerk, cubic and linear are symmetric. ``IN`` starts at rest and ends at twice its mean
    speed without acceleration, ``OUT`` is the same backwards; so one after the other over the same
    time and way, or with a linear piece of twice that speed between them, they are smooth. ``HOLD``
    stays at the start and jumps at its end.
    """

    MINIMUM_JERK = "minimum_jerk"
    CUBIC = "cubic"
    LINEAR = "linear"
    IN = "in"
    OUT = "out"
    HOLD = "hold"

    def progress(self, s: float) -> tuple[float, float, float]:
        """Progress in [0, 1] at s in [0, 1], with d/ds and d2/ds2."""
        match self:
            case Ease.MINIMUM_JERK:  # least integral of jerk^2 from rest to rest
                value = s**3 * (10 - 15 * s + 6 * s * s)
                return value, 30 * s * s * (1 - s) ** 2, 60 * s * (1 - s) * (1 - 2 * s)
            case Ease.CUBIC:  # Hermite's: least integral of acceleration^2 from rest to rest
                return s * s * (3 - 2 * s), 6 * s * (1 - s), 6 - 12 * s
            case Ease.LINEAR:
                return s, 1.0, 0.0
            case Ease.IN:  # from rest, with the acceleration 0 at both ends
                return s**3 * (2 - s), s * s * (6 - 4 * s), 12 * s * (1 - s)
            case Ease.OUT:  # 1 - in(1 - s), so the acceleration alone changes its sign
                value, rate, acceleration = Ease.IN.progress(1 - s)
                return 1 - value, rate, -acceleration
            case Ease.HOLD:
                return (0.0 if s < 1.0 else 1.0), 0.0, 0.0


@dataclass(frozen=True, slots=True)
class Segment:
    """One eased piece from ``start`` to ``end``, both (n,), in ``duration`` seconds (> 0)."""

    start: Float[np.ndarray, " n"]
    end: Float[np.ndarray, " n"]
    duration: float
    ease: Ease = Ease.MINIMUM_JERK

    def __post_init__(self) -> None:
        """Raise CommandError on a duration that is not positive."""
        if not self.duration > 0.0:
            raise CommandError(f"a curve's duration must be > 0 s, got {self.duration}")

    def at(self, t: float) -> CurvePoint:
        """The curve at ``t`` seconds after its start."""
        if t <= 0.0:
            return _at_rest(self.start)
        if t >= self.duration:
            return _at_rest(self.end)
        # with s = t / T: dx/dt = (dx/ds) / T, d2x/dt2 = (d2x/ds2) / T^2
        value, rate, acceleration = self.ease.progress(t / self.duration)
        delta = self.end - self.start
        return CurvePoint(
            self.start + value * delta,
            rate / self.duration * delta,
            acceleration / self.duration**2 * delta,
        )


@dataclass(frozen=True, slots=True)
class Curve:
    """Segments one after another; holds its ends outside [0, duration]."""

    segments: tuple[Segment, ...]
    starts: tuple[float, ...]

    @property
    def duration(self) -> float:
        """Seconds from the first start to the last end."""
        return self.starts[-1] + self.segments[-1].duration

    def at(self, t: float) -> CurvePoint:
        """The curve at ``t`` seconds; at a joint of two segments the later one counts."""
        index = int(np.searchsorted(self.starts, t, side="right")) - 1
        index = max(index, 0)
        return self.segments[index].at(t - self.starts[index])


def keyframes(
    times: Sequence[float],
    values: Sequence[Float[np.ndarray, " n"]],
    ease: Ease = Ease.MINIMUM_JERK,
) -> Curve:
    """A curve that passes through each value (n,) at its time [s] after the first key's.

    It comes to rest at every key with minimum jerk and cubic easing.

    Raises:
        CommandError: if there are fewer than two keys, or the times do not increase.
    """
    if len(times) < 2 or len(times) != len(values):
        raise CommandError(
            "keyframes need two or more times and as many values, "
            f"got {len(times)} times and {len(values)} values"
        )
    segments = tuple(
        Segment(np.asarray(a, float), np.asarray(b, float), t1 - t0, ease)
        for a, b, t0, t1 in zip(values[:-1], values[1:], times[:-1], times[1:], strict=True)
    )
    return Curve(segments, tuple(t - times[0] for t in times[:-1]))


def _at_rest(value: Float[np.ndarray, " n"]) -> CurvePoint:
    zero = np.zeros_like(value)
    return CurvePoint(value, zero, zero)
