"""A simulated Go2 that is also on Unitree's bus: every tick goes out, commands may come in."""

from __future__ import annotations

import time
from typing import Final, final

import numpy as np
from jaxtyping import Shaped

from controller.bridges.unitree import layout
from controller.bridges.unitree.bus import Bus
from controller.bridges.unitree.codec import encode_message
from controller.bridges.unitree.low_level import CommandGate, fill_imu, low_state_message
from controller.bridges.unitree.sport_api import SportStatus
from controller.pacing import Pacer
from go2_wbc.plant import MujocoPlant, Plant
from go2_wbc.plant.sensors import ImuSample
from go2_wbc.robot.state import JointCommand, RobotState

SPORT_STATE_TICKS: Final = 10
"""Control periods between two samples of ``rt/sportmodestate``."""
COMMAND_QUEUE: Final = 512
"""Low-level commands that are looked at in one tick; of more, the oldest are lost. Garbage at 5 kHz
must not push out the good ones while a process is paused for a moment."""
LOCKSTEP_LIMIT: Final = 1.0
"""Time [s] for which a simulator in lockstep waits for the next good low-level command."""
CATCH_UP: Final = 0.9
"""Share of a control period that passes at least between two ticks under low-level control: a
simulator that is late must not run ahead of its peer's commands to catch up."""


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
        self.gate, self.status = gate, SportStatus()
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
    state: RobotState, imu: ImuSample, status: SportStatus
) -> Shaped[np.ndarray, "1"]:
    """``rt/sportmodestate``: position, velocity in the world, what the sport service is doing."""
    message = layout.new_message(layout.SPORT_STATE)
    seconds = int(state.time)
    message["stamp"] = (seconds, round(1e9 * (state.time - seconds)))
    fill_imu(message["imu_state"], imu, state)
    message["mode"], message["error_code"] = status.mode, status.error_code
    message["progress"], message["gait_type"] = status.is_acting, status.is_trotting
    message["position"], message["body_height"] = state.q[:3], state.q[2]
    message["velocity"] = state.R_world_base @ state.v[:3]
    message["yaw_speed"] = imu.gyro[2]
    message["foot_force"] = np.rint(state.foot_forces[layout.FEET_SWAPPED])
    return message
