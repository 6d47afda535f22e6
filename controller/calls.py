"""Blocking calls: one at a time, each ends in an outcome, whatever ends it."""

from __future__ import annotations

import logging
import threading
from collections.abc import Callable
from typing import final

from controller.modes import Mode, Outcome
from controller.pilot import Pilot
from controller.procedures import Aborted, Measurements, interruption
from controller.runner import Runner
from go2_wbc.errors import Go2WbcError, ModeError

_log = logging.getLogger(__name__)


@final
class Calls:
    """Turns procedures of a pilot into calls that say True or False.

    Attributes:
        last: what came of the last call.
    """

    def __init__(self, pilot: Pilot, runner: Runner) -> None:
        """Call procedures of ``pilot``, whose time passes on ``runner``."""
        self._pilot, self._runner = pilot, runner
        self._busy = threading.Lock()
        self._busy_with = ""
        self.last = Outcome(True, "lying, nothing asked yet", 0.0)

    @property
    def is_running(self) -> bool:
        """Whether a call runs now, in any thread."""
        return self._busy.locked()

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
        if not self._busy.acquire(blocking=False):
            raise ModeError(f"{name}() while {self._busy_with}() is still running")
        loop = self._runner.loop
        self._busy_with, start = name, loop.state.time
        ok, reason = False, ""
        measured: Measurements = {}
        try:
            self._pilot.begin()
            measured = procedure()
            ok, reason = True, "done"
        except Aborted as aborted:
            reason, measured = str(aborted), aborted.measured
        except Go2WbcError as error:
            reason = str(error)
            raise
        except BaseException as error:
            reason = interruption(name, error)
            self._pilot.collapse(reason)
            reason = f"{reason}, damped"
            raise
        finally:
            self.last = Outcome(ok, reason, loop.state.time - start, dict(measured))
            fault = loop.fault
            is_known = fault is not None and fault.reason in reason  # the loop has logged it
            if not (ok or is_known):
                _log.warning("%s", reason)
            self._busy.release()
        return ok
