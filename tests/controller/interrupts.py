"""Ctrl-C at moments that nobody chose."""

from __future__ import annotations

import signal
from collections.abc import Callable

import numpy as np
import pytest

LEAST, GREATEST = 1e-3, 4e-3
"""Range of the time [s] after which it comes."""
AGAIN = 5.0
"""Time [s] after which it comes again: Python swallows one that comes in a destructor."""


def interrupt_somewhere_in(endless: Callable[[], object], rng: np.random.Generator) -> None:
    """Raises KeyboardInterrupt wherever the main thread then is in ``endless()``, and catches it.

    By a timer of the kernel: a thread that interrupts does so only while the main thread waits.
    """

    def begin() -> None:
        signal.setitimer(signal.ITIMER_REAL, rng.uniform(LEAST, GREATEST), AGAIN)
        endless()

    usual = signal.signal(signal.SIGALRM, signal.default_int_handler)
    try:
        with pytest.raises(KeyboardInterrupt):
            begin()
    finally:
        signal.setitimer(signal.ITIMER_REAL, 0.0)
        signal.signal(signal.SIGALRM, usual)
