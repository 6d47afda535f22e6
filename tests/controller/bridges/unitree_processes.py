"""Processes that talk Unitree's protocol on the loopback, and what watches them."""

from __future__ import annotations

import itertools
import json
import os
import re
import socket
import time
from collections.abc import Iterator
from contextlib import contextmanager
from typing import TYPE_CHECKING, Final

import numpy as np
from jaxtyping import Shaped

from controller.bridges.unitree.messages import SPORT_STATE, decode_message
from controller.bridges.unitree.sport_api import SPORT_SERVICE, Api, Code
from go2_wbc.errors import BridgeError, PlantTimeout
from tests.controller.bridges.processes import PROGRAM, START_LIMIT, Process, wait_until

if TYPE_CHECKING:
    from controller.bridges.unitree.bus import Bus
    from controller.bridges.unitree.rpc import Client

LOOPBACK: Final = "lo"
LIMIT: Final = 60.0  #: Time [s] that only ends what hangs
SPEED: Final = 0.5  #: Of ``Move`` and of the trot [m/s]
MOVE: Final = json.dumps({"x": SPEED, "y": 0.0, "z": 0.0})
DOMAINS: Final = range(100, 230)  #: DDS domains of which each scene takes one
DISCOVERY_PORTS: Final = (7400, 7401)
"""UDP ports that a participant of domain 0 shares; 250 more for each domain (RTPS 2.5, 9.6.1)."""
_LOCK_PORT: Final = 27000
"""TCP port on the loopback that stands for domain 0: who has bound it has the domain."""
_tries = itertools.count(os.getpid())


@contextmanager
def own_domain() -> Iterator[int]:
    """A DDS domain that nobody else on this machine gets here; BridgeError if none is left."""
    for _ in DOMAINS:
        domain = DOMAINS[next(_tries) % len(DOMAINS)]
        with socket.socket() as lock:
            try:
                lock.bind(("127.0.0.1", _LOCK_PORT + domain))
                for port in DISCOVERY_PORTS:  # which any program's outgoing socket may hold
                    with socket.socket(type=socket.SOCK_DGRAM) as probe:
                        probe.bind(("", port + 250 * domain))
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
    """A client of ``service`` that has got an answer from it; BridgeError if it gets none."""
    from controller.bridges.unitree.rpc import Client

    client = Client(bus, service)
    if not client.wait_for_server(START_LIMIT) or client.ask(Api.VERSION).code != Code.OK:
        raise BridgeError(f"the service {service} does not answer")
    return client


class Scene:
    """A simulator, what it says of itself (the truth), and a client of its sport service.

    Attributes:
        process: the simulator.
        domain: its DDS domain.
        bus: to write on.
        client: calls its sport service.
        largest_tilt: of all that was heard [deg].
    """

    def __init__(self, process: Process, domain: int) -> None:
        """Join the domain of a simulator that serves."""
        from controller.bridges.unitree.bus import Bus

        self.process, self.domain = process, domain
        self.bus = Bus(domain, LOOPBACK)
        self.largest_tilt = 0.0
        self._reader = self.bus.reader("rt/sportmodestate", depth=1000)
        self._newest: Shaped[np.ndarray, "1"] | None = None
        self.client = client_of(self.bus, SPORT_SERVICE)

    def take(self) -> list[Shaped[np.ndarray, "1"]]:
        """All ``rt/sportmodestate`` since the last call, oldest first."""
        messages = [decode_message(SPORT_STATE, data) for data in self._reader.take()]
        for message in messages:
            self._newest = message
            self.largest_tilt = max(self.largest_tilt, float(np.degrees(tilt_of(message))))
        return messages

    def now(self) -> Shaped[np.ndarray, "1"]:
        """The newest ``rt/sportmodestate``; PlantTimeout if there is none."""
        wait_until(lambda: bool(self.take()), 2.0)
        if self._newest is None:
            raise PlantTimeout("nobody publishes rt/sportmodestate")
        return self._newest

    @property
    def height(self) -> float:
        """Of the base [m]."""
        return float(self.now()["body_height"][0])

    @property
    def speed(self) -> float:
        """Horizontal speed [m/s] of the base."""
        return float(np.linalg.norm(self.now()["velocity"][0, :2]))

    @property
    def mode(self) -> int:
        """See ``SportMode``."""
        return int(self.now()["mode"][0])

    def call(self, api: int, parameter: str = "{}") -> int:
        """The code that a call of the sport service is answered with."""
        return self.client.call(api, parameter, timeout=10.0).code

    def wait_for_rest(self) -> bool:
        """Wait until no action runs."""
        time.sleep(0.1)
        return wait_until(lambda: not self.now()["progress"][0], LIMIT)


@contextmanager
def scene(*options: str) -> Iterator[Scene]:
    """A simulator with these options, and what is needed to watch it."""
    with own_domain() as domain, simulator(domain, *options) as process:
        yield Scene(process, domain)


def tilt_of(message: Shaped[np.ndarray, "1"]) -> float:
    """Larger of roll and pitch [rad] in a ``rt/sportmodestate``."""
    return float(np.abs(message["imu_state"]["rpy"][0, :2]).max())
