"""How a move goes from its start to its end: the named ways, and an author's own."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from go2_wbc.curves import Ease
from go2_wbc.errors import TimelineError
from motions.arguments import is_number, word

NEAR = 1e-6
"""How far an own easing may be from 0 at its start and from 1 at its end."""
_EASES = {ease.value: ease for ease in Ease}
_TRIED = np.linspace(0.0, 1.0, 101).tolist()


@dataclass(frozen=True, slots=True)
class OwnEase:
    """Progress by an author's own function.

    Attributes:
        function: from the share of time that has passed, 0 to 1, to the share of the way.
        is_reversed: whether it is gone through backwards: 1 - f(1 - s).
    """

    function: Callable[[float], float]
    is_reversed: bool = False

    def progress(self, s: float) -> tuple[float, float, float]:
        """As ``Ease.progress``; the derivatives are not known and count as 0."""
        value = 1.0 - self.function(1.0 - s) if self.is_reversed else self.function(s)
        return float(value), 0.0, 0.0


Easing = Ease | OwnEase
"""Checked ways to go."""
EaseWord = Ease | OwnEase | str | Callable[[float], float]
"""What an author may write for one."""
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
