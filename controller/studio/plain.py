"""What the check says, in the words of one who makes motions on the page."""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import replace
from difflib import SequenceMatcher
from functools import partial
from math import degrees
from typing import TYPE_CHECKING

from controller.studio.orders import Order, Task

if TYPE_CHECKING:
    from viz.content import Annotation, MarginCurve, ReplayContent

UNSOLVED = "dynamic plan"  #: The check that is broken where no jump was found
ENDS = "entry and exit"  #: The check of how a motion starts and ends
LAST = "exit"  #: Its subjects at the end begin so
NO_WAY = "no way to do this was found: ask for less"
COARSE = "as it is written: the nearest motion that the robot can do is looked for {when}"
WHEN = {"draft": "when you let go", "meanwhile": "meanwhile", "later": "again with the next edit"}
LOOKED_FOR = "a way to do this is looked for; until then the robot rests here"
NOT_HOME = "it must end at rest on four feet, as it begins. All home at the end does that"

HOME_FIRST = "All home before it does that"  #: What a page offers to put there, by these words
AWAY = {
    "body x": "the trunk is shifted",
    "body y": "the trunk is shifted",
    "body z": "the trunk is higher or lower",
    "body roll": "the trunk leans",
    "body pitch": "the trunk is tilted",
    "body yaw": "the trunk is turned",
    "balance": "the trunk is over three feet",
}
"""What a refusal of the language names that is not at home, in words."""
FEET = {"FL": "front left", "FR": "front right", "RL": "rear left", "RR": "rear right"}
_PLACE = re.compile(r"^(?:\w+ \()?[^\s()]+\.py(?:, line (\d+))?\)?: ")  # where it is refused
_AWAY = re.compile(r"^(.*); away: (.*)$")
_FOOT = re.compile(r"(?:\w+\(\): )?foot (FL|FR|RL|RR) is (.*)$")
_STATES = {
    "not raised": "not up there: raise it before",
    "raised: put it down() before": "still up there: put it down before",
}
_MEASURE = re.compile(r"(-?[\d.]+(?:e-?\d+)?) (m, rad|m|rad), limit (-?[\d.]+(?:e-?\d+)?)")
MIXED = "m, rad"  #: Unit of checks of places and angles
_TURNS = ("attitude", "turning", "joints")  # words of their subjects that are angles
_SHOWN = {"m": (100.0, " cm"), "rad": (degrees(1.0), "\N{DEGREE SIGN}")}


def refusal(error: str, before: bytes, after: bytes) -> str:
    """Why the language refuses a text, in words, with the line of the text that was there before.

    ``after`` is what it would be: its lines are those that ``error`` counts.
    """
    match = _PLACE.match(error)
    if match is None:
        return error
    words, line = error[match.end() :], _line_before(int(match[1] or 0), before, after)
    if away := _AWAY.match(words):
        found = ", ".join(dict.fromkeys(_still(away[2].split(", "))))
        words = f"it starts standing at home, and there {found}. {HOME_FIRST}"
    elif (foot := _FOOT.match(words)) and foot[2] in _STATES:
        words = f"the {FEET[foot[1]]} foot is {_STATES[foot[2]]}"
    return f"{words} (line {line})" if line else words


def _still(away: list[str]) -> Iterator[str]:
    for one in away:
        if one.startswith("foot "):
            yield f"the {FEET[one[-2:]]} foot is up"
        elif one != "balance" or len(away) == 1:
            yield AWAY.get(one, one)


def _line_before(line: int, before: bytes, after: bytes) -> int:
    """Which line of a text it was; 0 for one that was not there."""
    was, now = before.splitlines(), after.splitlines()
    for _, start, end, first, last in SequenceMatcher(None, was, now, False).get_opcodes():
        if first < line <= last:
            return min(start + line - first, end) if end > start else 0
    return 0


def plainly(content: ReplayContent) -> ReplayContent:
    """It with other words where those of the check are of its code or of the solver."""
    if content.verdict is None:
        return content
    found = tuple(replace(one, text=_words(one)) for one in content.verdict.annotations)
    curves = tuple(_as_drawn(curve) for curve in content.verdict.curves)
    return replace(content, verdict=replace(content.verdict, annotations=found, curves=curves))


def coarsely(content: ReplayContent, order: Order) -> ReplayContent:
    """It with the verdict marked as one on what is written, where the nearest is asked for."""
    if content.verdict is None:
        return content
    is_draft, later = order.task is Task.DRAFT, "meanwhile" if order.is_looked_for else "later"
    why = COARSE.format(when=WHEN["draft" if is_draft else later])
    return replace(content, verdict=replace(content.verdict, coarse=why))


def in_words(one: Annotation) -> str:
    """What is broken, where that is not said already."""
    is_plain = one.text in (NO_WAY, LOOKED_FOR, NOT_HOME)
    return one.text if is_plain else f"{one.limit}, {one.subject}: {one.text}"


def is_unsolved(content: ReplayContent) -> bool:
    """Whether some jump was not found."""
    found = content.verdict.annotations if content.verdict is not None else ()
    return any(one.limit == UNSOLVED and one.is_broken for one in found)


def _words(one: Annotation) -> str:
    if one.limit == UNSOLVED:
        return LOOKED_FOR if one.text == LOOKED_FOR else NO_WAY
    if one.limit == ENDS and one.subject.startswith(LAST) and "home()" in one.text:
        return NOT_HOME
    return _MEASURE.sub(partial(_as_read, one.subject), one.text)


def _as_drawn(curve: MarginCurve) -> MarginCurve:
    if curve.unit == MIXED:
        return replace(curve, unit="m or rad")
    if curve.unit not in _SHOWN:
        return curve
    scale, unit = _SHOWN[curve.unit]
    tight = scale * curve.tight
    return replace(curve, unit=unit.strip(), margin=scale * curve.margin, tight=tight)


def _as_read(subject: str, match: re.Match[str]) -> str:
    """A value and its limit in cm or degrees: of a check of both, what the subject has."""
    kind = match[2]
    if kind == MIXED:
        kind = "rad" if any(word in subject for word in _TURNS) else "m"
    scale, unit = _SHOWN[kind]
    value, limit = (f"{scale * float(number):.3g}" for number in (match[1], match[3]))
    return f"{value}{unit}, limit {limit}{unit}"
