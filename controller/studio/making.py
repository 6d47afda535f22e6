"""Runs an author's file, with the modules beside it, and takes its calls apart from the motion."""

from __future__ import annotations

import os
import signal
import sys
from collections import defaultdict
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass, replace
from pathlib import Path
from typing import final

from controller.studio.orders import LONGEST_RUN, Order, Task
from go2_wbc.curves import Ease
from go2_wbc.errors import StudioError
from motions import Motion, Timeline
from motions.authoring import Value
from motions.language.keys import Key, OwnEase
from motions.language.tracing import CallMark, separated, traced
from motions.plan.parts import rests
from motions.registry import load_text

RANDOM = "The file draws random numbers: bars jump at each change. Seed them in the file."
WHOLE = (
    "The motion never rests at home: each change has all of it checked again, which takes longer."
)
LONG = 10.0  #: Time [s] from which on that is told
PACKAGES = frozenset({"site-packages", "dist-packages"})  #: Folders of what others have written
OURS = ("go2_wbc", "controller", "motions", "viz")  #: Packages that lie beside files of a checkout


@dataclass(frozen=True, slots=True)
class Made:
    """What came of running a file."""

    motion: Motion
    names: tuple[str, ...]  #: of all motions of the file
    values: Mapping[str, Value]  #: of its parameters
    line: Timeline
    marks: tuple[CallMark, ...]  #: of its calls
    notes: tuple[str, ...]  #: what is to be known of it, in words
    whole: Timeline  #: the line with the marks in it


@final
class Maker:
    """Makes the motions of files; what they import from beside them is read anew if it changes."""

    def __init__(self) -> None:
        self._is_random = dict[tuple[Path, str], bool]()
        self._read = dict[str, int]()
        self._others = defaultdict[Path, set[str]](set(sys.modules).copy)

    def make(self, order: Order) -> Made:
        """Run the text.

        Raises:
            TimelineError: if it is no motion; says the line.
            StudioError: if it takes longer than ``LONGEST_RUN``.
        """
        with _ended_after(LONGEST_RUN):
            return self._noted(order)

    def _noted(self, order: Order) -> Made:
        folder = str(order.path.parent)
        if folder not in sys.path:
            sys.path.insert(0, folder)
        sys.dont_write_bytecode = True  # of two saves within a second the first would stay
        self._forget_changed(order.path.parent)
        made = self._made(order)
        self._read = self._written(order.path.parent)
        which = order.path, made.motion.name
        if which not in self._is_random:
            self._is_random[which] = _moves(made.line) != _moves(self._made(order).line)
        if order.task is Task.DRAFT:  # which tells no notes
            return made
        notes = [RANDOM] if self._is_random[which] else []
        if made.line.end > LONG and not rests(made.line):
            notes.append(WHOLE)
        return replace(made, notes=tuple(notes))

    def _made(self, order: Order) -> Made:
        with traced(str(order.path)):
            own = load_text(order.path, order.data)
            motion = own.get(order.chosen or "", next(iter(own.values())))
            known = {item.name for item in motion.parameters}
            values = {name: value for name, value in order.values.items() if name in known}
            whole = motion(**values)
        line, marks = separated(whole)
        if not line.keys:  # begun, and nothing written yet: it stands
            line = line.body(z=0.0, over=1.0)
        return Made(motion, tuple(own), values, line, tuple(marks), (), whole)

    def _forget_changed(self, folder: Path) -> None:
        """Have what is imported from ``folder`` read again if any of it was written meanwhile."""
        if (now := self._written(folder)) != self._read:
            for name in now:
                del sys.modules[name]

    def _written(self, folder: Path) -> dict[str, int]:
        """When each module was written that was imported from a folder [ns]; 0 of one that is gone.

        A module that is from elsewhere stays so.
        """
        found, others, start = dict[str, int](), self._others[folder], f"{folder}{os.sep}"
        ours = tuple(f"{start}{package}{os.sep}" for package in OURS)
        for name in sys.modules.keys() - others:
            file = getattr(sys.modules[name], "__file__", None) or ""
            is_own = file.startswith(start) and not file.startswith(ours)
            if is_own and not PACKAGES & {*(path := Path(file)).parts}:
                found[name] = path.stat().st_mtime_ns if path.exists() else 0
            else:
                others.add(name)
        return found


def _moves(line: Timeline) -> list[Key]:
    """Its keys; functions of its own are other ones in every run."""
    return [
        replace(key, ease=Ease.LINEAR) if isinstance(key.ease, OwnEase) else key
        for key in line.keys
    ]


class _Endless(BaseException):
    """What no file catches."""


@contextmanager
def _ended_after(seconds: float) -> Iterator[None]:
    """End what takes longer than this of processor time, where that can be: the process stays.

    Raises:
        StudioError: then.
    """

    def end(*_: object) -> None:
        raise _Endless

    if sys.platform == "win32":
        yield
        return
    signal.signal(signal.SIGPROF, end)
    signal.setitimer(signal.ITIMER_PROF, seconds)
    try:
        yield
    except _Endless:
        raise StudioError(f"the file ran for longer than {seconds:g} s; it was stopped") from None
    finally:
        signal.setitimer(signal.ITIMER_PROF, 0.0)
