"""Lets robot time pass: inside calls, or in a background thread at wall-clock pace.

Without ``realtime`` nothing moves between calls and every run is deterministic. With it, a thread
ticks the loop all the time and calls wait for what they want to see.
"""

from __future__ import annotations

import logging
import threading
import time
from collections.abc import Callable

from controller.behaviours.base import Behaviour
from controller.loop import ControlLoop, Fault
from go2_wbc.errors import ClosedError, PlantError

_log = logging.getLogger(__name__)

LATE = 0.1
"""Lag [s] behind the wall clock after which the pace is given up and taken up anew."""
BREATH = 1e-4
"""Least pause [s] between two ticks, in which waiting calls get hold of the lock."""
POLL = 0.05
"""Time [s] after which a waiting thread looks again, should it have missed a notice."""


class Runner:
    """Owns the passing of time for one loop.

    Whoever ticks the loop, or reads more of it than one attribute, holds ``lock``. Without
    ``realtime`` a waiting call holds it until it ends, so other threads never wait for the lock to
    end a call: ``interrupt`` and ``close`` leave a note that is read before every tick.
    """

    def __init__(
        self, loop: ControlLoop, *, realtime: bool, after_tick: Callable[[], None]
    ) -> None:
        """Start the background thread if ``realtime``; call ``after_tick`` after every tick."""
        self.loop = loop
        self.lock = threading.RLock()
        self._after_tick = after_tick
        self._changed = threading.Condition(self.lock)
        self._stopping = False
        self._interruption: str | None = None
        self._known_fault = loop.fault
        self._failure: Exception | None = None
        self._thread: threading.Thread | None = None
        if realtime:
            self._thread = threading.Thread(target=self._keep_pace, name="go2-loop", daemon=True)
            self._thread.start()

    @property
    def is_realtime(self) -> bool:
        """Whether time passes by itself."""
        return self._thread is not None

    def begin(self) -> None:
        """Begin a call: a fault from before it may be cleared, one during it ends it.

        Raises:
            PlantError: if the background thread has ended, since nothing would move any more.
        """
        if self._failure is not None:
            raise PlantError(
                f"the loop in the background has ended ({self._failure}); "
                "close this controller and make a new one"
            )
        with self.lock:
            self._known_fault = self.loop.fault

    def engage(self, behaviour: Behaviour) -> Fault | None:
        """Switch to ``behaviour``, unless a fault has come up since ``begin``.

        Returns:
            That fault, or None if ``behaviour`` has begun.

        Raises:
            PlantError: if the plant fails.
            ClosedError: if the controller is closed meanwhile.
        """
        with self.lock:
            self._heed()
            fault = self.loop.fault
            if fault is not None and fault is not self._known_fault:
                return fault
            self.loop.engage(behaviour)
            return None

    def interrupt(self, reason: str) -> None:
        """Go limp at once, from any thread; returns when the loop has taken notice."""
        self._interruption = reason
        while self._interruption is not None:
            if self.lock.acquire(timeout=POLL):
                try:
                    self._heed_interruption()
                    if not self.is_realtime:
                        self.loop.go_limp()
                finally:
                    self.lock.release()

    def advance_until(self, is_done: Callable[[], bool], limit: float) -> bool:
        """Let time pass until ``is_done()`` holds after a tick, for ``limit`` seconds at most.

        Returns:
            Whether it held. A fault of the loop ends the wait with False.

        Raises:
            PlantError: if the plant fails.
            ClosedError: if the controller is closed meanwhile.
        """
        with self._changed:
            end = self.loop.state.time + limit
            behaviour = self.loop.behaviour
            while self.loop.state.time < end:
                self._pass_one_tick()
                if self.loop.fault is not None or self.loop.behaviour is not behaviour:
                    return False
                if is_done():
                    return True
            return False

    def _pass_one_tick(self) -> None:
        if self._thread is None:
            self._heed()
            self.loop.tick()
            self._after_tick()
            return
        before = self.loop.state.time
        while self.loop.state.time == before and self._failure is None:
            self._heed()
            self._changed.wait(timeout=POLL)
        if self._failure is not None:
            raise self._failure

    def _heed(self) -> None:
        if self._stopping:
            raise ClosedError("the controller was closed during a call")
        self._heed_interruption()

    def _heed_interruption(self) -> None:
        reason, self._interruption = self._interruption, None
        if reason is not None:
            self.loop.abandon(Fault(reason))

    def _keep_pace(self) -> None:
        due = time.monotonic()
        while True:
            with self._changed:
                if self._stopping:
                    return
                try:
                    self._heed_interruption()
                    self.loop.tick()
                    self._after_tick()
                except Exception as error:  # whatever it is, a waiting call must end with it
                    self._failure = error
                    return
                finally:
                    self._changed.notify_all()
            due += self.loop.plant.control_period
            lag = time.monotonic() - due
            if lag > LATE:
                _log.warning("the loop is %.0f ms behind the wall clock", 1000 * lag)
                due = time.monotonic()
            time.sleep(max(-lag, BREATH))

    def close(self) -> None:
        """Go limp and stop: no tick after this, and a call that runs ends; idempotent."""
        self._stopping = True
        with self._changed:
            self._changed.notify_all()
        if self._thread is not None and self._thread is not threading.current_thread():
            self._thread.join()
        with self.lock:
            self.loop.go_limp()
