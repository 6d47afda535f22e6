"""Low-level control: ``rt/lowcmd`` and ``rt/lowstate`` in both directions, and the robot's guards.

Commands are checked before they reach a motor. An invalid command is refused, counted and reported;
without a valid one for a while, the robot is damped.

Between the controller and the motors are guards: limits, a soft start, reasons to stop.
"""

from __future__ import annotations

import logging
import math
import time
from collections import Counter
from collections.abc import Callable
from dataclasses import dataclass, fields, replace
from typing import Final, final

import numpy as np
from jaxtyping import Float, Shaped

from controller.behaviours import DAMPING
from controller.bridges.unitree import messages
from controller.bridges.unitree.messages import FEET_SWAPPED, JOINTS_SWAPPED, MOTORS, decode_message
from controller.modes import LYING_TILT
from controller.pacing import LogThrottle
from go2_wbc.errors import CommandError
from go2_wbc.plant.sensors import ImuSample
from go2_wbc.robot.estimator import SensorReading
from go2_wbc.robot.model import RobotModel
from go2_wbc.robot.state import JointCommand, RobotState
from go2_wbc.validation import POSITIVE, ranged, retires

_log = logging.getLogger(__name__)

SILENCE: Final = 0.05  #: Time [s] without a good command after which the robot is damped
RELEASE: Final = 0.5  #: Time [s] without a good command after which low-level control has ended
ANGLE_MARGIN: Final = 0.1  #: Angle [rad] by which a desired angle may lie beyond the joint's limit
REPORT_PERIOD: Final = 1.0  #: Time [s] between two reports of the same kind


def intact_message(kind: np.dtype[np.void], data: bytes) -> Shaped[np.ndarray, "1"]:
    """A low-level message of the wire's bytes; CommandError if it is none, or damaged."""
    message = decode_message(kind, data)
    if not messages.is_intact(message):
        raise CommandError("wrong checksum")
    return message


def joint_command(
    message: Shaped[np.ndarray, "1"], lower: Float[np.ndarray, "12"], upper: Float[np.ndarray, "12"]
) -> JointCommand:
    """What a ``rt/lowcmd`` message asks of the motors, in our joint order.

    Raises:
        CommandError: if a value is not finite or out of limits.
    """
    motors = message["motor_cmd"][0, :MOTORS][JOINTS_SWAPPED]
    obeys = motors["mode"] == messages.SERVO
    q, dq, tau, kp, kd = (motors[name].astype(float) for name in ("q", "dq", "tau", "kp", "kd"))
    for name in ("q", "dq", "tau", "kp", "kd"):
        if not np.isfinite(motors[name]).all():
            raise CommandError(f"{name} is not finite")
    kp = np.where(obeys & (np.abs(q) < 0.5 * messages.POSITION_STOP), kp, 0.0)
    kd, tau = np.where(obeys, kd, 0.0), np.where(obeys, tau, 0.0)
    dq = np.where(np.abs(dq) >= messages.VELOCITY_STOP, 0.0, dq)
    q = np.where(kp > 0.0, q, 0.0)
    held = kp > 0.0
    for name, values, least, greatest in (
        ("kp", kp, 0.0, messages.KP_MAX),
        ("kd", kd, 0.0, messages.KD_MAX),
        ("tau", tau, -messages.TAU_MAX, messages.TAU_MAX),
        ("dq", dq, -messages.SPEED_MAX, messages.SPEED_MAX),
        ("q", q[held], lower[held] - ANGLE_MARGIN, upper[held] + ANGLE_MARGIN),
    ):
        outside = (values < least) | (values > greatest)
        if outside.any():
            raise CommandError(f"{name} out of limits: {values[outside][0]:.4g}")
    return JointCommand(tau, q, dq, kp, kd)


def low_state_message(state: RobotState, imu: ImuSample) -> Shaped[np.ndarray, "1"]:
    """``rt/lowstate`` of a state and what the IMU reads; battery, temperatures, remote are zero."""
    message = np.zeros(1, messages.LOW_STATE)
    message["head"], message["level_flag"] = messages.HEAD, messages.LOW_LEVEL
    fill_imu(message["imu_state"], imu, state)
    motors = message["motor_state"][0, :MOTORS]
    motors["mode"] = messages.SERVO
    motors["q"] = state.joint_positions[JOINTS_SWAPPED]
    motors["dq"] = state.joint_velocities[JOINTS_SWAPPED]
    motors["tau_est"] = state.tau[JOINTS_SWAPPED]
    message["foot_force"] = np.rint(state.foot_forces[FEET_SWAPPED])
    message["tick"] = round(1000 * state.time)
    messages.seal(message)
    return message


def fill_imu(target: Shaped[np.ndarray, "1"], imu: ImuSample, state: RobotState) -> None:
    """Write the IMU's part of a message; Unitree's quaternion is w x y z."""
    target["quaternion"] = imu.quaternion[[3, 0, 1, 2]]
    target["gyroscope"], target["accelerometer"] = imu.gyro, imu.accelerometer
    target["rpy"] = state.rpy


def low_cmd_message(command: JointCommand) -> Shaped[np.ndarray, "1"]:
    """``rt/lowcmd`` that asks for ``command``; motors that do not exist stay switched off."""
    message = np.zeros(1, messages.LOW_CMD)
    message["head"], message["level_flag"] = messages.HEAD, messages.LOW_LEVEL
    motors = message["motor_cmd"][0, :MOTORS]
    motors["mode"] = messages.SERVO
    motors["q"], motors["dq"] = command.q_des[JOINTS_SWAPPED], command.v_des[JOINTS_SWAPPED]
    motors["kp"], motors["kd"] = command.kp[JOINTS_SWAPPED], command.kd[JOINTS_SWAPPED]
    motors["tau"] = command.tau[JOINTS_SWAPPED]
    messages.seal(message)
    return message


def sensor_reading(message: Shaped[np.ndarray, "1"]) -> SensorReading:
    """What a ``rt/lowstate`` message says, in our order of legs and joints."""
    motors = message["motor_state"][0, :MOTORS][JOINTS_SWAPPED]
    imu = message["imu_state"][0]
    return SensorReading(
        time=0.001 * float(message["tick"][0]),
        gyro=imu["gyroscope"].astype(float),
        accelerometer=imu["accelerometer"].astype(float),
        q_joints=motors["q"].astype(float),
        v_joints=motors["dq"].astype(float),
        tau=motors["tau_est"].astype(float),
        foot_forces=message["foot_force"][0].astype(float)[FEET_SWAPPED],
    )


def as_it_says(
    state: RobotState, reading: SensorReading, message: Shaped[np.ndarray, "1"]
) -> RobotState:
    """``state`` with the attitude that the robot itself estimates, and joints as they are read.

    A second opinion for those who guard it: what the estimator has put right counts as it came.
    """
    q, v = state.q.copy(), state.v.copy()
    q[7:], v[3:6], v[6:] = reading.q_joints, reading.gyro, reading.v_joints
    q[3:7] = message["imu_state"][0]["quaternion"].astype(float)[[1, 2, 3, 0]]
    return replace(state, q=q, v=v)


@final
class CommandGate:
    """Decides in each tick whether motors obey ``rt/lowcmd`` or the controller's own command."""

    def __init__(
        self,
        lower: Float[np.ndarray, "12"],
        upper: Float[np.ndarray, "12"],
        clock: Callable[[], float] = time.monotonic,
    ) -> None:
        """Guard joints with these limits [rad]; ``clock`` tells the wall clock's seconds."""
        self.is_open = True  #: whether low-level commands may take the robot over
        self.accepted = 0  #: number of good commands
        self.refused: Counter[str] = Counter()  #: number of refused ones, by reason
        self._lower, self._upper, self._clock = lower, upper, clock
        self._last: JointCommand | None = None
        self._heard = -np.inf
        self._is_damping = False
        self._throttle = LogThrottle(_log, REPORT_PERIOD, clock)

    @property
    def is_active(self) -> bool:
        """Whether low-level commands have the robot."""
        return self._last is not None

    def hear(self, samples: list[bytes]) -> bool:
        """Take in what has come since the last call; whether a good command was among it."""
        newest = None
        for data in samples:
            try:
                message = intact_message(messages.LOW_CMD, data)
                newest = joint_command(message, self._lower, self._upper)
                self.accepted += 1
            except CommandError as error:
                kind = str(error).split(":")[0]
                self.refused[kind] += 1
                self._throttle.warn(kind, f"lowcmd refused, {self.refused[kind]} so far: {error}")
        if newest is None:
            return False
        if not (self.is_open or self.is_active):
            self._throttle.warn(
                "ignored", "lowcmd ignored: the sport service has the robot; lie down or Damp first"
            )
            return True
        if self._last is None:
            _log.info("low-level commands have the robot")
        elif self._is_damping:
            _log.info("low-level commands go on")
        self._last, self._heard, self._is_damping = newest, self._clock(), False
        return True

    def choose(self, own: JointCommand) -> JointCommand:
        """The command of this tick: the newest good one that was heard, ``own``, or damping."""
        if self._last is None:
            return own
        silence = self._clock() - self._heard
        if silence <= SILENCE:
            return self._last
        if not self._is_damping:
            _log.warning("no good lowcmd for %.0f ms: damped", 1000 * silence)
            self._is_damping = True
        if silence > RELEASE:
            _log.info("low-level control has ended")
            self._last = None
        return JointCommand.damping(DAMPING)


_BOUNDS: Final = (
    ("kp", 0.0, messages.KP_MAX),
    ("kd", 0.0, messages.KD_MAX),
    ("v_des", -messages.SPEED_MAX, messages.SPEED_MAX),
)


RAMP_TIME: Final = 0.5  #: Time [s] over which torque and stiffness grow after the robot was limp
LIMP_TIME: Final = 0.3  #: Time [s] of limpness after which they have to grow anew
LYING_HEIGHT: Final = 0.16  #: Height [m] of the base over the ground below which the robot lies


@dataclass(frozen=True, slots=True)
@retires(ramp_time=RAMP_TIME, limp_time=LIMP_TIME, lying_height=LYING_HEIGHT, lying_tilt=LYING_TILT)
@ranged(POSITIVE)
class GuardConfig:
    """When a command is softened, and when the robot is damped for good."""

    stale_limit: float = 0.03
    """Time [s] without a good ``rt/lowstate`` after which the robot is damped."""
    hang_limit: float = 0.1  #: time [s] without a command of the controller after which it is
    tilt_limit: float = 1.2  #: tilt [rad] of the trunk from which on it is
    joint_margin: float = 0.15  #: angle [rad] beyond a joint's limit from which on it is


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
            has_rested = state.time - self._limp_since > LIMP_TIME
            self._active_since = state.time if has_rested else -math.inf
        share = min(1.0, (state.time - self._active_since) / RAMP_TIME)
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
