"""Ranges of the numbers of a frozen ``*Config``, and its retired fields, as class decorators.

    @dataclass(frozen=True, slots=True)
    @retires(tolerance=TOLERANCE)
    @ranged(POSITIVE, share=SHARE, angles=between(-1.0, 1.0))
    class StepConfig:
        height: float = 0.08
        share: float = 0.5
        angles: tuple[float, float] = (0.0, 0.1)

Every number of this class is positive, except for ``share`` and ``angles``; ``tolerance``, now a
constant, may still be given.
"""

from __future__ import annotations

import dataclasses
import math
import re
import warnings
from collections.abc import Callable
from dataclasses import InitVar, dataclass
from numbers import Real
from typing import Any, TypeGuard, TypeVar

from go2_wbc.errors import ConfigError

_Class = TypeVar("_Class", bound=type)
_NUMBERS = re.compile(r"(float|int)$|(Annotated\[)?tuple\[(float|int)\b")
"""Annotations of fields that hold numbers."""


@dataclass(frozen=True, slots=True)
class Rule:
    """What a number must be, beside finite: in words, and as a rule."""

    what: str
    holds: Callable[[float], bool]


LARGEST = 1e9  #: No number of a robot of 15 kg is larger, in SI units: more is a slip of the pen
POSITIVE = Rule("positive", lambda value: value > 0.0)
NOT_NEGATIVE = Rule("at least 0", lambda value: value >= 0.0)
FINITE = Rule("finite", lambda _: True)
SHARE = Rule("above 0 and at most 1", lambda value: 0.0 < value <= 1.0)


def between(low: float, high: float) -> Rule:
    """Numbers in [``low``, ``high``]."""
    return Rule(f"between {low:g} and {high:g}", lambda value: low <= value <= high)


def ranged(rest: Rule | None = None, /, **ranges: Rule) -> Callable[[_Class], _Class]:
    """Let a dataclass refuse numbers out of range; stands below ``@dataclass``.

    Its ``__post_init__``, if it has one, is called with numbers that are in range.

    Args:
        rest: range of every field of numbers that is not named; None to leave them alone.
        ranges: by field; those of an optional one hold unless it is None.
    """

    def decorate(cls: _Class) -> _Class:
        named = {
            name: ranges.get(name, rest)
            for name, kind in vars(cls)["__annotations__"].items()
            if name in ranges or _NUMBERS.match(kind)
        }
        optional = {n for n, kind in vars(cls)["__annotations__"].items() if "| None" in str(kind)}
        further = vars(cls).get("__post_init__")

        def check(self: object, *given: object) -> None:
            for name, rule in named.items():
                if rule and not (name in optional and getattr(self, name) is None):
                    require(self, rule, name)
            if further:
                further(self, *given)

        cls.__post_init__ = check
        return cls

    return decorate


@dataclass(frozen=True, slots=True)
class Retired:
    """What a field was by default, and what there is in its place."""

    value: object
    instead: str


def past_table(table: str, **keys: float) -> object:
    """A retired ``table`` of a file: its keys, and the constants that they are now."""
    kinds = [(name, type(value), value) for name, value in keys.items()]
    return dataclasses.make_dataclass(table, kinds, frozen=True)()


def retires(**names: object) -> Callable[[_Class], _Class]:
    """Let a dataclass, and its table in a file, take what it had of old; next to ``@dataclass``.

    Whoever asks for something else than there was is warned that it has no effect. It is given by
    keyword; an ``InitVar`` of the class keeps its place, and is passed to its ``__post_init__``.

    Args:
        names: what each is now: a number, a ``past_table``, or a ``Retired``.
    """
    table = {
        name: item if isinstance(item, Retired) else Retired(item, f"it is always {item!r}")
        for name, item in names.items()
    }

    def decorate(cls: _Class) -> _Class:
        own = [name for name in cls.__annotations__ if name in table]
        for name in [name for name in table if name not in own]:
            cls.__annotations__[name] = InitVar[Any]
            setattr(cls, name, dataclasses.field(default=table[name].value, kw_only=True))
        order = [name for name in cls.__annotations__ if name in table]
        further = vars(cls).get("__post_init__")

        def check(self: object, *given: object) -> None:
            for name, value in zip(order, given, strict=True):
                if value != table[name].value:  # the caller of the constructor is warned
                    told = f"{type(self).__name__}.{name} has no effect any more"
                    message = f"{told}: {table[name].instead}"
                    warnings.warn(message, FutureWarning, stacklevel=3)
            if further:
                further(self, *given[: len(own)])

        cls.__post_init__ = check
        return cls

    return decorate


def require(config: object, rule: Rule, *names: str) -> None:
    """Raise ConfigError unless each named field of ``config`` keeps to ``rule``."""
    for name in names:
        field = getattr(config, name)
        for value in field if isinstance(field, tuple) else (field,):
            if not (is_finite_number(value) and rule.holds(float(value))):
                raise ConfigError(
                    f"{type(config).__name__}.{name} must be {rule.what}, got {field!r}"
                )
            if abs(value) > LARGEST:
                raise ConfigError(
                    f"{type(config).__name__}.{name} must be {LARGEST:g} at most, got {field!r}"
                )


def is_finite_number(value: object) -> TypeGuard[float]:
    """Whether ``value`` is a number that a float can hold, and finite; True and False are none."""
    if isinstance(value, bool) or not isinstance(value, Real):
        return False
    try:
        return math.isfinite(value)
    except OverflowError:  # an integer beyond every float
        return False
