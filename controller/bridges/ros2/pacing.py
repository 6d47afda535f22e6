"""Keeps robot time at the pace of the wall clock, by sleeping in the loop's own thread."""

from __future__ import annotations

import time
from collections.abc import Callable

LATE = 0.25
"""Lag [s] behind the wall clock after which the pace is given up and taken up anew."""
NAP = 0.001
"""Time [s] between two looks at the middleware while there is nothing else to do."""


class Pacer:
    """Waits until a control period is due.

    Attributes:
        give_ups: how often the pace had to be taken up anew.
    """

    def __init__(self, period: float) -> None:
        """One control period is ``period`` [s]."""
        self._period, self._due = period, time.monotonic()
        self.give_ups = 0

    def wait(self, meanwhile: Callable[[], None]) -> None:
        """Sleep until the next period is due; ``meanwhile`` is called between two naps."""
        self._due += self._period
        now = time.monotonic()
        if now - self._due > LATE:
            self._due = now
            self.give_ups += 1
        while (left := self._due - time.monotonic()) > 0.0:
            time.sleep(min(left, NAP))
            if left > NAP:
                meanwhile()
