"""A simulated Go2 that speaks Unitree's protocol as the robot does: sport service, low level."""

from __future__ import annotations

import json
import logging
import sys
import time
from dataclasses import dataclass
from pathlib import Path
from typing import Final, final

import numpy as np
from jaxtyping import Shaped

from controller.bridges.unitree import LOOPBACK, messages, sport_api
from controller.bridges.unitree.bus import Bus
from controller.bridges.unitree.low_level import CommandGate, fill_imu, low_state_message
from controller.bridges.unitree.messages import Reply, Request, encode_message
from controller.bridges.unitree.rpc import Lease, Server
from controller.bridges.unitree.sport_robot import SportRobot
from controller.bridges.unitree.sport_service import SportService
from controller.pacing import SWITCH_INTERVAL, Pacer
from go2_wbc.config import Config, load_config
from go2_wbc.errors import BridgeError
from go2_wbc.plant import MujocoPlant, Plant
from go2_wbc.plant.sensors import ImuSample
from go2_wbc.robot.model import RobotModel
from go2_wbc.robot.state import JointCommand, RobotState

_log = logging.getLogger(__name__)

DISCOVERY: Final = 0.5
"""Time [s] that another robot gets to be heard; some hundredths on an idle machine."""
SPORT_STATE_TICKS: Final = 10  #: Control periods between two samples of ``rt/sportmodestate``
COMMAND_QUEUE: Final = 512
"""Low-level commands that are looked at in one tick; of more, the oldest are lost. Garbage at 5 kHz
must not push out the good ones while a process is paused for a moment."""
LOCKSTEP_LIMIT: Final = 1.0
"""Time [s] for which a simulator in lockstep waits for the next good low-level command."""
CATCH_UP: Final = 0.9
"""Share of a control period that passes at least between two ticks under low-level control: a
simulator that is late must not run ahead of its peer's commands to catch up."""


@dataclass(frozen=True, slots=True)
class SimulatorSettings:
    """Where the simulator is found, and what it simulates."""

    domain: int = 1  #: DDS domain; 1 is that of simulators, as in ``unitree_mujoco``, 0 the robot's
    interface: str = LOOPBACK  #: network interface
    mjcf: Path | None = None  #: a user's own Go2 model or scene
    friction: float | None = None  #: of the feet; None is the model's
    payload: float = 0.0  #: extra mass [kg]
    sensors: str = "ideal"  #: "ideal", "noisy" or "imu", as of ``MujocoPlant``
    seed: int = 0  #: of the noise
    config: Path | None = None  #: TOML with other numbers
    lockstep: bool = False  #: under low-level control let time pass only command by command


@final
class UnitreeSimulator:
    """Serves a simulated robot until it is closed."""

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
        self.gate = CommandGate(model.q_lower, model.q_upper)  #: who has the motors
        self._plant = ServedPlant(inner, bus, self.gate, lockstep=settings.lockstep)
        self._robot = SportRobot(self._plant, config)
        self._is_released = False
        self._sport = SportService(self._robot, lambda: self._is_released or self.gate.is_active)
        self._lease = Lease()
        self._servers = (
            Server(bus, sport_api.SPORT_SERVICE, self._handle_sport, self._patrol),
            Server(bus, f"{sport_api.SPORT_SERVICE}_lease", self._lease.handle),
            Server(bus, sport_api.SWITCHER_SERVICE, self._handle_switcher),
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
            reply(sport_api.Code.LEASE_DENIED, "")

    def _handle_switcher(self, request: Request, reply: Reply) -> None:
        """Hands the robot to low-level control and back, as ``MotionSwitcherClient`` asks."""
        if request.api_id == sport_api.SwitcherApi.CHECK_MODE:
            name = "" if self._is_released else "normal"
            reply(sport_api.Code.OK, json.dumps({"form": "0", "name": name}))
        elif request.api_id == sport_api.SwitcherApi.RELEASE_MODE:
            self._is_released = self._is_released or self._sport.is_idle
            reply(sport_api.Code.OK if self._is_released else sport_api.Code.NOT_READY, "")
        elif request.api_id == sport_api.SwitcherApi.SELECT_MODE:
            self._is_released = False
            reply(sport_api.Code.OK, "")
        else:
            reply(sport_api.Code.NOT_SUPPORTED, "")


def _require_no_robot(domain: int, interface: str) -> None:
    """Raise BridgeError if somebody publishes ``rt/lowstate``: two would answer every call."""
    states = Bus(domain, interface).reader("rt/lowstate", depth=1)
    if states.wait(DISCOVERY):  # not its writer: the C++ SDK has one and uses it for nothing
        raise BridgeError(
            f"a robot is already on DDS domain {domain}, interface {interface}; "
            "choose another --domain, or end the other simulator"
        )


@final
class ServedPlant(Plant):
    """Hands everything on to a ``MujocoPlant``, publishes its state, obeys low-level commands.

    Attributes:
        gate: decides who has the motors.
        status: what ``rt/sportmodestate`` says besides.
    """

    def __init__(
        self, inner: MujocoPlant, bus: Bus, gate: CommandGate, *, lockstep: bool = False
    ) -> None:
        """Serve ``inner`` on ``bus``; with ``lockstep`` time waits for the low-level peer."""
        self._is_lockstep = lockstep
        self.gate, self.status = gate, sport_api.SportStatus()
        self._inner = inner
        self._commands = bus.reader("rt/lowcmd", depth=COMMAND_QUEUE)
        self._states = bus.writer("rt/lowstate")
        self._sport_states = bus.writer("rt/sportmodestate")
        self._ticks = 0
        self._pacer = Pacer(CATCH_UP * inner.control_period, late=0.0)

    @property
    def control_period(self) -> float:
        """Seconds that pass in one ``write``."""
        return self._inner.control_period

    def read(self) -> RobotState:
        """The simulator's true state, or the noisy one."""
        return self._inner.read()

    def write(self, command: JointCommand) -> None:
        """Apply ``command``, or what the low-level peer asks instead, and publish the new state."""
        self._hear()
        self._inner.write(self.gate.choose(command))
        state, imu = self._inner.read(), self._inner.imu()
        self._states.write(encode_message(low_state_message(state, imu)))
        if self._ticks % SPORT_STATE_TICKS == 0:
            message = sport_state_message(state, imu, self.status)
            self._sport_states.write(encode_message(message))
        self._ticks += 1

    def close(self) -> None:
        """Release everything; idempotent."""
        self._inner.close()

    def _hear(self) -> None:
        if not self.gate.is_active:
            self.gate.hear(self._commands.take())
        elif self._is_lockstep:
            deadline = time.monotonic() + LOCKSTEP_LIMIT
            while not self.gate.hear(self._commands.take()) and time.monotonic() < deadline:
                self._commands.wait(max(0.0, deadline - time.monotonic()))
        else:
            self._pacer.wait()
            self.gate.hear(self._commands.take())


def sport_state_message(
    state: RobotState, imu: ImuSample, status: sport_api.SportStatus
) -> Shaped[np.ndarray, "1"]:
    """``rt/sportmodestate``: position, velocity in the world, what the sport service is doing."""
    message = np.zeros(1, messages.SPORT_STATE)
    seconds = int(state.time)
    message["stamp"] = (seconds, round(1e9 * (state.time - seconds)))
    fill_imu(message["imu_state"], imu, state)
    message["mode"], message["error_code"] = status.mode, status.error_code
    message["progress"], message["gait_type"] = status.is_acting, status.is_trotting
    message["position"], message["body_height"] = state.q[:3], state.q[2]
    message["velocity"] = state.R_world_base @ state.v[:3]
    message["yaw_speed"] = imu.gyro[2]
    message["foot_force"] = np.rint(state.foot_forces[messages.FEET_SWAPPED])
    return message
