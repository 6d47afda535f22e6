"""Programs of this project as child processes: started, listened to, ended, killed."""

from __future__ import annotations

import functools
import os
import shutil
import signal
import subprocess
import sys
import threading
import time
from collections.abc import Callable, Mapping, Sequence
from contextlib import suppress
from typing import Final, final

from controller.sweeps.trials import TrialFailed
from go2_wbc.errors import BridgeError

START_LIMIT: Final = 60.0  #: Time [s] in which a process must be ready; a loaded machine needs many
PROGRAM: Final = (sys.executable, "-m", "controller.cli.main")
REALTIME: Final = ("chrt", "-f", "10")
"""What lets a process keep its pace on a busy machine, where the system allows it."""


@functools.cache
def realtime_prefix() -> tuple[str, ...]:
    """``REALTIME``, or nothing where it is not allowed."""
    if shutil.which(REALTIME[0]) is None:
        return ()
    may = subprocess.run([*REALTIME, "true"], capture_output=True, check=False).returncode == 0
    return REALTIME if may else ()


@final
class Process:
    """A child process whose output is collected; killed at the end of the ``with`` block."""

    def __init__(
        self,
        command: Sequence[str],
        environment: Mapping[str, str] | None = None,
        *,
        says: str = "",
        has_priority: bool = True,
        is_stopped: bool = False,
    ) -> None:
        """Start ``command``.

        Args:
            command: the program and its arguments.
            environment: its variables; None takes those of this process.
            says: what it says when it is ready; the ``with`` block begins then.
            has_priority: give it real-time priority, where that is allowed. Not for what never
                sleeps: it would leave nothing to the others.
            is_stopped: end it politely after a block without an error.
        """
        self.lines: list[str] = []
        self._says, self._is_stopped = says, is_stopped
        self._process = subprocess.Popen(
            [*(realtime_prefix() if has_priority else ()), *command],
            env=environment,
            stdin=subprocess.DEVNULL,
            stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT,
            text=True,
            start_new_session=True,  # kill() ends what it started as well
        )
        self._reader = threading.Thread(target=self._read, daemon=True)
        self._reader.start()

    def _read(self) -> None:
        for line in self._process.stdout or ():
            self.lines.append(line.rstrip())

    @property
    def text(self) -> str:
        """Everything that the process has said."""
        return "\n".join(self.lines)

    @property
    def code(self) -> int | None:
        """Its exit code, None while it runs."""
        return self._process.poll()

    def wait_for(self, text: str, limit: float = START_LIMIT) -> None:
        """Wait until the process has said ``text``; BridgeError if it does not."""
        wait_until(lambda: text in self.text or self.code is not None, limit)
        if self.code is not None:
            self._reader.join(5.0)
        if text not in self.text:
            raise BridgeError(f"the process did not say {text!r} but: {self.text}")

    def kill(self) -> None:
        """End it as hard as possible, in the middle of whatever it does."""
        with suppress(ProcessLookupError):
            os.killpg(self._process.pid, signal.SIGKILL)
        self._process.wait()

    def stop(self, by: signal.Signals = signal.SIGTERM) -> str:
        """End it politely; returns everything that it has said."""
        if self.code is None:
            self._process.send_signal(by)
        return self.finish(20.0)

    def finish(self, limit: float) -> str:
        """Wait for its end, for ``limit`` seconds at most; returns everything that it has said."""
        try:
            self._process.wait(limit)
        except subprocess.TimeoutExpired:
            self.kill()
        self._reader.join(5.0)
        return self.text

    def __enter__(self) -> Process:
        """Wait until it is ready; BridgeError if it does not say so."""
        try:
            self.wait_for(self._says)
        except BridgeError:
            self.__exit__(BridgeError)
            raise
        return self

    def __exit__(self, kind: type[BaseException] | None = None, *_: object) -> None:
        """End it, politely if that is wanted and there was no error."""
        if self._is_stopped and kind is None:
            self.stop()
        elif self.code is None:
            self.kill()
        self._reader.join(5.0)
        if self._process.stdout is not None:
            self._process.stdout.close()


def wait_until(is_so: Callable[[], bool], limit: float) -> bool:
    """Whether it became so within ``limit`` seconds."""
    deadline = time.monotonic() + limit
    while not is_so():
        if time.monotonic() > deadline:
            return False
        time.sleep(0.02)
    return True


def require(is_so: bool, why_not: str) -> None:
    """Raise ``TrialFailed`` with ``why_not`` unless it is so."""
    if not is_so:
        raise TrialFailed(why_not)
