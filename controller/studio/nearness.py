"""The nearest motion that the robot can do, beside the author's, and the edit that asks for it."""

from __future__ import annotations

import ast
import re
from collections.abc import Callable, Iterator, Sequence
from contextlib import suppress

import numpy as np

from controller.report_view import planned, verdict_of
from controller.studio.rewriting import changed, imported, motion_in
from controller.studio.source import Source
from go2_wbc.errors import Go2WbcError, StudioError
from motions import CheckedMotion
from motions.feasibility.goal_errors import Departure
from motions.language.timeline_data import NEAREST
from viz.content import ReplayContent

ARGUMENT = f'physics="{NEAREST}"'
NO_PLAN = "nearest motion"  #: The check that is broken where none was found
COPY = "replace"  #: What makes another timeline of one, of the standard library


def asking(source: Source, motion: str, does_ask: Callable[[Source], bool]) -> Source:
    """The text in which a motion asks for the nearest that the robot can do.

    Args:
        source: the text.
        motion: the name of the motion.
        does_ask: runs a text, and says whether its motion asks for that.

    Raises:
        StudioError: if none of the ways to write it does.
    """
    for after in _ways(source, motion):
        with suppress(Go2WbcError):
            if does_ask(after):
                return after
    raise StudioError(f"write Timeline({ARGUMENT}) by hand where {motion} begins")


def _ways(source: Source, motion: str) -> Iterator[Source]:
    """In each ``Timeline()`` of the motion alone; else in a copy of what it returns."""
    syntax = source.syntax
    function = motion_in(syntax, motion)
    for node in ast.walk(function):
        if isinstance(node, ast.Call) and syntax.name(node) == "Timeline":
            yield _asked(source, node)
    returns = [one.value for one in ast.walk(function) if isinstance(one, ast.Return) and one.value]
    spans = [syntax.span(one) for one in returns]
    texts = [f"{COPY}({syntax.text(span)}, {ARGUMENT})" for span in spans]
    if spans:
        wrapped = changed(source, list(zip(spans, texts, strict=True)))
        with suppress(StudioError):  # a file that imports nothing
            yield imported(wrapped, {COPY: "dataclasses"})


def _asked(source: Source, call: ast.Call) -> Source:
    syntax = source.syntax
    for word in call.keywords:
        if word.arg == "physics":
            return source.replaced(syntax.span(word.value), ARGUMENT.partition("=")[2])
    end = syntax.span(call)[1] - 1
    given = [*call.args, *(word.value for word in call.keywords)]
    if not given:
        return source.replaced((end, end), ARGUMENT)
    last = max(syntax.span(node)[1] for node in given)
    own = re.compile(rb"(\s*\))*").match(source.data, last, end)  # brackets round the last one
    last = own.end() if own else last
    return source.replaced((last, last), f", {ARGUMENT}")


def beside(own: CheckedMotion, near: CheckedMotion) -> tuple[ReplayContent, str]:
    """One's own motion with the nearest as its ghost, and how far that is from it, in words.

    Raises:
        StudioError: if the robot cannot do the nearest that was found either: says why.
    """
    if near.report.failures:
        first = near.report.failures[0]
        if first.check == NO_PLAN:
            raise StudioError(f"no motion near to yours was found, from {first.time:.2f} s on")
        told = f"{first.check}, {first.subject} at {first.time:.2f} s"
        raise StudioError(f"the nearest motion that was found still breaks a limit: {told}")
    shown = planned(own)
    content = ReplayContent(
        shown.recording,
        is_plan=True,
        verdict=shown.verdict,
        ghost=near.recording(),
        proposal=verdict_of(near.report),
        beats=shown.beats,
        end_pose=shown.end_pose,
    )
    return content, distance(near.report.departures)


def distance(found: Sequence[Departure]) -> str:
    """How far all parts are at most from what was written, in words: mm, degrees, seconds."""
    if not found:
        return "as yours"
    far, turned = max(found, key=lambda one: one.place), max(found, key=lambda one: one.angle)
    late = max((one.lag for one in found), key=abs)
    parts = [f"{one.start:.2f} to {one.end:.2f} s" for one in found]
    place = f"{1e3 * far.place:.0f} mm ({far.subject} at {far.place_time:.2f} s)"
    angle = f"{np.degrees(turned.angle):.1f}° (trunk at {turned.angle_time:.2f} s)"
    lag = f"{abs(late):.3f} s {'late' if late > 0.0 else 'early'}" if late else "in time"
    where = " and from ".join(parts)
    foot = max(found, key=lambda one: one.foot_place).farther_foot
    place = f"{foot}, {place}" if foot else place
    return f"at most {place} and {angle} from yours, and {lag}; it differs from {where}"
