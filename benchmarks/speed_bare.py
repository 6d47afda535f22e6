"""What the machine itself does to a loop: work that allocates nothing, beside our ticks.

A tick that is late, or ten times longer than the others, may be ours or the machine's; where the
bare loop has as many of them, it is the machine's.
"""

from __future__ import annotations

import hashlib
import time
from functools import partial

import numpy as np
from jaxtyping import Float

from controller.pacing import Pacer

_TRIALS = 200
"""Calls by which a piece of work is measured."""
_LATE = 1.0
"""Lag [s] from which on the pace is given up: never in a run that means anything."""


class BareWork:
    """Hashes as many bytes as take a given time."""

    def __init__(self, duration: float) -> None:
        """Args: duration: of one call [us], the median."""
        sample = bytes(4096)
        durations = timed(partial(hashlib.sha256, sample), _TRIALS)
        self._bytes = bytes(max(1, round(len(sample) * duration / float(np.median(durations)))))

    def __call__(self) -> None:
        """Work once."""
        hashlib.sha256(self._bytes)


def timed(work: partial[object] | BareWork, times: int) -> Float[np.ndarray, " n"]:
    """Processor time [us] from the end of each call to the end of the next."""
    ends = [time.thread_time_ns()]
    for _ in range(times):
        work()
        ends.append(time.thread_time_ns())
    return np.diff(ends) / 1e3


def share_late(work: BareWork, period: float, duration: float) -> float:
    """Share [%] of calls, one in each ``period`` [s], that were not done when the next was due."""
    pacer = Pacer(period, _LATE)
    count = round(duration / period)
    for _ in range(count):
        work()
        pacer.wait()
    return 100.0 * pacer.missed / count
