"""A call made two that play as long: the first goes as far as the way is then, the second the rest.

Each starts and stops as the one did, so the robot rests for an instant between them.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from controller.studio.literals import Run
from controller.studio.orders import Cut
from controller.studio.source import ANGLES, Source
from controller.studio.syntax import lost_comments
from go2_wbc.errors import StudioError
from go2_wbc.legs import Leg
from motions import Timeline
from motions.arguments import foot
from motions.language.keys import BODY_CHANNELS, ON_GROUND, Frame, LegKey, LegTarget, easing
from motions.language.tracing import Call, CallMark

LEAST = 0.01  #: s or beats, of each of the two, own choice
TRUNK = frozenset({"body", "pose", "look_at", "home"})  #: Calls after which the trunk is elsewhere
FEET = frozenset({"foot", "leg", "joint", "down"})
WAYS: Mapping[str, tuple[str, ...]] = {
    "walk": ("x", "y", "turn"),
    "turn": ("angle",),
    "side_step": ("y",),
}
"""Walks, and the arguments of which each of the two gets a share."""
WHY_NOT = {
    "step": "a foot is in the air for all of it",
    "body_path": "its way is one curve",
    "posture": "the robot goes to another posture in one move",
    "unweight": "the trunk goes over the other feet in one move",
}
TIMES = frozenset({"at", "also", "bpm", "on_beats"})  #: Calls that take no time
JOINTS = ("hip", "thigh", "calf")


@dataclass(frozen=True, slots=True)
class _Half:
    """The first of the two: its method, and the numbers [m, rad] by which it is another one."""

    name: str
    numbers: Mapping[str, float]


def split(source: Source, path: str, marks: Sequence[CallMark], cut: Cut) -> Source:
    """With a call made two at an instant of the motion.

    Raises:
        StudioError: if it cannot be; says why.
    """
    runs = [mark for mark in marks if (mark.call.file, mark.call.site) == (path, cut.site)]
    mark = next((mark for mark in runs if mark.call.number == cut.number), None)
    if mark is None:
        raise StudioError("what is split must be written in this file")
    call = mark.call
    source.arguments(cut.site)  # each of them is written
    how_long = "seconds" if call.name == "hold" else "over"
    length = call.arguments.get(how_long)
    if call.name != "hold" and call.name not in {*TRUNK, *FEET, *WAYS}:
        why = WHY_NOT.get(call.name, "it is no single move")
        raise StudioError(f"it cannot be split: {why}")
    if call.name != "hold" and len(runs) > 1:
        raise StudioError(f"it runs {len(runs)} times in a loop: write the loop out first")
    if not isinstance(length, int | float):
        raise StudioError("it takes as long as its steps need: add the argument Takes first")
    start = mark.start if call.name in WAYS else mark.move  # a shift before it is not of its time
    _require_alone(marks, call, mark, cut.time)
    is_shift = mark.start < cut.time < start
    shift = "; while the trunk shifts (hatched) there is nothing to split" if is_shift else ""
    share = (cut.time - start) / max(mark.end - start, LEAST)
    first = round(share * length, 2)
    if not LEAST <= first <= length - LEAST:
        raise StudioError(
            f"the playhead is at {cut.time:.2f} s: to split it, put the playhead between "
            f"{start:.2f} and {mark.end:.2f} s{shift}"
        )
    share = first / length
    shared = {
        name: _shared(source, cut, name, share)
        for name in (how_long, *WAYS.get(call.name, ()))
        if name in call.arguments
    }
    return _written(source, cut, shared, _half(call, share))


def _require_alone(marks: Sequence[CallMark], call: Call, mark: CallMark, time: float) -> None:
    """Raise StudioError where ``also()`` is before or behind, which counts from one call."""
    before = call.before
    if before is not None and time < mark.start + (wait := before.floor - before.cursor):
        raise StudioError(
            f"it runs beside the move before it (also()): to split it, put the playhead behind "
            f"{mark.start + wait:.2f} s, where that one ends"
        )
    for other in marks:
        line = other.call.before
        if other.call.name == "also" and line is not None:
            calls = [key.call for key in line.keys if isinstance(key, CallMark)]
            moves = [one for one in calls if one.name not in TIMES]
            if moves and moves[-1] is call:
                raise StudioError("it cannot be split: the move behind it starts with it (also())")


def _half(call: Call, share: float) -> _Half:
    """How far the first one goes."""
    before = call.before
    if call.name == "hold" or call.name in WAYS or before is None:
        ways = [name for name in WAYS.get(call.name, ()) if call.arguments.get(name)]
        if len(ways) > 1 and "turn" in ways:
            raise StudioError("a walk that turns on its way cannot be split")
        return _Half(call.name, {})
    given: dict[str, Any] = call.arguments
    after: Timeline = getattr(before, call.name)(**given)
    done, _, _ = easing(given.get("ease", "minimum_jerk")).progress(share)
    if call.name in FEET:
        return _half_of_foot(call, before, after, done)
    if before.raised != after.raised:
        raise StudioError("All home cannot be split while a foot is raised: put it down first")
    ways = {name: (before.body_value(name), after.body_value(name)) for name in BODY_CHANNELS}
    numbers = {
        name: start + done * (goal - start)
        for name, (start, goal) in ways.items()
        if start != goal or (call.name == "body" and name in given)
    }
    if not numbers:
        raise StudioError("it does not move the trunk: there is nothing to split")
    return _Half("body", numbers)


def _half_of_foot(call: Call, before: Timeline, after: Timeline, done: float) -> _Half:
    given: dict[str, Any] = call.arguments
    start, goal = (_target(line, foot(given["leg"])) for line in (before, after))
    if start.frame is not goal.frame:
        way = f"the {start.frame.value} before it, and with the {goal.frame.value} then"
        raise StudioError(f"it cannot be split: the foot goes with {way}")
    values = [a + done * (b - a) for a, b in zip(start.values, goal.values, strict=True)]
    if call.name == "joint":
        return _Half("joint", {"angle": values[JOINTS.index(given["joint"])]})
    names = JOINTS if goal.frame is Frame.JOINTS else ("x", "y", "z")
    return _Half("leg" if call.name == "leg" else "foot", dict(zip(names, values, strict=True)))


def _target(line: Timeline, leg: Leg) -> LegTarget:
    """Where the last key leaves a leg."""
    keys = [key for key in line.in_order(LegKey) if key.leg == leg]
    return keys[-1].target if keys else ON_GROUND


def _shared(source: Source, cut: Cut, name: str, share: float) -> tuple[str, str]:
    """An argument as text of which each of the two gets its share; what is computed stays so."""
    slots = source.slots(cut.site, Run(cut.number))
    slot = next(slot for slot in slots if slot.of == name or slot.name == name)
    if slot.span is None or slot.place or isinstance(slot.value, str | None):
        part = round(share, 4)
        code = slot.code if slot.code.isidentifier() else f"({slot.code})"
        return f"{part} * {code}", f"{round(1.0 - part, 4)} * {code}"
    first = round(share * slot.value, 4)
    rest = round(slot.value - first, 4)
    before, _, behind = slot.code.partition(source.syntax.text(slot.span))  # such as deg( and )
    return f"{before}{first}{behind}", f"{before}{rest}{behind}"


def _written(
    source: Source, cut: Cut, shared: Mapping[str, tuple[str, str]], half: _Half
) -> Source:
    """The call as the first one, and the second behind it."""
    name, left = source.syntax.name(source.syntax.call(cut.site)), dict(half.numbers)
    first, second, at = list[str](), list[str](), 0
    for of, text, is_word in source.arguments(cut.site):
        one, two = shared.get(of, (text, text))
        second.append(f"{of}={two}" if is_word else two)
        if of in shared:
            at = len(first)
        elif half.name != name and of not in ("leg", "ease"):
            continue  # where the whole one goes
        elif of in left:
            one = _number(source, of, left.pop(of))
        first.append(f"{of}={one}" if is_word else one)
    first[at:at] = [f"{of}={_number(source, of, value)}" for of, value in left.items() if value]
    texts = f".{half.name}({', '.join(first)})", f".{name}({', '.join(second)})"
    parted = source.parted(cut.site, *texts)
    return parted.noted(lost_comments(source.data, parted.data))


def _number(source: Source, name: str, value: float) -> str:
    return source.value(name, round(math.degrees(value), 2) if name in ANGLES else value)
