"""Processes that talk Unitree's protocol on the loopback, and an observer of their bus."""

from __future__ import annotations

import itertools
import os
import re
import socket
import time
from collections.abc import Iterator
from contextlib import contextmanager
from typing import TYPE_CHECKING, Final, final

import numpy as np
from jaxtyping import Shaped

from benchmarks.bridges.processes import PROGRAM, START_LIMIT, Process, wait_until
from controller.bridges.unitree.extra import require_dds
from controller.bridges.unitree.sport_api import Api, Code
from go2_wbc.errors import BridgeError, PlantTimeout

if TYPE_CHECKING:
    from controller.bridges.unitree.bus import Bus
    from controller.bridges.unitree.rpc import Client

LOOPBACK: Final = "lo"
DOMAINS: Final = range(100, 230)
"""DDS domains of which each scene takes one."""
_LOCK_PORT: Final = 27000
"""TCP port on the loopback that stands for domain 0: who has bound it has the domain."""
_tries = itertools.count(os.getpid())


@contextmanager
def own_domain() -> Iterator[int]:
    """A DDS domain that nobody else who asks here, on this machine, has meanwhile.

    Raises:
        BridgeError: if there is none left.
    """
    for _ in DOMAINS:
        domain = DOMAINS[next(_tries) % len(DOMAINS)]
        with socket.socket() as lock:
            try:
                lock.bind(("127.0.0.1", _LOCK_PORT + domain))
            except OSError:
                continue
            yield domain
            return
    raise BridgeError("no DDS domain is left")


def simulator(domain: int, *options: str) -> Process:
    """A ``go2-wbc unitree-sim``; the ``with`` block begins when it serves."""
    command = [*PROGRAM, "unitree-sim", "--domain", str(domain), *options]
    return Process(command, says="serving on")


def driver(domain: int, *options: str) -> Process:
    """A ``go2-wbc unitree-drive`` on the loopback."""
    consent = "--i-have-the-remote-in-hand"
    where = ["--interface", LOOPBACK, "--domain", str(domain)]
    return Process([*PROGRAM, "unitree-drive", *where, consent, "--json", *options])


def good_commands(text: str) -> int:
    """How many low-level commands a simulator that has ended says were good."""
    found = re.search(r"low-level commands: (\d+) good", text)
    return int(found[1]) if found else 0


def client_of(bus: Bus, service: str) -> Client:
    """A client of ``service`` that has got an answer from it.

    Raises:
        BridgeError: if it gets none.
    """
    from controller.bridges.unitree.rpc import Client

    client = Client(bus, service)
    if not client.wait_for_server(START_LIMIT) or client.ask(Api.VERSION).code != Code.OK:
        raise BridgeError(f"the service {service} does not answer")
    return client


@final
class Observer:
    """Listens to a domain: what the robot says of itself, which for a simulator is the truth.

    Attributes:
        bus: to write on.
        largest_tilt: of all that was heard [deg].
    """

    def __init__(self, domain: int) -> None:
        """Listen on the loopback."""
        require_dds()
        from controller.bridges.unitree.bus import Bus
        from controller.bridges.unitree.codec import codec_of
        from controller.bridges.unitree.layout import SPORT_STATE

        self.bus = Bus(domain, LOOPBACK)
        self._reader = self.bus.reader("rt/sportmodestate", depth=1000)
        self._decode = codec_of(SPORT_STATE).decode
        self._newest: Shaped[np.ndarray, "1"] | None = None
        self.largest_tilt = 0.0

    def take(self) -> list[Shaped[np.ndarray, "1"]]:
        """All ``rt/sportmodestate`` since the last call, oldest first."""
        messages = [self._decode(data) for data in self._reader.take()]
        for message in messages:
            self._newest = message
            self.largest_tilt = max(self.largest_tilt, float(np.degrees(tilt_of(message))))
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
        """Larger of roll and pitch [rad]."""
        return tilt_of(self.now())

    @property
    def speed(self) -> float:
        """Horizontal speed [m/s] of the base."""
        return float(np.linalg.norm(self.now()["velocity"][0, :2]))

    @property
    def mode(self) -> int:
        """See ``SportMode``."""
        return int(self.now()["mode"][0])

    def wait_for_rest(self, limit: float = 60.0) -> bool:
        """Wait until no action runs."""
        time.sleep(0.1)
        return wait_until(lambda: not self.now()["progress"][0], limit)


def tilt_of(message: Shaped[np.ndarray, "1"]) -> float:
    """Larger of roll and pitch [rad] in a ``rt/sportmodestate``."""
    return float(np.abs(message["imu_state"]["rpy"][0, :2]).max())
