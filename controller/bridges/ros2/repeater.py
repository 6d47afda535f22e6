"""Sends the last velocity again and again, so that a command lasts until the next one."""

from __future__ import annotations

import threading
from collections.abc import Callable

PERIOD = 0.02
"""Time [s] between two sendings; the server stops a robot after half a second of robot time."""


class Repeater:
    """Calls ``send`` every ``PERIOD`` between ``start`` and ``stop``, from a thread of its own.

    If the process dies the sending ends, and with it the robot's walk.
    """

    def __init__(self) -> None:
        self._send: Callable[[], object] | None = None
        self._wake = threading.Condition()
        self._thread: threading.Thread | None = None
        self._is_closed = False

    def start(self, send: Callable[[], object]) -> None:
        """Send this from now on; the first time one period from now."""
        with self._wake:
            self._send = send
            if self._thread is None:
                self._thread = threading.Thread(target=self._run, name="go2-repeat", daemon=True)
                self._thread.start()
            self._wake.notify_all()

    def stop(self) -> None:
        """Send nothing any more; when this returns, nothing is being sent."""
        with self._wake:
            self._send = None

    def close(self) -> None:
        """End the thread; idempotent."""
        with self._wake:
            self._is_closed, self._send = True, None
            self._wake.notify_all()
        if self._thread is not None:
            self._thread.join()

    def _run(self) -> None:
        with self._wake:
            while not self._is_closed:
                self._wake.wait(PERIOD if self._send is not None else None)
                if self._send is not None:
                    self._send()
