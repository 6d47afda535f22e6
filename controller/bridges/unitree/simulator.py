"""A simulated Go2 that speaks Unitree's protocol as the robot does: sport service, low level."""

from __future__ import annotations

import json
import logging
import sys
from dataclasses import dataclass
from pathlib import Path
from typing import Final, final

from controller.bridges.unitree.bus import Bus
from controller.bridges.unitree.codec import Reply, Request
from controller.bridges.unitree.low_level import CommandGate
from controller.bridges.unitree.rpc import Lease, Server
from controller.bridges.unitree.served_plant import ServedPlant
from controller.bridges.unitree.sport_api import (
    SPORT_SERVICE,
    SWITCHER_SERVICE,
    Code,
    SwitcherApi,
)
from controller.bridges.unitree.sport_robot import SportRobot
from controller.bridges.unitree.sport_service import SportService
from controller.pacing import SWITCH_INTERVAL
from go2_wbc.config import Config, load_config
from go2_wbc.errors import BridgeError
from go2_wbc.plant import MujocoPlant
from go2_wbc.robot.model import RobotModel

_log = logging.getLogger(__name__)

DISCOVERY: Final = 0.5
"""Time [s] that another robot gets to be heard; some hundredths on an idle machine."""


@dataclass(frozen=True, slots=True)
class SimulatorSettings:
    """Where the simulator is found, and what it simulates.

    Attributes:
        domain: DDS domain; 1 is that of simulators, as in ``unitree_mujoco``, 0 the robot's.
        interface: network interface.
        mjcf: a user's own Go2 model or scene.
        friction: of the feet; None is the model's.
        payload: extra mass [kg].
        sensors: "ideal", "noisy" or "imu", as of ``MujocoPlant``.
        seed: of the noise.
        config: TOML with other numbers.
        lockstep: under low-level control let time pass only command by command.
    """

    domain: int = 1
    interface: str = "lo"
    mjcf: Path | None = None
    friction: float | None = None
    payload: float = 0.0
    sensors: str = "ideal"
    seed: int = 0
    config: Path | None = None
    lockstep: bool = False


@final
class UnitreeSimulator:
    """Serves a simulated robot until it is closed.

    Attributes:
        gate: who has the motors, with the counts of good and refused commands.
    """

    def __init__(self, settings: SimulatorSettings) -> None:
        """Start serving.

        Raises:
            CommandError: for a domain or interface that does not exist.
            BridgeError: if there is a robot on the domain already, real or simulated.
        """
        sys.setswitchinterval(SWITCH_INTERVAL)
        config = Config() if settings.config is None else load_config(settings.config)
        _require_no_robot(settings.domain, settings.interface)
        bus = Bus(settings.domain, settings.interface)
        inner = MujocoPlant(
            settings.mjcf,
            friction=settings.friction,
            payload=settings.payload,
            sensors=settings.sensors,
            seed=settings.seed,
            motor=config.motor,
            estimator=config.estimator,
        )
        model = RobotModel()
        self.gate = CommandGate(model.q_lower, model.q_upper)
        self._plant = ServedPlant(inner, bus, self.gate, lockstep=settings.lockstep)
        self._robot = SportRobot(self._plant, config)
        self._is_released = False
        self._sport = SportService(self._robot, lambda: self._is_released or self.gate.is_active)
        self._lease = Lease()
        self._servers = (
            Server(bus, SPORT_SERVICE, self._handle_sport, self._patrol),
            Server(bus, f"{SPORT_SERVICE}_lease", self._lease.handle),
            Server(bus, SWITCHER_SERVICE, self._handle_switcher),
        )

    @property
    def is_alive(self) -> bool:
        """Whether the simulation goes on."""
        return self._robot.is_alive

    def close(self) -> None:
        """Go limp and stop serving; idempotent."""
        for server in self._servers:
            server.close()
        self._sport.close()
        self._robot.close()
        self._plant.close()

    def _patrol(self) -> None:
        self._sport.patrol()
        self.gate.is_open = self._is_released or self._sport.is_idle
        self._plant.status = self._sport.status

    def _handle_sport(self, request: Request, reply: Reply) -> None:
        if self._lease.allows(request):
            self._sport.handle(request, reply)
        else:
            reply(Code.LEASE_DENIED, "")

    def _handle_switcher(self, request: Request, reply: Reply) -> None:
        """Hands the robot to low-level control and back, as ``MotionSwitcherClient`` asks."""
        if request.api_id == SwitcherApi.CHECK_MODE:
            name = "" if self._is_released else "normal"
            reply(Code.OK, json.dumps({"form": "0", "name": name}))
        elif request.api_id == SwitcherApi.RELEASE_MODE:
            self._is_released = self._is_released or self._sport.is_idle
            reply(Code.OK if self._is_released else Code.NOT_READY, "")
        elif request.api_id == SwitcherApi.SELECT_MODE:
            self._is_released = False
            reply(Code.OK, "")
        else:
            reply(Code.NOT_SUPPORTED, "")


def _require_no_robot(domain: int, interface: str) -> None:
    """Raise BridgeError if somebody publishes ``rt/lowstate``: two would answer every call."""
    states = Bus(domain, interface).reader("rt/lowstate", depth=1)
    if states.wait(DISCOVERY):  # not its writer: the C++ SDK has one and uses it for nothing
        raise BridgeError(
            f"a robot is already on DDS domain {domain}, interface {interface}; "
            "choose another --domain, or end the other simulator"
        )
