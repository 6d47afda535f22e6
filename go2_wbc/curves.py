"""Smooth functions of time, each with its own first and second derivative.

Outside [0, duration] a curve holds its end values with zero rate. Minimum jerk (Flash & Hogan 1985)
is the default for motions of the body: it starts and ends at rest with zero acceleration.
"""

from __future__ import annotations

from bisect import bisect_right
from collections.abc import Sequence
from dataclasses import dataclass
from enum import Enum
from typing import NamedTuple

import numpy as np
from jaxtyping import Float

from go2_wbc.errors import CommandError


class CurvePoint(NamedTuple):
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

    def ways(self, s: Float[np.ndarray, " n"]) -> Float[np.ndarray, " n"]:
        """Progress at many s."""
        if self is Ease.HOLD:
            return np.where(s < 1.0, 0.0, 1.0)
        return self.progress(s)[0]  # type: ignore[return-value, arg-type]  # all of them polynomials


@dataclass(frozen=True, slots=True)
class Curve:
    """An eased way from each key to the next; comes to rest at each with minimum jerk and cubic.

    Raises:
        CommandError: if there are fewer than two keys, or the times do not increase.
    """

    times: Sequence[float]
    """Of the keys [s], increasing; those of the curve count from the first one."""
    values: Sequence[Float[np.ndarray, " n"]]  #: what it passes through, each (n,)
    ease: Ease = Ease.MINIMUM_JERK  #: of every piece

    def __post_init__(self) -> None:
        """Raise CommandError for keys without a way between them."""
        count, values = len(self.times), len(self.values)
        if count < 2 or count != values:
            raise CommandError(
                "a curve needs two or more times and as many values, "
                f"got {count} times and {values} values"
            )
        for duration in np.diff(self.times).tolist():
            if not duration > 0.0:
                raise CommandError(f"a curve's duration must be > 0 s, got {duration}")

    @property
    def duration(self) -> float:
        """Seconds from the first key to the last."""
        return self.times[-1] - self.times[0]

    def at(self, t: float) -> CurvePoint:
        """The curve ``t`` seconds after its first key."""
        starts = [time - self.times[0] for time in self.times[:-1]]
        piece = max(bisect_right(starts, t) - 1, 0)
        start, end = self.values[piece], self.values[piece + 1]
        t, duration = t - starts[piece], self.times[piece + 1] - self.times[piece]
        if t <= 0.0 or t >= duration:
            zero = np.zeros_like(start)
            return CurvePoint(start if t <= 0.0 else end, zero, zero)
        # with s = t / T: dx/dt = (dx/ds) / T, d2x/dt2 = (d2x/ds2) / T^2
        value, rate, acceleration = self.ease.progress(t / duration)
        delta = end - start
        return CurvePoint(
            start + value * delta, rate / duration * delta, acceleration / duration**2 * delta
        )
