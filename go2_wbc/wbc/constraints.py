"""Constraints: what the QP must not break.

Equalities: the six base rows of M a + h = S' tau + J' f (no actuator there), and stance feet that
roll without sliding. Inequalities: friction pyramid and normal force of each stance foot, torque
limits at the measured speeds, and joint position and speed limits as bounds on the acceleration.

The numbers of an inequality are filled by one compiled function, which ``bounds`` calls and the
compiled solve (``condensed``) as well: see ``Limits``.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from go2_wbc.algebra.linear import plus_scaled, triple
from go2_wbc.compilation import kernel, subroutine
from go2_wbc.errors import ConfigError
from go2_wbc.records import V3, Array6, Array12, Record, packed
from go2_wbc.reference import STANCE, Reference, Target
from go2_wbc.robot.model import RobotModel
from go2_wbc.robot.motor import MotorModel, torque_range
from go2_wbc.robot.state import Snapshot
from go2_wbc.wbc.config import WbcConfig
from go2_wbc.wbc.problem import FORCES, SIZE, Bounds, Rows, Source

_JOINT_SELECTION = np.eye(12, SIZE, 6)


class Equality(Source, ABC):
    """A hard goal."""

    @abstractmethod
    def rows(self, snapshot: Snapshot, reference: Reference) -> Rows:
        """Rows E z = e of this constraint now."""


class Inequality(Source, ABC):
    """A hard limit."""

    @abstractmethod
    def bounds(self, snapshot: Snapshot, reference: Reference) -> Bounds:
        """Rows lower <= C z <= upper of this constraint now."""


class Limits(Record):
    """The numbers of all inequalities, each row by what it names: a foot's force, a joint."""

    forces: Float[np.ndarray, "4 5 3"]
    """Five rows of each foot that stands, of its force f [N], see ``FrictionPyramid``."""
    forces_lower: Float[np.ndarray, "4 5"]  #: lower <= forces f <= upper
    forces_upper: Float[np.ndarray, "4 5"]
    torques: Float[np.ndarray, "12 12"]
    """Rows of the torques [N m], of the accelerations of the base (6) and of the joint's leg (3),
    and of the force of that leg's foot (3): the others do not act on this joint."""
    torques_offset: Array12  #: the torque is torques (a_b, a_leg, f) + offset
    torques_lower: Array12  #: what the motors give, at the least
    torques_upper: Array12  #: at the most
    joints_lower: Array12  #: bounds of the joints' accelerations [rad/s^2]
    joints_upper: Array12


class Multipliers(Record):
    """The multiplier of every inequality, in the places of ``Limits``, and of hasty contacts.

    By how much the least cost sum w |A z - b|^2 / 2 falls for a row that is one unit wider;
    positive where its upper side binds, negative where the lower one does, 0 where none does. So a
    contact's is negative if the cost falls where the foot is stopped by less.
    """

    forces: Float[np.ndarray, "4 5"]  #: [1/N]
    torques: Array12  #: [1/(N m)]
    joints: Array12  #: [s^2/rad]
    contacts: Float[np.ndarray, "4"]
    """[s^2/m] of the acceleration that stops a foot; 0 where ``contact_prices`` has none."""


class BaseRows(Record):
    """The base's rows A z = b of M a + h = J' f."""

    A: Float[np.ndarray, "6 30"]
    b: Array6


@kernel
def fill_base_dynamics(now: Snapshot, rows: BaseRows) -> None:
    """Fill force and moment balance of the whole robot in the base frame."""
    for i in range(6):
        for k in range(18):
            rows.A[i, k] = now.mass_matrix[i, k]
        for leg in range(4):
            for k in range(3):
                rows.A[i, 18 + 3 * leg + k] = -now.J_contacts[leg, k, i]
        rows.b[i] = -now.bias[i]


@dataclass(frozen=True, slots=True)
class FloatingBaseDynamics(Equality):
    """The base has no motor: the first six rows of M a + h - J' f are zero."""

    name = "base dynamics"
    unit = "N, N m"

    def rows(self, snapshot: Snapshot, reference: Reference) -> Rows:
        """Six rows, see ``fill_base_dynamics``."""
        rows = BaseRows()
        fill_base_dynamics(snapshot, rows)
        return Rows(rows.A, rows.b)


@dataclass(frozen=True, slots=True)
class StanceFeetStill(Equality):
    """Stance feet roll without sliding: their contact points do not accelerate.

    J a + dJ/dt v = -damping J v in the world frame. With 0 on the right, what integration leaves of
    a velocity would stay for ever; so it decays as exp(-damping t) (Baumgarte, Comp. Meth. Appl.
    Mech. Eng. 1, 1972). There is no term of position: a foot may stand anywhere.
    """

    damping: float  #: rate [1/s] at which a remaining velocity of the contact point is taken out
    name = "stance feet"
    unit = "m/s^2"

    def rows(self, snapshot: Snapshot, reference: Reference) -> Rows:
        """Three rows per stance foot."""
        stance = [leg for leg in range(4) if reference.stance[leg]]
        A = np.zeros((3 * len(stance), SIZE))
        A[:, :18] = snapshot.J_contacts[stance].reshape(-1, 18)
        b = [-part for leg in stance for part in left_over(snapshot, self, leg)]
        return Rows(A, np.array(b, float))


@subroutine
def left_over(now: Snapshot, task: StanceFeetStill, leg: int) -> V3:
    """Drift and damped velocity of a contact point: what J a must take away."""
    drift, velocity = triple(now.drift_contacts[leg]), triple(now.v_world_contacts[leg])
    return plus_scaled(drift, task.damping, velocity)


@dataclass(frozen=True, slots=True)
class FrictionPyramid(Inequality):
    """|f_x| <= mu f_z and |f_y| <= mu f_z for every stance foot, and bounds on f_z."""

    friction: float
    """Mu of the square pyramid, per axis; on the diagonal it allows 1.4 times as much. A reference
    may ask for less."""
    keeps_cone: bool = False
    """Whether the pyramid of a foot with a planned force lies inside of the cone of ``friction``
    instead, an edge of it along that force on the ground: of all inscribed ones this allows most in
    its direction."""
    name = "contact forces"
    unit = "N"

    def friction_for(self, reference: Reference) -> float:
        """What the feet may count on."""
        return float(usable_friction(Target.of(reference.row), self))

    def bounds(self, snapshot: Snapshot, reference: Reference) -> Bounds:
        """Five rows per stance foot: +-f_x - mu f_z, +-f_y - mu f_z (at most 0), and f_z."""
        limits = Limits()
        fill_force_limits(Target.of(reference.row), packed(self), limits)
        stance = np.flatnonzero(reference.stance)
        C = np.zeros((len(stance), 5, SIZE))
        for i, leg in enumerate(stance):
            C[i, :, FORCES][:, 3 * leg : 3 * leg + 3] = limits.forces[leg]
        lower, upper = limits.forces_lower[stance], limits.forces_upper[stance]
        return Bounds(C.reshape(-1, SIZE), lower.ravel(), upper.ravel())


@subroutine
def usable_friction(target: Target, task: FrictionPyramid) -> float:
    """What the feet may count on."""
    return min(task.friction, target.friction) if target.friction > 0.0 else task.friction


@subroutine
def pyramid_of(target: Target, task: FrictionPyramid, leg: int, mu: float) -> V3:
    """Friction and cosine and sine of the turn of a foot's pyramid."""
    if not task.keeps_cone or target.force_weight == 0.0:
        return mu, 1.0, 0.0
    f = target.f_world_feet[leg]
    turn = np.arctan2(f[1], f[0]) - np.pi / 4
    return mu / np.sqrt(2.0), np.cos(turn), np.sin(turn)


@kernel
def fill_force_limits(target: Target, task: FrictionPyramid, limits: Limits) -> None:
    """Fill the rows of every foot that stands."""
    mu = usable_friction(target, task)
    for leg in range(4):
        if target.legs[leg] != STANCE:
            continue
        share, c, s = pyramid_of(target, task, leg, mu)
        rows, lower, upper = limits.forces[leg], limits.forces_lower[leg], limits.forces_upper[leg]
        for n in range(4):
            side = 1.0 - 2.0 * (n % 2)
            rows[n, 0] = side * (c if n < 2 else -s)
            rows[n, 1] = side * (s if n < 2 else c)
            rows[n, 2] = -share
            lower[n], upper[n] = -np.inf, 0.0
        rows[4, 0], rows[4, 1], rows[4, 2] = 0.0, 0.0, 1.0
        lower[4], upper[4] = target.normal_force_min[leg], target.normal_force_max[leg]


@dataclass(frozen=True, slots=True)
class TorqueLimits(Inequality):
    """tau within what the motors give, tau being the joint rows of M a + h - J' f.

    The limits are those at the measured joint speeds. Without torque they are always met.
    """

    motor: MotorModel  #: the motors, at the share of their torque that may be used
    name = "torque limits"
    unit = "N m"

    def bounds(self, snapshot: Snapshot, reference: Reference) -> Bounds:
        """Twelve rows, one per joint."""
        limits = Limits()
        fill_torque_limits(snapshot, packed(self), limits)
        lower, upper = limits.torques_lower, limits.torques_upper
        offset = limits.torques_offset
        return Bounds(_torque_rows(limits), lower - offset, upper - offset)


@kernel
def fill_torque_limits(now: Snapshot, task: TorqueLimits, limits: Limits) -> None:
    """Fill rows and bounds of the torques."""
    fill_torques(now, limits)
    for n in range(12):
        least, most = torque_range(task.motor, n, now.v[6 + n])
        limits.torques_lower[n], limits.torques_upper[n] = least, most


@kernel
def fill_torques(now: Snapshot, limits: Limits) -> None:
    """Fill the joints' rows of M a + h - J' f = tau."""
    for n in range(12):
        leg = n // 3
        M, row = now.mass_matrix[6 + n], limits.torques[n]
        for k in range(6):
            row[k] = M[k]
        for i in range(3):
            row[6 + i] = M[6 + 3 * leg + i]
            row[9 + i] = -now.J_contacts[leg, i, 6 + n]
        limits.torques_offset[n] = now.bias[6 + n]


def torque_map(snapshot: Snapshot) -> tuple[Float[np.ndarray, "12 30"], Array12]:
    """(A, offset) such that the joint torques are A z + offset [N m].

    tau = M_j a + h_j - J_j' f, the rows of the joints j in M a + h = S' tau + J' f.
    """
    limits = Limits()
    fill_torques(snapshot, limits)
    return _torque_rows(limits), limits.torques_offset


def _torque_rows(limits: Limits) -> Float[np.ndarray, "12 30"]:
    A = np.zeros((12, SIZE))
    A[:, :6] = limits.torques[:, :6]
    for leg in range(4):
        rows = slice(3 * leg, 3 * leg + 3)
        A[:, 6:18][rows, rows] = limits.torques[rows, 6:9]
        A[:, FORCES][rows, rows] = limits.torques[rows, 9:]
    return A


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
    """

    q_lower: Array12  #: limit of position [rad]
    q_upper: Array12  #: limit of position [rad]
    speed: Array12  #: limit of speed [rad/s]
    braking: float  #: deceleration [rad/s^2] that is always available
    horizon: float  #: time [s] in which a bound on the velocity must be met
    name = "joint limits"
    unit = "rad/s^2"

    def bounds(self, snapshot: Snapshot, reference: Reference) -> Bounds:
        """Twelve rows, one per joint."""
        limits = Limits()
        fill_joint_limits(snapshot, packed(self), limits)
        return Bounds(_JOINT_SELECTION, limits.joints_lower, limits.joints_upper)


@subroutine
def viable_speed(distance: float, speed: float, braking: float, horizon: float) -> float:
    """v' of (1) in ``JointLimits``: the greatest speed after the horizon that is viable."""
    half = braking * horizon / 2
    radicand = half * half - 2 * half * speed + 2 * braking * distance
    return np.sqrt(max(radicand, 0.0)) - half


@kernel
def fill_joint_limits(now: Snapshot, task: JointLimits, limits: Limits) -> None:
    """Fill the bounds of the joints' accelerations."""
    braking, horizon = task.braking, task.horizon
    for n in range(12):
        q, speed, most = now.q[7 + n], now.v[6 + n], task.speed[n]
        fast = viable_speed(task.q_upper[n] - q, speed, braking, horizon)
        slow = viable_speed(q - task.q_lower[n], -speed, braking, horizon)
        limits.joints_upper[n] = max((min(most, fast) - speed) / horizon, -braking)
        limits.joints_lower[n] = min((-min(most, slow) - speed) / horizon, braking)


@dataclass(frozen=True, slots=True)
class Constraints:
    """All of them that have numbers."""

    still: StanceFeetStill
    pyramid: FrictionPyramid
    torque: TorqueLimits
    joint: JointLimits

    @staticmethod
    def of(c: WbcConfig, model: RobotModel, motor: MotorModel) -> Constraints:
        """With the limits of a configuration, for a robot with these motors.

        Raises:
            ConfigError: for a margin that leaves a joint no range.
        """
        lower, upper = model.q_lower + c.joint_margin, model.q_upper - c.joint_margin
        if (upper <= lower).any():
            raise ConfigError(f"WbcConfig.joint_margin leaves no range: {c.joint_margin} rad")
        speed = model.speed_limits * c.speed_share
        return Constraints(
            StanceFeetStill(c.stance_damping),
            FrictionPyramid(c.friction, keeps_cone=c.keeps_cone),
            TorqueLimits(motor),
            JointLimits(lower, upper, speed, c.braking, c.limit_horizon),
        )


@subroutine
def fill_limits(now: Snapshot, target: Target, c: Constraints, limits: Limits) -> None:
    """Fill the rows of all inequalities."""
    fill_force_limits(target, c.pyramid, limits)
    fill_torque_limits(now, c.torque, limits)
    fill_joint_limits(now, c.joint, limits)


def friction_pyramid(mu: float) -> Float[np.ndarray, "5 3"]:
    """Rows of +-f_x - mu f_z, +-f_y - mu f_z (at most 0) and f_z, on level ground."""
    return np.array(
        [[1.0, 0.0, -mu], [-1.0, 0.0, -mu], [0.0, 1.0, -mu], [0.0, -1.0, -mu], [0.0, 0.0, 1.0]]
    )
