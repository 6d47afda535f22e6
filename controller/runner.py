"""Lets robot time pass until a condition is measured: inside calls, or in a background thread.

Without ``realtime`` nothing moves between calls and every run is deterministic. With it, a thread
ticks the loop all the time and calls wait for their condition.
"""

from __future__ import annotations

import gc
import logging
import threading
import time
from collections.abc import Callable
from contextlib import suppress
from typing import NoReturn, TypeVar
from weakref import WeakValueDictionary

from controller import modes
from controller.behaviours import Behaviour
from controller.behaviours.standing import Standing
from controller.loop import ControlLoop
from controller.modes import Aborted, Asked, Fault, Limited, Measurements
from controller.pacing import NOT_YET, BackgroundLog, Errands, LoopEnded, LoopHangs, Pacer, Pending
from go2_wbc.errors import ClosedError, Go2WbcError, ModeError, PlantError, PlantTimeout
from go2_wbc.plant.base import Plant
from go2_wbc.robot.state import Snapshot

_log = logging.getLogger(__name__)

GREATEST_LAG = 0.1
"""Lag [s] behind the wall clock after which the pace is given up and taken up anew."""
LEAST_PAUSE = 1e-4
"""Least pause [s] between two ticks, in which other threads get hold of the interpreter."""
POLL = 0.001  #: Time [s] after which a thread that interrupts another one's call looks again
SETTLE_LIMIT = 3.0  #: Time [s] in which a posture must come to rest after its motion
STEPS_LIMIT = 4.0  #: Time [s] in which steps for balance must come to rest
CALM_TIME = 0.1  #: Time [s] for which a posture must hold without a break
REST_TIME = 0.3
"""The same [s] of rest after a walk: for half of that a trunk that the last step has left 15 mm off
its height is slow while it turns round, and then moves on at 0.02 to 0.03 m/s."""
ROUNDING = 1e-9  #: Time [s] by which a sum of control periods may miss its end
SINK_TIME = 1.0
"""Time [s] for which a robot that went limp on its feet is watched: it sinks, or it falls."""
HANG_LIMIT = 2.0
"""Time [s] for which one tick may keep others waiting; a plant that blocks longer hangs."""
_DRIVEN: WeakValueDictionary[int, Plant] = WeakValueDictionary()
"""Plants that have a runner, by their ``id``."""

Result = TypeVar("Result")


class Runner:
    """Owns the passing of time for one loop.

    Whoever changes the loop, or reads more of it than one attribute, does so ``between_ticks``.
    Without ``realtime`` the thread that calls ticks the loop and holds a lock until its call ends;
    ``interrupt`` and ``close`` set a flag that is read before every tick. With it the thread in the
    background alone touches the loop, and others hand in errands; should the plant block there,
    they end with ``PlantTimeout`` instead of waiting with it.

    What a procedure waits for comes, or ``Aborted`` says in plain words why it did not.
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
        self._after_tick = after_tick
        self._lock = threading.RLock()  # without realtime, or after the thread has ended
        self._holder: int | None = None  # the thread that holds it
        self._errands = Errands()  # with realtime
        self._stopping = False
        self._interruption: str | None = None
        self._known_fault = loop.fault
        self._failure: BaseException | None = None
        self._thread: threading.Thread | None = None
        self._lines: BackgroundLog | None = None
        if realtime:
            self._lines = BackgroundLog(loop.warn)
            loop.warn = self._lines.warning
            self._thread = threading.Thread(target=self._keep_pace, name="go2-loop", daemon=True)
            self._thread.start()

    @property
    def is_realtime(self) -> bool:
        """Whether time passes by itself."""
        return self._thread is not None

    @property
    def is_alive(self) -> bool:
        """Whether the background thread, if there is one, can still move the robot."""
        return self._failure is None

    def between_ticks(self, work: Callable[[], Result]) -> Result:
        """Do ``work`` while no tick is under way, but for the one that may call this.

        Raises:
            PlantTimeout: if a tick does not end.
        """
        if self._is_in_background:
            with suppress(LoopEnded):
                return self._ask(work)
        return self._hold(work)

    def _hold(self, work: Callable[[], Result]) -> Result:
        """Do ``work`` in this thread, while no other one does anything with the loop."""
        with self._lock:
            before, self._holder = self._holder, threading.get_ident()
            try:
                return work()
            finally:
                self._holder = before

    @property
    def _is_in_background(self) -> bool:
        """Whether another thread ticks the loop all the time."""
        return self._thread not in (None, threading.current_thread())

    def _ask(self, work: Callable[[], Result | Pending]) -> Result:
        try:
            return self._errands.ask(work, HANG_LIMIT)
        except LoopHangs:
            raise self._hanging() from None

    def begin(self, asked: Asked | None = None) -> None:
        """Begin a call: a fault from before it was asked may be cleared, one since then ends it.

        Args:
            asked: how things were then; None for as they are.

        Raises:
            Aborted: if a fault has come up since then.
            PlantError: if the background thread has ended, since nothing would move any more.
            ModeError: from within a tick of that thread, for which time would have to pass.
        """
        if self.is_realtime and not self._is_in_background:
            raise ModeError("a call waits for ticks: it cannot be made from within one")
        if self._failure is not None:
            raise PlantError(
                f"the loop in the background has ended ({self._failure}); "
                "close this controller and make a new one"
            )
        fault = self.loop.fault
        self._known_fault = fault if asked is None else asked.fault
        if fault is not None and fault is not self._known_fault:
            raise self._aborted(fault.reason)

    def engage(self, behaviour: Behaviour) -> None:
        """Switch to ``behaviour``.

        Raises:
            Aborted: if a fault has come up since ``begin``.
            PlantError: if the plant fails.
            ClosedError: if the controller is closed meanwhile.
        """

        def switch() -> Fault | None:
            self._obey()
            fault = self.loop.fault
            if fault is not None and fault is not self._known_fault:
                return fault
            self.loop.engage(behaviour, observe=not self.is_realtime)
            return None

        fault = self.between_ticks(switch)
        if fault is not None:
            raise self._aborted(fault.reason)

    def interrupt(self, reason: str) -> None:
        """Go limp at once, from any thread; returns when the loop has taken notice.

        Raises:
            PlantTimeout: if the loop does not, since a tick does not end.
        """
        self._interruption = reason
        if self._is_in_background:
            self.between_ticks(self._obey_interruption)
            return
        deadline = time.monotonic() + HANG_LIMIT
        while self._holder not in (None, threading.get_ident()):
            if self._interruption is None:  # that thread has obeyed
                return
            if time.monotonic() > deadline:
                raise self._hanging()
            time.sleep(POLL)
        self._hold(self._go_limp_if_interrupted)

    def _go_limp_if_interrupted(self) -> None:
        if self._obey_interruption() and not self.is_realtime:
            self.loop.go_limp()

    def advance_until(self, is_done: Callable[[], bool], limit: float) -> bool:
        """Let time pass until ``is_done()`` holds after a tick, for ``limit`` seconds at most.

        With ``realtime`` the thread in the background calls ``is_done``.

        Returns:
            Whether it held. A fault of the loop ends the wait with False.

        Raises:
            PlantError: if the plant fails.
            ClosedError: if the controller is closed meanwhile.
        """
        if not self.is_realtime:
            return self._hold(lambda: self._advance(self._waiting(is_done, limit)))
        waiting = self.between_ticks(lambda: self._waiting(is_done, limit))

        def verdict() -> bool | Pending:
            self._obey()
            if self._failure is not None:
                raise self._failure
            return waiting()

        with suppress(LoopEnded):
            return self._ask(verdict)
        return verdict() is True  # it raises what has ended the loop

    def _waiting(self, is_done: Callable[[], bool], limit: float) -> Callable[[], bool | Pending]:
        """Says after a tick whether ``is_done()`` has come while the loop does what it does now."""
        loop, behaviour, end = self.loop, self.loop.behaviour, self.loop.state.time + limit

        def verdict() -> bool | Pending:
            if loop.fault is not None or loop.behaviour is not behaviour:
                return False
            if is_done():
                return True
            return NOT_YET if loop.state.time < end else False

        return verdict

    def _advance(self, waiting: Callable[[], bool | Pending]) -> bool:
        while True:
            self._obey()
            self.loop.tick()
            try:
                self._after_tick()
            except Go2WbcError as error:  # its call leaves the robot as it is for one of its own
                self.interrupt(f"{type(error).__name__} in after_tick: {error}")
                raise
            verdict = waiting()
            if not isinstance(verdict, Pending):
                return verdict

    # --- until something is measured ----------------------------------------------------------

    def run(self, behaviour: Behaviour, limit: float) -> None:
        """Switch to ``behaviour`` and let it finish, within ``limit`` seconds."""
        self.engage(behaviour)
        self.until(lambda: behaviour.is_finished(self.loop.snapshot), limit, behaviour.label)

    def settle(
        self, what: str, asked: Callable[[Snapshot], Limited], calm_time: float = CALM_TIME
    ) -> None:
        """Let time pass until what is ``asked`` has been within its limits for ``calm_time`` s."""
        if not self.settles(lambda now: modes.are_within(asked(now)), calm_time):
            why = (
                modes.told(asked(self.loop.snapshot)) or f"not for {calm_time:g} s without a break"
            )
            raise self._aborted(f"{what} not done within {SETTLE_LIMIT:.1f} s: {why}")

    def settles(self, check: Callable[[Snapshot], bool], calm_time: float = CALM_TIME) -> bool:
        """Let time pass until ``check`` has held for ``calm_time`` s; whether it came to that."""
        loop = self.loop
        calm_since: list[float] = []

        def calm() -> bool:
            if not check(loop.snapshot):
                calm_since.clear()
                return False
            calm_since.append(loop.state.time)
            return loop.state.time - calm_since[0] >= calm_time

        return self._comes(calm, SETTLE_LIMIT)

    def until(
        self,
        is_done: Callable[[], bool],
        limit: float,
        what: str,
        why_not: Callable[[], str] = lambda: "",
    ) -> None:
        """Let time pass until ``is_done()``, for ``limit`` seconds at most; tells ``why_not``."""
        if not self._comes(is_done, limit):
            said = ", ".join(filter(None, (why_not(), modes.listed(self.measurements()))))
            raise self._aborted(f"{what} not done within {limit:.1f} s: {said}")

    def _comes(self, is_done: Callable[[], bool], limit: float) -> bool:
        """Whether ``is_done()`` came within ``limit`` seconds; a fault is raised."""
        if self.advance_until(is_done, limit):
            return True
        fault = self.loop.fault
        if fault is not None and fault.may_fall:
            self.let_pass(SINK_TIME)
            fault = self.loop.fault or fault
        if fault is not None:
            raise self._aborted(fault.reason)
        return False

    @property
    def is_stepping(self) -> bool:
        """Whether a standing robot steps for balance now."""
        behaviour = self.loop.behaviour
        return isinstance(behaviour, Standing) and behaviour.is_stepping

    def stop_stepping(self) -> None:
        """Wait until a robot that steps for balance stands again."""
        if self.is_stepping:
            self.until(lambda: not self.is_stepping, STEPS_LIMIT, "stand again")
            self.settle("stand again", modes.standing)

    def let_pass(self, seconds: float) -> None:
        """Let time pass, whatever happens in it."""
        end = self.loop.state.time + seconds - ROUNDING
        while self.loop.state.time < end:
            self.advance_until(lambda: False, end - self.loop.state.time)

    def give_up(self, reason: str) -> NoReturn:
        """Go limp; the robot counts as fallen."""
        self.between_ticks(lambda: self.loop.abandon(Fault(reason, is_fall=True)))
        raise self._aborted(reason)

    def measurements(self) -> Measurements:
        """What is measured now."""
        return modes.posture_measurements(self.loop.snapshot)

    def _aborted(self, reason: str) -> Aborted:
        return Aborted(reason, self.measurements())

    # --- how time passes ------------------------------------------------------------------------

    def _hanging(self) -> PlantTimeout:
        return PlantTimeout(f"the plant has kept the loop waiting for more than {HANG_LIMIT:g} s")

    def _obey(self) -> None:
        if self._stopping:
            raise ClosedError("the controller was closed during a call")
        self._obey_interruption()

    def _obey_interruption(self) -> bool:
        """Whether there was one."""
        reason, self._interruption = self._interruption, None
        if reason is None:
            return False
        fault = self.loop.fault
        self.loop.abandon(Fault(reason, is_fall=fault is not None and fault.is_fall))
        return True

    def _keep_pace(self) -> None:
        are_frozen = gc.get_freeze_count() > 0  # a program's own objects, which stay so
        gc.freeze()  # else a collection looks through all that was imported, for tens of ms
        try:
            self._tick_at_pace()
        except BaseException as error:  # whatever it is, a waiting call ends with it
            self._fail(error)
        finally:
            self._errands.end()
            if not are_frozen:
                gc.unfreeze()

    def _tick_at_pace(self) -> None:
        pacer = Pacer(self.loop.plant.control_period, GREATEST_LAG, LEAST_PAUSE)
        while not self._stopping:
            self._obey_interruption()
            self.loop.tick()
            self._after_tick()
            self._errands.serve()
            lag = pacer.wait()
            self.loop.telemetry.missed_deadlines = pacer.missed
            if lag:
                self.loop.warn("the loop is %.0f ms behind the wall clock", 1000 * lag)
        self.loop.go_limp()  # ``close`` may have given up waiting for this

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
        if self._thread is None:
            self._hold(self.loop.go_limp)
        elif self._is_in_background:
            self._thread.join(HANG_LIMIT)
            if self._thread.is_alive():
                _log.warning("%s; left behind", self._hanging())
        if self._lines is not None:
            self._lines.close()
