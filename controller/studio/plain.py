"""What the check says, in the words of one who makes motions on the page."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

from controller.studio.orders import Order, Task

if TYPE_CHECKING:
    from viz.content import Annotation, ReplayContent

UNSOLVED = "dynamic plan"  #: The check that is broken where no jump was found
ENDS = "entry and exit"  #: The check of how a motion starts and ends
LAST = "exit"  #: Its subjects at the end begin so
NO_WAY = "no way to do this was found: ask for less"
COARSE = "as it is written: the nearest motion that the robot can do is looked for {when}"
WHEN = {"draft": "when you let go", "meanwhile": "meanwhile", "later": "again with the next edit"}
LOOKED_FOR = "a way to do this is looked for; until then the robot rests here"
NOT_HOME = "it must end at rest on four feet, as it begins. All home at the end does that"


def plainly(content: ReplayContent) -> ReplayContent:
    """It with other words where those of the check are of its code or of the solver."""
    if content.verdict is None:
        return content
    found = tuple(replace(one, text=_words(one)) for one in content.verdict.annotations)
    return replace(content, verdict=replace(content.verdict, annotations=found))


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
    if one.limit == ENDS and one.subject.startswith(LAST) and one.text.endswith("home()"):
        return NOT_HOME
    return one.text
