"""Which call of an author's file wrote which part of a timeline, for programs that edit the file.

While ``traced``, every public call of a ``Timeline`` adds a ``CallMark`` to its keys, which later
calls shift, stretch and mirror with the others; ``separated`` removes the marks. A call is
identified by its end in the file: chained calls start at the same position, but no two end at the
same one (``co_positions``, PEP 657).
"""

from __future__ import annotations

import functools
import sys
from collections import Counter, defaultdict
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from inspect import Parameter, signature
from operator import is_
from types import CodeType, FrameType
from typing import Any, ClassVar

from go2_wbc.curves import Ease
from go2_wbc.legs import Leg
from motions.language.keys import BalanceShift, BodyKey, Key, LegKey, Mark, PhaseKey, StepKey
from motions.language.timeline import Timeline
from motions.language.timeline_data import TimelineData, unchecked

TRUNK, ROBOT, TIME = "trunk", "robot", "time"
"""What a call that moves no single foot belongs to: a jump is of the whole robot, a pause, a tempo
or what is made of a motion as a whole of time."""


@dataclass(frozen=True, slots=True)
class Call:
    """A call that has run."""

    name: str  #: of the method
    file: str  #: that it is written in
    site: tuple[int, int]  #: line from 1, column [bytes of UTF-8] from 0 at which it ends
    number: int  #: how often this call had run before
    arguments: dict[str, object]  #: those that were given, by the names of the parameters
    callers: tuple[tuple[tuple[int, int], int], ...] = ()
    """Where the calls of the functions of this file, or of the one that is traced, end that it runs
    in, the innermost first, and how often they had run before."""
    before: Timeline | None = field(default=None, compare=False, repr=False)
    """What it was called on."""


@dataclass(frozen=True, slots=True)
class CallMark(Mark):
    """The span that a call has written."""

    moves: ClassVar[str] = "call {0.name}"
    instants: ClassVar[tuple[str, ...]] = ("start", "move", "end")

    move: float  #: when [s] its move starts: before it the trunk shifts over the feet that stay
    parts: tuple[Leg | str, ...]  #: what it moves: legs, ``TRUNK``, ``ROBOT``, or ``TIME``
    call: Call  #: which

    @property
    def track(self) -> str:
        """One of its own: calls that run at once do not exclude each other."""
        return f"call {id(self)}"


def separated(line: Timeline) -> tuple[Timeline, list[CallMark]]:
    """The timeline without the marks, and these by their starts."""
    keys = tuple(key for key in line.keys if not isinstance(key, CallMark))
    latest = max((key.end for key in keys), default=0.0)
    return unchecked(line, keys=keys, latest=latest), line.in_order(CallMark)


class _Places:
    """Where calls end that run; by the codes' identities: one hashes all that is written in it."""

    def __init__(self) -> None:
        self._known = dict[int, tuple[CodeType, list[Any]]]()

    def end_of(self, frame: FrameType) -> tuple[int, int]:
        """Line and column at which the call ends that a frame is at."""
        code = frame.f_code
        if id(code) not in self._known:
            places = [*code.co_positions()]
            self._known[id(code)] = code, places  # it is kept: no other one gets its place
        _, end, _, column = self._known[id(code)][1][frame.f_lasti // 2]
        return end or 0, column or 0


@contextmanager
def traced(path: str = "") -> Iterator[None]:
    """Have calls leave marks; not for two threads at once.

    ``path``: of the file whose ``callers`` are told, of calls in other files, too; by default
    those in the file of each call are.
    """
    methods: dict[str, Callable[..., Any]] = {
        name: method
        for kind in reversed(Timeline.__mro__)
        for name, method in vars(kind).items()
        if kind not in (object, TimelineData)
        if callable(method) and not name.startswith("_")
    }
    places = _Places()
    runs, is_inside = Counter[tuple[str, tuple[int, int]]](), False
    entered = defaultdict[tuple[str, tuple[int, int]], dict[FrameType, int]](dict)

    def callers(frame: FrameType) -> Iterator[tuple[tuple[int, int], int]]:
        file, outer = path or frame.f_code.co_filename, frame.f_back
        while outer is not None:
            if outer.f_code.co_filename == file:
                site = places.end_of(outer)
                known = entered[file, site]
                yield site, known.setdefault(frame, len(known))
                frame = outer
            outer = outer.f_back

    def tracing(name: str, method: Callable[..., Any]) -> Callable[..., Timeline]:
        takes = _signature(method)
        names = [*takes.parameters] if all(map(_is_single, takes.parameters.values())) else ()

        @functools.wraps(method)
        def call(*args: Any, **kwargs: Any) -> Timeline:  # noqa: ANN401 - as the method says
            nonlocal is_inside
            if is_inside:  # a call that is made of others is one
                return method(*args, **kwargs)
            is_inside = True
            try:
                after = method(*args, **kwargs)
            finally:
                is_inside = False
            if names:  # as below, which takes ten times as long
                both = {**dict(zip(names, args, strict=False)), **kwargs}
                given = {name: both[name] for name in names if name in both}
            else:
                given = dict(takes.bind(*args, **kwargs).arguments)
            before = given.pop("self")
            frame = sys._getframe(1)
            place = (frame.f_code.co_filename, places.end_of(frame))
            done = Call(name, *place, runs[place], given, tuple(callers(frame)), before)
            runs[place] += 1
            return unchecked(after, keys=(*after.keys, _mark(before, after, done)))

        return call

    for name, method in methods.items():
        setattr(Timeline, name, tracing(name, method))
    try:
        yield
    finally:
        own = vars(Timeline)
        for name, method in methods.items():
            if getattr(own[name], "__wrapped__", None) is method and name not in _OWN:
                delattr(Timeline, name)
            else:
                setattr(Timeline, name, method)


_OWN = frozenset(vars(Timeline))  #: What is defined there, not inherited


_signature = functools.cache(signature)


def _is_single(parameter: Parameter) -> bool:
    return parameter.kind not in (Parameter.VAR_POSITIONAL, Parameter.VAR_KEYWORD)


def _mark(before: Timeline, after: Timeline, call: Call) -> CallMark:
    """What ``call`` has added; all there is if it has made another motion of it."""
    count = len(before.keys)
    is_longer = len(after.keys) >= count and all(map(is_, before.keys, after.keys))
    tail = after.keys[count:] if is_longer else after.keys
    known = set[int]() if is_longer else {id(key) for key in before.keys}
    new = [key for key in tail if id(key) not in known and not isinstance(key, CallMark)]
    is_whole = not is_longer and _count(after) - len(new) < _count(before)
    if call.name == "then" and new:
        parts = {TIME}
    elif is_whole or (call.name in _JOINING and new):
        new, parts = [key for key in after.keys if not isinstance(key, CallMark)], {TIME}
    else:
        parts = {part for key in new for part in _parts(key)} or {TRUNK if new else TIME}
    start = min([key.start for key in new], default=min(before.cursor, after.cursor))
    end = max([key.end for key in new], default=max(before.cursor, after.cursor))
    moves = [key.start for key in new if not isinstance(key, BalanceShift)]
    in_order = tuple(sorted(parts, key=str))
    return CallMark(start, end, Ease.LINEAR, call.name, min(moves, default=start), in_order, call)


def _count(line: Timeline) -> int:
    """Of its keys without the marks."""
    return sum(not isinstance(key, CallMark) for key in line.keys)


_JOINING = frozenset({"together", "repeat", "loop"})


def _parts(key: Key) -> tuple[Leg | str, ...]:
    if isinstance(key, LegKey | StepKey):
        return (key.leg,)
    if isinstance(key, BodyKey):
        return (TRUNK,)
    if isinstance(key, PhaseKey):
        return (ROBOT,)
    return (TIME,) if isinstance(key, Mark) else ()
