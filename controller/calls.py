"""Blocking calls: one at a time, each ends in an outcome, whatever ends it."""

from __future__ import annotations

import logging
import threading
from collections.abc import Callable
from dataclasses import dataclass
from typing import final

from controller.modes import Aborted, Measurements, Mode, Outcome
from controller.pilot import Pilot
from controller.runner import Runner
from go2_wbc.errors import Go2WbcError, ModeError

_log = logging.getLogger(__name__)


@dataclass(frozen=True, slots=True, eq=False)
class _Call:
    name: str
    start: float


@final
class Calls:
    """Turns procedures of a pilot into calls that say True or False.

    Attributes:
        last: what came of the last call.
    """

    def __init__(self, pilot: Pilot, runner: Runner) -> None:
        """Call procedures of ``pilot``, whose time passes on ``runner``."""
        self._pilot, self._runner = pilot, runner
        self._starting = threading.Lock()
        self._running: _Call | None = None
        self.last = Outcome(True, "lying, nothing asked yet", 0.0)

    @property
    def is_running(self) -> bool:
        """Whether a call runs now, in any thread."""
        return self._running is not None

    def make(
        self, name: str, procedure: Callable[[], Measurements], *, allow_fallen: bool = False
    ) -> bool:
        """Run ``procedure`` to its end; returns whether it was done.

        An error that is not of this project, Ctrl-C included, leaves the robot limp.

        Args:
            name: of the call.
            procedure: measures what it has done, or raises ``Aborted``.
            allow_fallen: whether a robot that has fallen may be asked.

        Raises:
            ModeError: while another call runs, or for a robot that has fallen.
        """
        if self._pilot.mode is Mode.FALLEN and not allow_fallen:
            raise ModeError(f"{name}() needs a robot that has not fallen: call recover() first")
        call = _Call(name, self._runner.loop.state.time)
        try:  # Ctrl-C may come anywhere: whose turn it is must be seen from what is stored
            self._take_turn(call)
            return self._run(call, procedure)
        except Go2WbcError:
            raise
        except BaseException as error:
            reason = _interruption(name, error)
            try:
                self._pilot.collapse(reason)
                reason = f"{reason}, damped"
            finally:
                self._note(call, reason)
            raise
        finally:
            if self._running is call:
                self._running = None

    def _take_turn(self, call: _Call) -> None:
        with self._starting:
            running = self._running
            if running is None:
                self._running = running = call
        if running is not call:
            raise ModeError(f"{call.name}() while {running.name}() is still running")

    def _run(self, call: _Call, procedure: Callable[[], Measurements]) -> bool:
        try:
            self._pilot.begin()
            measured = procedure()
        except Aborted as aborted:
            self._note(call, str(aborted), aborted.measured)
            return False
        except Go2WbcError as error:
            self._note(call, str(error))
            raise
        self._note(call, "done", measured, ok=True)
        return True

    def _note(
        self, call: _Call, reason: str, measured: Measurements | None = None, *, ok: bool = False
    ) -> None:
        """What came of ``call``."""
        loop = self._runner.loop
        self.last = Outcome(ok, reason, loop.state.time - call.start, dict(measured or {}))
        fault = loop.fault
        is_known = fault is not None and fault.reason in reason  # the loop has logged it
        if not (ok or is_known):
            _log.warning("%s", reason)


def _interruption(name: str, error: BaseException) -> str:
    """Why the call ``name`` ended by ``error``, in plain words."""
    if isinstance(error, KeyboardInterrupt):
        return f"interrupted during {name}()"
    return f"{type(error).__name__} during {name}(): {error}"
