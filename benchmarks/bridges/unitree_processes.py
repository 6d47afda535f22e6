"""Processes that talk Unitree's protocol on the loopback, and what watches them."""

from __future__ import annotations

import itertools
import json
import os
import re
import socket
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import TYPE_CHECKING, Final, final

import numpy as np
from jaxtyping import Shaped

from benchmarks.bridges.processes import PROGRAM, START_LIMIT, Process, require, wait_until
from controller.bridges.unitree.codec import decode_message
from controller.bridges.unitree.layout import SPORT_STATE
from controller.bridges.unitree.sport_api import (
    SPORT_SERVICE,
    SWITCHER_SERVICE,
    Api,
    Code,
    SwitcherApi,
)
from go2_wbc.errors import BridgeError, PlantTimeout

if TYPE_CHECKING:
    from controller.bridges.unitree.bus import Bus
    from controller.bridges.unitree.rpc import Client

LOOPBACK: Final = "lo"
LIMIT: Final = 60.0
"""Time [s] that only ends what hangs."""
UPRIGHT: Final = 0.35
"""Tilt [rad] below which a robot that stands or lies is upright."""
STANDS, LIES = 0.25, 0.13
"""Height [m] of the base above which the robot stands, below which it lies."""
SPEED: Final = 0.5
"""Of ``Move`` and of the trot [m/s]."""
MOVE: Final = json.dumps({"x": SPEED, "y": 0.0, "z": 0.0})
FLOOD: Final = 5000.0
"""Samples per second."""
DOMAINS: Final = range(100, 230)
"""DDS domains of which each scene takes one."""
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


def flood(write: Callable[[int], None], seconds: float) -> None:
    """Call ``write`` with 0, 1, ..., 5000 times a second."""
    start, count = time.monotonic(), 0
    while (now := time.monotonic() - start) < seconds:
        while count < now * FLOOD:
            write(count)
            count += 1
        time.sleep(0.0005)


@final
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
        self._commands = self.bus.writer("rt/lowcmd")

    def take(self) -> list[Shaped[np.ndarray, "1"]]:
        """All ``rt/sportmodestate`` since the last call, oldest first."""
        messages = [decode_message(SPORT_STATE, data) for data in self._reader.take()]
        for message in messages:
            self._newest = message
            self.largest_tilt = max(self.largest_tilt, float(np.degrees(_tilt_of(message))))
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

    def stand_up(self) -> None:
        """Make the robot stand."""
        self.require_code(Api.RECOVERY_STAND)
        self.wait_for_rest()
        self.require_standing()

    def take_back(self) -> None:
        """Give the robot back to the sport service after low-level control."""
        switcher = client_of(self.bus, SWITCHER_SERVICE)
        code = switcher.call(SwitcherApi.SELECT_MODE, '{"name": "normal"}').code
        require(code == Code.OK, f"SelectMode was answered {code}")
        self.require_said("low-level control has ended")

    def flood(self, samples: list[bytes], seconds: float) -> None:
        """Write ``rt/lowcmd`` samples in turn, 5000 a second."""
        flood(lambda count: self._commands.write(samples[count % len(samples)]), seconds)

    def wait_for_rest(self) -> bool:
        """Wait until no action runs."""
        time.sleep(0.1)
        return wait_until(lambda: not self.now()["progress"][0], LIMIT)

    def require_code(self, api: Api, code: Code = Code.OK) -> None:
        """Make sure that a call of the sport service is answered with ``code``."""
        answered = self.call(api)
        require(answered == code, f"{api.name} was answered {answered}")

    def require_standing(self) -> None:
        """Make sure that the robot stands."""
        height, tilt = self.height, _tilt_of(self.now())
        stands = height > STANDS and tilt < UPRIGHT
        require(stands, f"the robot does not stand: {height:.2f} m, {np.degrees(tilt):.0f} deg")

    def require_lying(self) -> None:
        """Make sure that the robot comes to lie on its belly."""
        require(wait_until(lambda: self.height < LIES, LIMIT), "the robot is not limp")
        tilt = _tilt_of(self.now())
        require(tilt < UPRIGHT, f"the robot lies tilted by {np.degrees(tilt):.0f} deg")

    def require_said(self, *texts: str) -> None:
        """Make sure that the simulator reports these."""
        for text in texts:
            is_said = wait_until(lambda text=text: text in self.process.text, LIMIT)
            require(is_said, f"the simulator did not say {text!r}")

    def require_walking(self, peer: Process) -> None:
        """Make sure that ``peer`` gets the robot to walk."""
        walks = wait_until(lambda: self.speed > 0.4 or peer.code is not None, LIMIT)
        require(walks and peer.code is None, f"the robot does not walk: {peer.text}")


@contextmanager
def scene(*options: str) -> Iterator[Scene]:
    """A simulator with these options, and what is needed to watch it."""
    with own_domain() as domain, simulator(domain, *options) as process:
        yield Scene(process, domain)


def _tilt_of(message: Shaped[np.ndarray, "1"]) -> float:
    """Larger of roll and pitch [rad] in a ``rt/sportmodestate``."""
    return float(np.abs(message["imu_state"]["rpy"][0, :2]).max())
