"""What the process that runs an author's file is told, and what it answers."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from enum import Enum
from pathlib import Path
from typing import TYPE_CHECKING

from controller.studio.grounds import PlayedGround
from controller.studio.source import Slot
from controller.studio.syntax import Site
from go2_wbc.errors import StudioError
from go2_wbc.world import World
from motions.authoring import Value

if TYPE_CHECKING:
    from viz.content import ReplayContent
    from viz.replay.page_data import Prepared


LONGEST_RUN = 2.0
"""Processor time [s] that a file may take to make its motion: own choice, the library's take 10 ms,
one of 1,000 calls 0.3 s."""
STOPPED = "stopped: the motion is as it was"
AT_ONCE = 1e-6  #: Time [s] to solve a jump for, in which only what is known is found


class TooLong(Exception):
    """A jump was solved for as long as it may."""


class Task(Enum):
    """What is to be done with a motion."""

    CHECK = "check"
    DRAFT = "draft"  #: check, for a page that knows the arguments: while something is dragged
    EXPORT = "export"  #: check, and have all of the content, not only what the page needs
    PLAY = "play"  #: in MuJoCo, beside the plan
    MEND = "mend"  #: look for changes that make it possible
    NEAREST = "nearest"  #: look for the nearest motion that is possible
    BESIDE = "beside"  #: check, with the motion of another text as its ghost
    WRITE = "write"  #: to a file: itself, its plan or its trajectory
    REWRITE = "rewrite"  #: make two calls of one, or write out what is computed


@dataclass(frozen=True, slots=True)
class Cut:
    """Where a call is to be made two."""

    site: Site  #: where it ends in the text
    number: int  #: how often it had run before
    time: float  #: when [s] of the motion the first one ends


@dataclass(frozen=True, slots=True)
class Order:
    """A text that is to be run."""

    path: Path  #: of the file
    data: bytes  #: that it holds or would hold
    chosen: str | None  #: which of its motions; None for the first
    values: Mapping[str, Value]  #: chosen parameters
    task: Task = Task.CHECK  #: what is done with it
    part: Cut | int | bytes | None = None
    """Where a call is split, the place of a bar to be written out, or another text."""
    longest: float = 0.0  #: processor time [s] that one jump may be solved for; 0: the solver's own
    is_shown: bool = False  #: also without the jumps that were not found by then
    is_looked_for: bool = False  #: what was not found is looked for by another process meanwhile
    out: Path | None = None  #: file that is written
    is_afresh: bool = False  #: what was not found before may have been found since
    world: World = World()  #: it is checked and played in
    ground: PlayedGround = PlayedGround()  #: it is played on; it is checked on a level one


@dataclass(frozen=True, slots=True)
class Doing:
    """How far the process has got, told while it works."""

    what: str  #: "loading", "solving", "nearing" (the nearest motion), "playing" or "certifying"
    done: float = 0.0  #: time [s] that was solved for, or of the motion that was played; or runs
    whole: float = 0.0  #: of so many seconds, or runs
    rate: tuple[int, float, float] | None = None
    """Of the runs, those in which the motion was done, and the interval of the rate, 0 to 1."""


@dataclass(frozen=True, slots=True)
class Bar:
    """A call of the file and the span of the motion that it has written."""

    name: str  #: of the method
    site: tuple[int, int]  #: where it ends; (0, 0) in another file
    runs: int  #: how often the call runs
    number: int  #: which of the runs it is
    span: tuple[float, float, float]  #: when [s] it starts, its move starts, and it ends
    parts: tuple[str, ...]  #: what it moves: legs, "trunk", "robot" or "time"
    broken: str  #: the first limit that is broken there, in words; empty if none is
    slots: tuple[Slot, ...]  #: the arguments that are written in it; none of a draft
    values: Mapping[str, float | str]  #: of its arguments, as it ran; angles in radians
    callers: tuple[tuple[tuple[int, int], int], ...] = ()  #: see ``motions.language.tracing``
    file: str = ""  #: where it is written, if that is another one
    line: int = 0  #: of that file
    is_idle: bool = False  #: nothing moves in its span, and it is no pause: it is there already


@dataclass(frozen=True, slots=True)
class Answer:
    """What came of an order."""

    title: str  #: name of the motion
    content: ReplayContent | Prepared | None = None
    """The plan with its verdict, and how it was played."""
    bars: tuple[Bar, ...] = ()  #: by their starts
    motions: tuple[str, ...] = ()  #: all that the file defines
    told: str = ""  #: how playing went, in words
    notes: tuple[str, ...] = ()  #: what is to be known of the file, in words
    changes: tuple[tuple[str, str], ...] = ()
    """Calls that make it possible, to be appended to the motion, each with its meaning."""
    text: tuple[bytes, int | None] | None = None
    """It rewritten, and the byte behind the call that is chosen then."""
    is_solved: bool = True
    """Whether all that jumps was solved; without content it took longer than it may."""

    def shown(self) -> ReplayContent | Prepared:
        """Its content.

        Raises:
            StudioError: if there is none.
        """
        if self.content is None:
            raise StudioError("there is nothing to show")
        return self.content
