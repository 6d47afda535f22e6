"""What an author wrote, checked: numbers in their units, and words that name something."""

from __future__ import annotations

import math
from collections.abc import Mapping
from enum import Enum
from typing import TypeVar

from go2_wbc.errors import TimelineError, unknown_name
from go2_wbc.legs import Leg
from go2_wbc.validation import LARGEST
from go2_wbc.validation import is_finite_number as is_number

FARTHEST = 1.5
"""A place farther away than this [m] is a mistake in units: a stretched leg is 0.45 m long. What is
merely out of reach is for the check to say."""
QUARTER, HALF = math.pi / 2, math.pi
LARGEST_ANGLES: Mapping[str, float] = {
    **dict.fromkeys(("roll", "pitch", "yaw", "hip"), QUARTER),
    **dict.fromkeys(("thigh", "calf"), HALF),
    "turn": 4.0 * math.pi,
}
"""Angles [rad] beyond which degrees were meant. A hip turns by 48 deg, and the trunk, on its feet,
by less; a calf reaches from -156 to -48 deg, a thigh farther, but none needs more than half a turn.
Who walks may turn twice.
"""

_Meaning = TypeVar("_Meaning", bound=Enum)


def positive(name: str, value: float) -> float:
    """``value`` as a float.

    Raises:
        TimelineError: if it is not a number above 0.
    """
    if not (is_number(value) and 0.0 < value <= LARGEST):
        raise TimelineError(f"{name} must be a number above 0, got {value!r:.80}")
    return float(value)


def quantity(name: str, value: float, farthest: float = FARTHEST) -> float:
    """``value`` as a float: an angle [rad] for the names of angles, else a length [m].

    Raises:
        TimelineError: if it is no finite number, or so large that another unit was meant.
    """
    if not is_number(value):
        raise TimelineError(f"{name} must be a finite number, got {value!r}")
    largest = LARGEST_ANGLES.get(name, farthest)
    if abs(value) > largest and name in LARGEST_ANGLES:
        raise TimelineError(
            f"{name} of {value:g} rad looks like degrees: write deg({value:g}); {value:g} rad is "
            f"{math.degrees(value):.0f} deg, and {name} goes to {math.degrees(largest):.0f} at most"
        )
    if abs(value) > largest:
        raise TimelineError(
            f"{name} is {value:g} m, more than {largest:g} m: in millimetres or centimetres? Write "
            f"{value / 1000:g} or {value / 100:g}"
        )
    return float(value)


def foot(leg: Leg | str) -> Leg:
    """Which leg is meant.

    Raises:
        TimelineError: for an unknown one; lists the valid ones.
    """
    return word("foot", leg, Leg.__members__)


def word(kind: str, value: _Meaning | str, valid: Mapping[str, _Meaning]) -> _Meaning:
    """What the word ``value`` means; a meaning stands for itself.

    Raises:
        TimelineError: for an unknown word; lists the valid ones.
    """
    for name, meaning in valid.items():
        if value is meaning or value == name:
            return meaning
    raise TimelineError(unknown_name(kind, str(value), valid))
