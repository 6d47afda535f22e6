"""Makes sure that a robot is left limp however the process ends, ``kill -9`` excepted."""

from __future__ import annotations

import atexit
import signal
import threading
from collections.abc import Callable
from types import FrameType
from typing import Final

_SIGNALS: Final = (signal.SIGTERM, signal.SIGHUP)


def at_the_end(action: Callable[[], None]) -> None:
    """Call ``action`` when the interpreter exits, also after SIGTERM or SIGHUP.

    Signals that the program handles itself, and other threads' programs, are left alone.
    """
    atexit.register(action)
    if threading.current_thread() is not threading.main_thread():
        return
    for number in _SIGNALS:
        if signal.getsignal(number) is signal.SIG_DFL:
            signal.signal(number, _exit)


def forget(action: Callable[[], None]) -> None:
    """Do not call ``action`` any more."""
    atexit.unregister(action)


def _exit(number: int, frame: FrameType | None) -> None:
    raise SystemExit(128 + number)
