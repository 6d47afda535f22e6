"""Lets robot time pass: inside calls, or in a background thread at wall-clock pace.

Without ``realtime`` nothing moves between calls and every run is deterministic. With it, a thread
ticks the loop all the time and calls wait for what they want to see.
"""

from __future__ import annotations

import gc
import logging
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from weakref import WeakValueDictionary

from controller.behaviours.base import Behaviour
from controller.loop import ControlLoop, Fault
from controller.pacing import Pacer
from go2_wbc.errors import ClosedError, PlantError, PlantTimeout
from go2_wbc.plant.base import Plant

_log = logging.getLogger(__name__)

GREATEST_LAG = 0.1
"""Lag [s] behind the wall clock after which the pace is given up and taken up anew."""
LEAST_PAUSE = 1e-4
"""Least pause [s] between two ticks, in which waiting calls get hold of the lock."""
POLL = 0.05
"""Time [s] after which a waiting thread looks again, should it have missed a notice."""
HANG_LIMIT = 2.0
"""Time [s] for which one tick may keep others waiting; a plant that blocks longer hangs."""
_DRIVEN: WeakValueDictionary[int, Plant] = WeakValueDictionary()
"""Plants that have a runner, by their ``id``."""


class Runner:
    """Owns the passing of time for one loop.

    Whoever ticks the loop, or reads more of it than one attribute, holds ``lock``. Without
    ``realtime`` a waiting call holds it until it ends, so other threads never wait for the lock to
    end a call: ``interrupt`` and ``close`` set a flag that is read before every tick. Should the
    plant block in the background, calls end with ``PlantTimeout`` instead of waiting with it.
    """

    def __init__(
        self, loop: ControlLoop, *, realtime: bool, after_tick: Callable[[], None]
    ) -> None:
        """Start the background thread if ``realtime``; call ``after_tick`` after every tick.

        Raises:
            PlantError: if another runner drives the loop's plant.
        """
        self.loop = loop
        if _DRIVEN.get(id(loop.plant)) is loop.plant:
            raise PlantError("another controller drives this plant: close that one first")
        _DRIVEN[id(loop.plant)] = loop.plant
        self._lock = threading.RLock()
        self._after_tick = after_tick
        self._changed = threading.Condition()  # with a lock of its own, which no tick holds
        self._ticks = 0
        self._stopping = False
        self._interruption: str | None = None
        self._known_fault = loop.fault
        self._failure: BaseException | None = None
        self._thread: threading.Thread | None = None
        if realtime:
            self._thread = threading.Thread(target=self._keep_pace, name="go2-loop", daemon=True)
            self._thread.start()

    @property
    def is_realtime(self) -> bool:
        """Whether time passes by itself."""
        return self._thread is not None

    @contextmanager
    def lock(self) -> Iterator[None]:
        """Holds the loop between two ticks.

        Raises:
            PlantTimeout: if a tick does not end.
        """
        limit = HANG_LIMIT if self.is_realtime else -1.0  # else: until the call that runs ends
        if not self._lock.acquire(timeout=limit):
            raise self._hanging()
        try:
            yield
        finally:
            self._lock.release()

    @property
    def is_alive(self) -> bool:
        """Whether the background thread, if there is one, can still move the robot."""
        return self._failure is None

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
        with self.lock():
            self._known_fault = self.loop.fault

    def engage(self, behaviour: Behaviour) -> Fault | None:
        """Switch to ``behaviour``, unless a fault has come up since ``begin``.

        Returns:
            That fault, or None if ``behaviour`` has begun.

        Raises:
            PlantError: if the plant fails.
            ClosedError: if the controller is closed meanwhile.
        """
        with self.lock():
            self._obey()
            fault = self.loop.fault
            if fault is not None and fault is not self._known_fault:
                return fault
            self.loop.engage(behaviour, observe=not self.is_realtime)
            return None

    def interrupt(self, reason: str) -> None:
        """Go limp at once, from any thread; returns when the loop has taken notice.

        Raises:
            PlantTimeout: if the loop does not, since a tick does not end.
        """
        self._interruption = reason
        deadline = time.monotonic() + HANG_LIMIT
        while self._interruption is not None:
            if time.monotonic() > deadline:
                raise self._hanging()
            if self._lock.acquire(timeout=POLL):
                try:
                    self._obey_interruption()
                    if not self.is_realtime:
                        self.loop.go_limp()
                finally:
                    self._lock.release()

    def advance_until(self, is_done: Callable[[], bool], limit: float) -> bool:
        """Let time pass until ``is_done()`` holds after a tick, for ``limit`` seconds at most.

        Returns:
            Whether it held. A fault of the loop ends the wait with False.

        Raises:
            PlantError: if the plant fails.
            ClosedError: if the controller is closed meanwhile.
        """
        with self.lock():
            end, behaviour = self.loop.state.time + limit, self.loop.behaviour
            if not self.is_realtime:
                return self._advance(is_done, behaviour, end)
        return self._watch(is_done, behaviour, end)

    def _advance(self, is_done: Callable[[], bool], behaviour: Behaviour, end: float) -> bool:
        while self.loop.state.time < end:
            self._obey()
            self.loop.tick()
            self._after_tick()
            if self._is_ended(behaviour):
                return False
            if is_done():
                return True
        return False

    def _watch(self, is_done: Callable[[], bool], behaviour: Behaviour, end: float) -> bool:
        seen = self._ticks
        while True:
            with self._changed:
                if not self._changed.wait_for(lambda seen=seen: self._has_news(seen), HANG_LIMIT):
                    raise self._hanging()
            with self.lock():
                self._obey()
                if self._failure is not None:
                    raise self._failure
                seen = self._ticks
                if self._is_ended(behaviour):
                    return False
                if is_done():
                    return True
                if self.loop.state.time >= end:
                    return False

    def _has_news(self, seen: int) -> bool:
        return self._ticks != seen or self._failure is not None or self._stopping

    def _is_ended(self, behaviour: Behaviour) -> bool:
        return self.loop.fault is not None or self.loop.behaviour is not behaviour

    def _hanging(self) -> PlantTimeout:
        return PlantTimeout(f"the plant has kept the loop waiting for more than {HANG_LIMIT:g} s")

    def _obey(self) -> None:
        if self._stopping:
            raise ClosedError("the controller was closed during a call")
        self._obey_interruption()

    def _obey_interruption(self) -> None:
        reason, self._interruption = self._interruption, None
        if reason is not None:
            fault = self.loop.fault
            self.loop.abandon(Fault(reason, is_fall=fault is not None and fault.is_fall))

    def _keep_pace(self) -> None:
        are_frozen = gc.get_freeze_count() > 0  # a program's own objects, which stay so
        gc.freeze()  # else a collection looks through all that was imported, for tens of ms
        try:
            self._tick_at_pace()
        finally:
            if not are_frozen:
                gc.unfreeze()

    def _tick_at_pace(self) -> None:
        pacer = Pacer(self.loop.plant.control_period, GREATEST_LAG, LEAST_PAUSE)
        while True:
            with self._lock:
                if self._stopping:
                    self.loop.go_limp()  # ``close`` may have given up waiting for this
                    return
                try:
                    self._obey_interruption()
                    self.loop.tick()
                    self._after_tick()
                except BaseException as error:  # whatever it is, a waiting call ends with it
                    self._fail(error)
                    return
                finally:
                    with self._changed:
                        self._ticks += 1
                        self._changed.notify_all()
            lag = pacer.wait()
            self.loop.telemetry.missed_deadlines = pacer.missed
            if lag:
                _log.warning("the loop is %.0f ms behind the wall clock", 1000 * lag)

    def _fail(self, error: BaseException) -> None:
        """The end of the background thread: nothing moves the robot any more."""
        self._failure = error
        if self.loop.fault is None:  # it came after the tick
            self.loop.abandon(Fault(f"{type(error).__name__}: {error}"))
        self.loop.go_limp()

    def close(self) -> None:
        """Go limp and stop: no tick after this, and a call that runs ends; idempotent."""
        self._stopping = True
        _DRIVEN.pop(id(self.loop.plant), None)
        with self._changed:
            self._changed.notify_all()
        if self._thread is None:
            with self.lock():
                self.loop.go_limp()
        elif self._thread is not threading.current_thread():
            self._thread.join(HANG_LIMIT)
            if self._thread.is_alive():
                _log.warning("%s; left behind", self._hanging())
