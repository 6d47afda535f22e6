"""What stands between controller and motors: limits, a soft start, reasons to stop."""

from __future__ import annotations

import math
from dataclasses import dataclass, fields
from typing import Final, final

import numpy as np

from controller.behaviours.joints import DAMPING
from controller.bridges.unitree import messages
from go2_wbc.errors import CommandError
from go2_wbc.robot.model import RobotModel
from go2_wbc.robot.state import JointCommand, RobotState
from go2_wbc.validation import POSITIVE, ranged

_BOUNDS: Final = (
    ("kp", 0.0, messages.KP_MAX),
    ("kd", 0.0, messages.KD_MAX),
    ("v_des", -messages.SPEED_MAX, messages.SPEED_MAX),
)


@dataclass(frozen=True, slots=True)
@ranged(POSITIVE)
class GuardConfig:
    """When a command is softened, and when the robot is damped for good.

    Attributes:
        stale_limit: time [s] without a good ``rt/lowstate`` after which the robot is damped.
        hang_limit: time [s] without a command of the controller after which it is.
        tilt_limit: tilt [rad] of the trunk from which on it is.
        joint_margin: angle [rad] beyond a joint's limit from which on it is.
        ramp_time: time [s] over which torque and stiffness grow after the robot was limp.
        limp_time: time [s] of limpness after which they have to grow anew.
        lying_height: height [m] of the base over the ground below which the robot lies.
        lying_tilt: tilt [rad] up to which it lies on its belly.
    """

    stale_limit: float = 0.03
    hang_limit: float = 0.1
    tilt_limit: float = 1.2
    joint_margin: float = 0.15
    ramp_time: float = 0.5
    limp_time: float = 0.3
    lying_height: float = 0.16
    lying_tilt: float = 0.5


def is_passive(command: JointCommand) -> bool:
    """Whether a command can only brake."""
    return not (command.tau.any() or command.kp.any() or command.v_des.any())


def require_sane(command: JointCommand) -> None:
    """Raise CommandError, naming the part, unless a command is finite and its gains are meant."""
    for name in (field.name for field in fields(JointCommand)):
        values = getattr(command, name)
        if values.shape != (12,) or not np.isfinite(values).all():
            raise CommandError(f"{name} must be 12 finite numbers, got {values}")
    for name, least, greatest in _BOUNDS:
        values = getattr(command, name)
        if values.min() < least or values.max() > greatest:
            raise CommandError(f"{name} must be from {least:g} to {greatest:g}, got {values}")


@final
class Guards:
    """Judges states and softens commands for one robot."""

    def __init__(self, model: RobotModel, config: GuardConfig) -> None:
        """Guard ``model``'s robot."""
        self._config = config
        limits = model.pin_model
        self._lower = np.array(limits.lowerPositionLimit[7:])
        self._upper = np.array(limits.upperPositionLimit[7:])
        self._motor = model.motor
        self._limp_since = -math.inf
        self._active_since: float | None = None

    def fault(self, state: RobotState) -> str | None:
        """Why a robot in this state must be damped, or None."""
        if not (np.isfinite(state.q).all() and np.isfinite(state.v).all()):
            return "the measured state is not finite"
        if state.tilt > self._config.tilt_limit:
            roll, pitch, _ = np.degrees(state.rpy)
            return f"tilted: roll {roll:.0f} deg, pitch {pitch:.0f} deg"
        q = state.joint_positions
        beyond = np.maximum(self._lower - q, q - self._upper)
        if beyond.max() > self._config.joint_margin:
            worst = int(beyond.argmax())
            return f"joint {worst} is {beyond[worst]:.2f} rad beyond its limit"
        return None

    def soften(self, command: JointCommand, state: RobotState) -> JointCommand:
        """``command`` within what the motors give, not pushing past a joint's limit, ramped in."""
        if is_passive(command):
            if self._active_since is not None:
                self._active_since, self._limp_since = None, state.time
            return command
        if self._active_since is None:
            has_rested = state.time - self._limp_since > self._config.limp_time
            self._active_since = state.time if has_rested else -math.inf
        share = min(1.0, (state.time - self._active_since) / self._config.ramp_time)
        q = state.joint_positions
        tau = np.clip(command.tau, *self._motor.limits(state.joint_velocities))
        tau = np.where(q >= self._upper, np.minimum(tau, 0.0), tau)
        tau = np.where(q <= self._lower, np.maximum(tau, 0.0), tau)
        return JointCommand(
            tau=share * tau,
            q_des=np.clip(command.q_des, self._lower, self._upper),
            v_des=share * command.v_des,
            kp=share * command.kp,
            kd=np.maximum(command.kd, (1.0 - share) * DAMPING),
        )
