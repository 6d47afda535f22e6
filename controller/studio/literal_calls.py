"""The calls that a motion has made, as text: each with the values that it was called with."""

from __future__ import annotations

import json
import math
import re
import textwrap
from collections.abc import Iterator, Mapping, Sequence, Set
from dataclasses import dataclass, fields
from enum import Enum
from numbers import Integral, Real

import numpy as np

from controller.studio.layout import INDENT, LONGEST_LINE
from controller.studio.source import ANGLES, DEGREES, first_parameters
from controller.studio.syntax import Syntax
from go2_wbc.errors import StudioError
from go2_wbc.legs import Leg
from go2_wbc.motion_plan import Posture
from motions import Timeline
from motions.language.timeline_data import TimelineData
from motions.language.tracing import Call, CallMark

SAME = 1e-10  #: Share by which a number may differ from the one that is written for it: rounding
_STATE = frozenset({"name", "keys"})  #: Fields of a timeline that nobody gives it at the start


@dataclass(frozen=True, slots=True)
class Chain:
    """A timeline as it came about."""

    start: TimelineData  #: with nothing in it
    calls: tuple[Call, ...]  #: made on it, one after the other


def chains_of(line: TimelineData) -> Iterator[Chain]:
    """How a traced timeline came about, and those that its calls were given.

    Raises:
        StudioError: if a part of it was made without calls, or before the file ran.
    """
    calls = list[Call]()
    while line.keys:
        last = line.keys[-1]
        if not isinstance(last, CallMark) or last.call.before is None:
            raise StudioError("a part of it was made by no call of the language")
        calls.append(last.call)
        line = last.call.before
    yield Chain(line, tuple(reversed(calls)))
    for call in calls:
        for given in call.arguments.values():
            for one in given if isinstance(given, tuple) else (given,):
                if isinstance(one, TimelineData):
                    yield from chains_of(one)


class Writer:
    """Writes in the names of one file.

    Attributes:
        missing: names that the file has to import, and from where.
    """

    def __init__(self, syntax: Syntax) -> None:
        self._syntax, self.missing = syntax, dict[str, str]()

    def chain(self, head: str, calls: Sequence[Call], left: str) -> str:
        """``calls`` behind ``head``, in a statement that is as far to the right as ``left``.

        Raises:
            StudioError: for a value that cannot be written, such as a function.
        """
        if len(calls) == 1:
            return head + self._call(calls[0], left)
        inner = left + INDENT
        text = self._inner_chain(head, calls, inner)
        return f"(\n{inner}{text}\n{left})" if "\n" in text else text

    def _inner_chain(self, head: str, calls: Sequence[Call], left: str) -> str:
        """The same in brackets that are there."""
        links = [self._call(call, left) for call in calls]
        whole = head + "".join(links)
        return whole if _fits(left, whole) else f"\n{left}".join([head, *links])

    def start(self, line: TimelineData, left: str) -> str:
        """A timeline with nothing in it."""
        given = [
            self.argument(item.name, getattr(line, item.name), left)
            for item in fields(line)
            if item.init and item.name not in _STATE and getattr(line, item.name) != item.default
        ]
        return _laid(f"{self._name(Timeline.__name__)}(", given, ")", left)

    def _name(self, name: str) -> str:
        own = self._syntax.called(name)
        if not own:
            self.missing[name] = "motions"
        return own or name

    def _call(self, call: Call, left: str) -> str:
        return _laid(f".{call.name}(", [*self.arguments(call, left)], ")", left)

    def arguments(self, call: Call, left: str) -> Iterator[str]:
        """Those of a call, each as text."""
        first = first_parameters(call.name)
        for name, value in call.arguments.items():
            if isinstance(value, tuple) and name == "others":
                yield from (self.value(name, one, left + INDENT) for one in value)
            elif name in first:
                yield self.value(name, value, left + INDENT)
            else:
                yield self.argument(name, value, left + INDENT)

    def argument(self, name: str, value: object, left: str) -> str:
        """As it is given by its name."""
        return f"{name}={self.value(name, value, left)}"

    def value(self, name: str, value: object, left: str) -> str:
        """The value of an argument of this name; raises StudioError if it cannot be written."""
        inner = left + INDENT
        match value:
            case TimelineData():
                chain = next(chains_of(value))
                return self._inner_chain(self.start(chain.start, inner), chain.calls, left)
            case Posture():
                return f"{self._name(Posture.__name__)}.{value.name}"
            case Enum():
                return json.dumps(value.name if isinstance(value, Leg) else str(value.value))
            case str():
                return json.dumps(value, ensure_ascii=False)
            case bool() | None | np.bool_():
                return str(value)
            case Integral():
                return str(int(value))
            case Real():
                return self._number(name, float(value))
            case Mapping():
                pairs = value.items()
                items = [f"{self.value('', k, inner)}: {self.value(k, v, inner)}" for k, v in pairs]
                return _laid("{", items, "}", left)
            case Set():
                return _laid(
                    "[", [self.value(name, one, inner) for one in sorted(value)], "]", left
                )
            case Sequence() | np.ndarray():
                return _laid("[", [self.value(name, one, inner) for one in value], "]", left)
        raise StudioError(f"{name} is {value!r:.60}: that cannot be written out")

    def _number(self, name: str, value: float) -> str:
        plain, degrees = _shortest(value), _shortest(math.degrees(value))
        is_plain = name not in ANGLES or not value or len(plain) < len(degrees)
        return plain if is_plain else f"{self._name(DEGREES)}({degrees})"


def _shortest(value: float) -> str:
    """With the fewest decimals that are the same but for rounding."""
    for digits in range(1, 13):
        if math.isclose(short := round(value, digits), value, rel_tol=SAME):
            return repr(short + 0.0)
    return repr(value)


def _fits(left: str, text: str) -> bool:
    return "\n" not in text and len(left) + len(text) <= LONGEST_LINE


def _laid(head: str, parts: Sequence[str], end: str, left: str) -> str:
    """In one line, or each part in its own."""
    if _fits(left, one := f"{head}{', '.join(parts)}{end}"):
        return one
    inner, rows = left + INDENT, [f"{part}," for part in parts]
    if all(re.fullmatch(r"[-\w.]+,", row) for row in rows):  # many numbers
        rows = textwrap.wrap(" ".join(rows), LONGEST_LINE - len(inner))
    return f"{head}\n" + "".join(f"{inner}{row}\n" for row in rows) + f"{left}{end}"
