"""A loop in a thread of its own: its pace, work from other threads, its log lines, rate-limited.

Ctrl-C raises ``KeyboardInterrupt`` between two instructions of the main thread, also just after it
has taken a lock. If this were a lock that the loop needs, the robot would get no more commands. So
other threads do not lock the loop: they hand in an errand and wait for the answer. For the same
reason another thread writes the loop's log lines, since a log handler has a lock. The threads share
only queues whose ``put`` never waits.
"""

from __future__ import annotations

import logging
import threading
import time
from collections.abc import Callable, Hashable
from dataclasses import dataclass, field
from enum import Enum
from queue import Empty, SimpleQueue
from typing import Any, TypeVar, final

SWITCH_INTERVAL = 0.0005
"""Time [s] for which one thread may keep the interpreter to itself: a quarter of a control period
instead of Python's two and a half, so that other work does not hold up the control loop."""
NAP = 0.001  #: Longest sleep [s] between two calls of ``meanwhile``
REASON = "%s"
"""Format of the log line that says why something ended; ``go2-wbc`` prints outcomes itself."""
LOG_PERIOD = 5.0  #: Least time [s] between two warnings of one kind


@final
class Pacer:
    """Waits until the next control period is due; gives the pace up when it is too late.

    Attributes:
        give_ups: how often the pace had to be taken up anew.
        missed: how many waits began when their period was over already.
    """

    def __init__(self, period: float, late: float, rest: float = 0.0) -> None:
        """Keep a pace.

        Args:
            period: time [s] between the ends of two waits.
            late: lag [s] from which on the pace is given up and begins anew.
            rest: least sleep [s] of a wait, in which other threads get hold of a lock.
        """
        self._period, self._late, self._rest = period, late, rest
        self._due = time.monotonic()
        self.give_ups = self.missed = 0

    def wait(self, meanwhile: Callable[[], None] | None = None) -> float:
        """Sleep until the next period is due; ``meanwhile`` is called again and again.

        Returns:
            The lag [s] that was given up, usually 0.
        """
        self._due += self._period
        lag = time.monotonic() - self._due
        self.missed += lag > 0.0
        is_given_up = lag > self._late
        if is_given_up:
            self._due += lag
            self.give_ups += 1
        if self._rest > max(-lag, 0.0):
            time.sleep(self._rest)
        while (left := self._due - time.monotonic()) > 0.0:
            time.sleep(left if meanwhile is None else min(left, NAP))
            if meanwhile is not None and left > NAP:
                meanwhile()
        return lag if is_given_up else 0.0


@final
class LogOnce:
    """Writes a warning when what it is about begins, and not again until that has ended."""

    def __init__(self, log: logging.Logger) -> None:
        self._log = log
        self._levels: dict[Hashable, int] = {}

    def warn(self, level: int, message: str, about: Hashable = None) -> None:
        """Write ``message`` if this is worse than it was; 0 is the end of it.

        What is ``about`` something else is another thing to warn of.
        """
        if level > self._levels.get(about, 0):
            self._log.warning(message)
        self._levels = {**self._levels, about: level} if level else {}


@final
class LogThrottle:
    """Writes a warning of each kind at most once in a while, with how many were left out."""

    def __init__(
        self,
        log: logging.Logger,
        period: float = LOG_PERIOD,
        clock: Callable[[], float] = time.monotonic,
    ) -> None:
        """Write to ``log``, each kind once in ``period`` [s] of ``clock``."""
        self._log, self._period, self._clock = log, period, clock
        self._next: dict[str, float] = {}
        self._dropped: dict[str, int] = {}

    def warn(self, kind: str, message: str) -> None:
        """Write ``message``, unless one of this kind was written just before."""
        now = self._clock()
        if now < self._next.get(kind, now):
            self._dropped[kind] = self._dropped.get(kind, 0) + 1
            return
        dropped = self._dropped.pop(kind, 0)
        self._next[kind] = now + self._period
        self._log.warning("%s%s", message, f" ({dropped} more like this)" if dropped else "")


POLL = 0.05  #: Time [s] after which a waiting thread looks whether the loop still runs
FLUSH_LIMIT = 0.5  #: Time [s] in which the last log lines are written

Result = TypeVar("Result")


class Pending(Enum):
    """What an errand returns that is to be done again after the next tick."""

    NOT_YET = "not yet"


NOT_YET = Pending.NOT_YET


class LoopEnded(Exception):
    """No errand is done any more, nor has this one been."""


class LoopHangs(Exception):
    """The loop has kept others waiting for too long."""


@dataclass(slots=True, eq=False)
class _Errand:
    work: Callable[[], object]
    is_abandoned: bool = False
    answer: SimpleQueue[tuple[Any, BaseException | None]] = field(default_factory=SimpleQueue)

    def is_over(self) -> bool:
        """Do it, unless nobody waits for it any more; returns whether that was the last time."""
        if self.is_abandoned:
            return True
        try:
            result = self.work()
        except BaseException as error:  # it is its asker's, whatever it is
            self.answer.put((None, error))
            return True
        if result is NOT_YET:
            return False
        self.answer.put((result, None))
        return True


@final
class Errands:
    """What the thread of a loop has been asked to do between its ticks."""

    def __init__(self) -> None:
        self._asked: SimpleQueue[_Errand] = SimpleQueue()
        self._under_way: list[_Errand] = []
        self._rounds = 0
        self._is_ended = False

    def serve(self) -> None:
        """Do what has been asked; once between two ticks, by the loop's thread."""
        while not self._asked.empty():
            self._under_way.append(self._asked.get_nowait())
        self._under_way = [errand for errand in self._under_way if not errand.is_over()]
        self._rounds += 1

    def end(self) -> None:
        """Serve for the last time."""
        self.serve()
        self._is_ended = True

    def ask(self, work: Callable[[], Result | Pending], patience: float) -> Result:
        """Have ``work`` done by the loop's thread, until it returns something but ``NOT_YET``.

        Args:
            work: what to do; an error that it raises is raised here.
            patience: time [s] for which the loop may keep others waiting.

        Raises:
            LoopEnded: after ``end``.
            LoopHangs: if nobody serves for longer than ``patience``.
        """
        errand = _Errand(work)
        try:
            self._asked.put(errand)
            result, error = self._answer(errand, patience)
        finally:
            errand.is_abandoned = True  # by Ctrl-C, say: it must not be done after that
        if error is not None:
            raise error
        return result

    def _answer(self, errand: _Errand, patience: float) -> tuple[Any, BaseException | None]:
        seen, waited = self._rounds, 0.0
        while True:
            is_last = self._is_ended
            try:
                return errand.answer.get(timeout=0.0 if is_last else POLL)
            except Empty:
                if is_last:
                    raise LoopEnded from None
            waited = waited + POLL if self._rounds == seen else 0.0
            seen = self._rounds
            if waited >= patience:
                raise LoopHangs


@final
class BackgroundLog:
    """Writes warnings in a thread of its own."""

    def __init__(self, warn: Callable[..., None]) -> None:
        self._warn = warn
        self._lines: SimpleQueue[tuple[str, tuple[object, ...]] | None] = SimpleQueue()
        self._thread = threading.Thread(target=self._write, name="go2-log", daemon=True)
        self._thread.start()

    def warning(self, message: str, *args: object) -> None:
        """Write ``message % args`` soon; never waits."""
        self._lines.put((message, args))

    def close(self) -> None:
        """Write what has been told so far, if that takes no long time; idempotent."""
        self._lines.put(None)
        self._thread.join(FLUSH_LIMIT)

    def _write(self) -> None:
        while (line := self._lines.get()) is not None:
            message, args = line
            self._warn(message, *args)
