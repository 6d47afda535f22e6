"""Log lines of a thread that must not wait.

Ctrl-C may be raised in the main thread just after it has taken the lock of a log handler. A loop
that logs would wait for it for ever, and with it the robot.
"""

from __future__ import annotations

import threading
from collections.abc import Callable
from queue import SimpleQueue
from typing import final

FLUSH_LIMIT = 0.5
"""Time [s] in which the last lines are written."""


@final
class BackgroundLog:
    """Writes warnings in a thread of its own."""

    def __init__(self, warn: Callable[..., None]) -> None:
        """Write with ``warn``, a method of a ``logging.Logger``."""
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
