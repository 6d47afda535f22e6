"""Constraints: what the QP must not break.

Equalities: the six base rows of M a + h = S' tau + J' f (no actuator there), and stance feet that
roll without sliding. Inequalities: friction pyramid and normal force of each stance foot, torque
limits at the measured speeds, and joint position and speed limits as bounds on the acceleration.
"""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from go2_wbc.reference import Reference
from go2_wbc.robot.motor import MotorModel
from go2_wbc.robot.snapshot import Snapshot
from go2_wbc.wbc.problem import FORCES, SIZE, Bounds, Rows

_JOINT_SELECTION = np.zeros((12, SIZE))
_JOINT_SELECTION[:, 6:18] = np.eye(12)


class Equality(ABC):
    """A hard goal."""

    name: str
    unit: str

    @abstractmethod
    def rows(self, snapshot: Snapshot, reference: Reference) -> Rows:
        """Rows E z = e of this constraint now."""


class Inequality(ABC):
    """A hard limit."""

    name: str
    unit: str

    @abstractmethod
    def bounds(self, snapshot: Snapshot, reference: Reference) -> Bounds:
        """Rows lower <= C z <= upper of this constraint now."""


@dataclass(frozen=True, slots=True)
class FloatingBaseDynamics(Equality):
    """The base has no motor: the first six rows of M a + h - J' f are zero."""

    name: str = "base dynamics"
    unit: str = "N, N m"

    def rows(self, snapshot: Snapshot, reference: Reference) -> Rows:
        """Six rows: force and moment balance of the whole robot in the base frame."""
        A = np.empty((6, SIZE))
        A[:, :18] = snapshot.mass_matrix[:6]
        A[:, FORCES] = -snapshot.J_contacts[:, :, :6].reshape(12, 6).T
        return Rows(A, -snapshot.bias[:6])


@dataclass(frozen=True, slots=True)
class StanceFeetStill(Equality):
    """Stance feet roll without sliding: their contact points do not accelerate.

    J a + dJ/dt v = -damping J v in the world frame. With 0 on the right, what integration leaves of
    a velocity would stay for ever; so it decays as exp(-damping t) (Baumgarte, Comp. Meth. Appl.
    Mech. Eng. 1, 1972). There is no term of position: a foot may stand anywhere.

    Attributes:
        damping: rate [1/s] at which a remaining velocity of the contact point is taken out.
    """

    damping: float
    name: str = "stance feet"
    unit: str = "m/s^2"

    def rows(self, snapshot: Snapshot, reference: Reference) -> Rows:
        """Three rows per stance foot."""
        stance = np.flatnonzero(reference.stance)
        A = np.zeros((3 * len(stance), SIZE))
        A[:, :18] = snapshot.J_contacts[stance].reshape(-1, 18)
        b = -snapshot.drift_contacts[stance] - self.damping * snapshot.v_world_contacts[stance]
        return Rows(A, b.ravel())


@dataclass(frozen=True, slots=True)
class FrictionPyramid(Inequality):
    """|f_x| <= mu f_z and |f_y| <= mu f_z for every stance foot, and bounds on f_z.

    Attributes:
        friction: mu of the square pyramid, per axis; on the diagonal it allows 1.4 times as much.
            A reference may ask for less.
        keeps_cone: whether the pyramid of a foot with a planned force lies inside of the cone of
            ``friction`` instead, an edge of it along that force.
    """

    friction: float
    keeps_cone: bool = False
    name: str = "contact forces"
    unit: str = "N"

    def friction_for(self, reference: Reference) -> float:
        """What the feet may count on."""
        return min(self.friction, reference.friction or self.friction)

    def bounds(self, snapshot: Snapshot, reference: Reference) -> Bounds:
        """Five rows per stance foot."""
        stance = np.flatnonzero(reference.stance)
        count = len(stance)
        C = np.zeros((5 * count, SIZE))
        lower = np.full(5 * count, -np.inf)
        upper = np.zeros(5 * count)
        mu = self.friction_for(reference)
        is_inside = self.keeps_cone and reference.force_weight > 0.0
        for i, leg in enumerate(stance):
            start, f_planned = FORCES.start + 3 * leg, reference.f_world_feet[leg]
            pattern = pyramid_in_cone(mu, f_planned) if is_inside else friction_pyramid(mu)
            C[5 * i : 5 * i + 5, start : start + 3] = pattern
            lower[5 * i + 4] = reference.normal_force_min[leg]
            upper[5 * i + 4] = reference.normal_force_max[leg]
        return Bounds(C, lower, upper)


@dataclass(frozen=True, slots=True)
class TorqueLimits(Inequality):
    """tau within what the motors give, tau being the joint rows of M a + h - J' f.

    The limits are those at the measured joint speeds. Without torque they are always met.

    Attributes:
        motor: the motors, at the share of their torque that may be used.
    """

    motor: MotorModel
    name: str = "torque limits"
    unit: str = "N m"

    def bounds(self, snapshot: Snapshot, reference: Reference) -> Bounds:
        """Twelve rows, one per joint."""
        A, offset = torque_map(snapshot)
        lower, upper = self.motor.limits(snapshot.state.joint_velocities)
        return Bounds(A, lower - offset, upper - offset)


@dataclass(frozen=True, slots=True)
class JointLimits(Inequality):
    """Joint position and speed limits as acceleration bounds (Del Prete 2018, sec. III).

    A state is viable if braking still stops the joint at its limit. With the speed going evenly
    from v to v' within ``horizon`` h, the joint then is h (v + v') / 2 further, and stops within
    v'^2 / (2 b), b being ``braking``, so

        v'^2 <= 2 b (d - h (v + v') / 2),    d = q_max - q                        (1)

    whose greatest solution is v' = -b h / 2 + sqrt((b h / 2)^2 - b h v + 2 b d), and the bound is
    (v' - v) / h. Towards the lower limit q and v change their signs. Beyond a limit, where (1) has
    no solution, the root counts as 0: the joint has to come back. No bound asks for more than
    ``braking``; whether the legs can brake that hard, at the torque limits and with their feet on
    the ground, is for the QP to tell.

    Attributes:
        q_lower, q_upper: position limits [rad].
        speed: speed limits [rad/s].
        braking: deceleration [rad/s^2] that is always available.
        horizon: time [s] in which a bound on the velocity must be met.
    """

    q_lower: Float[np.ndarray, "12"]
    q_upper: Float[np.ndarray, "12"]
    speed: Float[np.ndarray, "12"]
    braking: float
    horizon: float
    name: str = "joint limits"
    unit: str = "rad/s^2"

    def bounds(self, snapshot: Snapshot, reference: Reference) -> Bounds:
        """Twelve rows, one per joint."""
        q, v = snapshot.state.joint_positions, snapshot.state.joint_velocities
        fastest = np.minimum(self.speed, self._viable_speed(self.q_upper - q, v))
        slowest = -np.minimum(self.speed, self._viable_speed(q - self.q_lower, -v))
        upper = np.maximum((fastest - v) / self.horizon, -self.braking)
        lower = np.minimum((slowest - v) / self.horizon, self.braking)
        return Bounds(_JOINT_SELECTION, lower, upper)

    def _viable_speed(
        self, distance: Float[np.ndarray, "12"], speed: Float[np.ndarray, "12"]
    ) -> Float[np.ndarray, "12"]:
        """v' of (1): the greatest speed after the horizon that is viable, d = ``distance``."""
        half = self.braking * self.horizon / 2
        radicand = half * half - 2 * half * speed + 2 * self.braking * distance
        return np.sqrt(np.maximum(radicand, 0.0)) - half


def torque_map(
    snapshot: Snapshot,
) -> tuple[Float[np.ndarray, "12 30"], Float[np.ndarray, "12"]]:
    """(A, offset) such that the joint torques are A z + offset [N m].

    tau = M_j a + h_j - J_j' f, the rows of the joints j in M a + h = S' tau + J' f.
    """
    A = np.empty((12, SIZE))
    A[:, :18] = snapshot.mass_matrix[6:]
    A[:, FORCES] = -snapshot.J_contacts[:, :, 6:].reshape(12, 12).T
    return A, snapshot.bias[6:]


def pyramid_in_cone(mu: float, f: Float[np.ndarray, "3"]) -> Float[np.ndarray, "5 3"]:
    """The square pyramid inside of the cone of ``mu`` with an edge along ``f`` on the ground.

    Rows as of ``friction_pyramid``. Of all inscribed ones it allows most in the direction of ``f``.
    """
    rows, turn = friction_pyramid(mu / math.sqrt(2.0)), math.atan2(f[1], f[0]) - math.pi / 4.0
    rows[:4, :2] @= np.array([[math.cos(turn), math.sin(turn)], [-math.sin(turn), math.cos(turn)]])
    return rows


def friction_pyramid(mu: float) -> Float[np.ndarray, "5 3"]:
    """Rows of +-f_x - mu f_z, +-f_y - mu f_z (at most 0) and f_z, on level ground."""
    return np.array(
        [[1.0, 0.0, -mu], [-1.0, 0.0, -mu], [0.0, 1.0, -mu], [0.0, -1.0, -mu], [0.0, 0.0, 1.0]]
    )
