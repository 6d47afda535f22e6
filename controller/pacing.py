"""The wall clock: a loop that keeps its pace, and log lines that do not flood."""

from __future__ import annotations

import logging
import time
from collections.abc import Callable
from typing import final

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
        """Write to ``log``."""
        self._log, self._level = log, 0

    def warn(self, level: int, message: str) -> None:
        """Write ``message`` if this is worse than it was; 0 is the end of it."""
        if level > self._level:
            self._log.warning(message)
        self._level = level


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
