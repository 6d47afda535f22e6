"""Processes that talk Unitree's protocol on the loopback, and an observer of their bus."""

from __future__ import annotations

import os
import re
import shutil
import signal
import subprocess
import sys
import threading
import time
from collections.abc import Callable, Sequence
from types import TracebackType
from typing import Final, final

import numpy as np
from jaxtyping import Shaped

from controller.bridges.unitree.extra import require_dds
from go2_wbc.errors import PlantTimeout

LOOPBACK: Final = "lo"
START_LIMIT: Final = 60.0
"""Time [s] in which a process must be ready; a loaded machine needs many."""
PROGRAM: Final = (sys.executable, "-m", "controller.cli.main")


def realtime_prefix() -> tuple[str, ...]:
    """What lets a process keep its pace on a busy machine, where the system allows it."""
    may = shutil.which("chrt") is not None and os.geteuid() == 0
    return ("chrt", "-f", "10") if may else ()


@final
class Process:
    """A child process whose output is collected; killed at the end of the ``with`` block."""

    def __init__(self, command: Sequence[str]) -> None:
        """Start ``command``."""
        self.lines: list[str] = []
        self._process = subprocess.Popen(
            [*realtime_prefix(), *command],
            stdin=subprocess.DEVNULL,
            stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT,
            text=True,
        )
        self._reader = threading.Thread(target=self._read, daemon=True)
        self._reader.start()

    def _read(self) -> None:
        stream = self._process.stdout
        if stream is None:
            return
        with stream:
            for line in stream:
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
        """Wait until the process has said ``text``.

        Raises:
            PlantTimeout: if it does not, or ends before.
        """
        wait_until(lambda: text in self.text or self.code is not None, limit)
        if text not in self.text:
            raise PlantTimeout(f"the process did not say {text!r} but: {self.text}")

    def kill(self) -> None:
        """End it as hard as possible, in the middle of whatever it does."""
        self._process.kill()
        self._process.wait()

    def stop(self) -> str:
        """End it politely; returns everything that it has said."""
        if self.code is None:
            self._process.send_signal(signal.SIGTERM)
        return self.finish(10.0)

    def finish(self, limit: float) -> str:
        """Wait for its end, for ``limit`` seconds at most; returns everything that it has said."""
        try:
            self._process.wait(limit)
        except subprocess.TimeoutExpired:
            self.kill()
        self._reader.join(5.0)
        return self.text

    def __enter__(self) -> Process:
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        if self.code is None:
            self.kill()
        self._reader.join(5.0)


def simulator(domain: int, *options: str) -> Process:
    """A ``go2-wbc unitree-sim`` that serves.

    Raises:
        PlantTimeout: if it does not start.
    """
    process = Process([*PROGRAM, "unitree-sim", "--domain", str(domain), *options])
    try:
        process.wait_for("serving on")
    except PlantTimeout:
        process.kill()
        raise
    return process


def driver(domain: int, *options: str) -> Process:
    """A ``go2-wbc unitree-drive`` on the loopback."""
    consent = "--i-have-the-remote-in-hand"
    where = ["--interface", LOOPBACK, "--domain", str(domain)]
    return Process([*PROGRAM, "unitree-drive", *where, consent, "--json", *options])


def good_commands(text: str) -> int:
    """How many low-level commands a simulator that has ended says were good."""
    found = re.search(r"low-level commands: (\d+) good", text)
    return int(found[1]) if found else 0


def wait_until(is_so: Callable[[], bool], limit: float) -> bool:
    """Whether it became so within ``limit`` seconds."""
    deadline = time.monotonic() + limit
    while not is_so():
        if time.monotonic() > deadline:
            return False
        time.sleep(0.02)
    return True


@final
class Observer:
    """Listens to a domain: what the robot says of itself, which for a simulator is the truth.

    Attributes:
        bus: to write on, for tests.
    """

    def __init__(self, domain: int) -> None:
        """Listen on the loopback."""
        require_dds()
        from controller.bridges.unitree import idl
        from controller.bridges.unitree.bus import Bus
        from controller.bridges.unitree.codec import codec_of
        from controller.bridges.unitree.layout import SPORT_STATE

        self.bus = Bus(domain, LOOPBACK)
        self._reader = self.bus.reader("rt/sportmodestate", idl.sport_state(), depth=1000)
        self._decode = codec_of(SPORT_STATE).decode
        self._newest: Shaped[np.ndarray, "1"] | None = None

    def take(self) -> list[Shaped[np.ndarray, "1"]]:
        """All ``rt/sportmodestate`` since the last call, oldest first."""
        messages = [self._decode(data) for data in self._reader.take()]
        if messages:
            self._newest = messages[-1]
        return messages

    def now(self) -> Shaped[np.ndarray, "1"]:
        """The newest ``rt/sportmodestate``.

        Raises:
            PlantTimeout: if there is none.
        """
        wait_until(lambda: bool(self.take()), 2.0)
        if self._newest is None:
            raise PlantTimeout("nobody publishes rt/sportmodestate")
        return self._newest

    @property
    def height(self) -> float:
        """Of the base [m]."""
        return float(self.now()["body_height"][0])

    @property
    def tilt(self) -> float:
        """Largest of roll and pitch [rad]."""
        return float(np.abs(self.now()["imu_state"]["rpy"][0, :2]).max())

    @property
    def mode(self) -> int:
        """See ``SportMode``."""
        return int(self.now()["mode"][0])

    def wait_for_rest(self, limit: float = 60.0) -> bool:
        """Wait until no action runs."""
        time.sleep(0.1)
        return wait_until(lambda: not self.now()["progress"][0], limit)
