"""Warnings that may come at the rate of messages, but are written once in a while."""

from __future__ import annotations

import logging
import time

PERIOD = 5.0
"""Least time [s] between two warnings of one kind."""


class Throttle:
    """Writes a warning of each kind at most once in ``PERIOD``, with how many were left out."""

    def __init__(self, log: logging.Logger) -> None:
        """Write to ``log``."""
        self._log = log
        self._next: dict[str, float] = {}
        self._dropped: dict[str, int] = {}

    def warn(self, kind: str, message: str) -> None:
        """Write ``message``, unless one of this kind was written just before."""
        now = time.monotonic()
        if now < self._next.get(kind, 0.0):
            self._dropped[kind] = self._dropped.get(kind, 0) + 1
            return
        dropped = self._dropped.pop(kind, 0)
        self._next[kind] = now + PERIOD
        self._log.warning("%s%s", message, f" ({dropped} more like this)" if dropped else "")
