"""The robot's state: what a plant measures, what follows from it, and what a plant is told.

Every quantity of one control tick is computed once: holding a ``Snapshot`` proves that it is fresh.

Contact points: a foot is a sphere that rolls. The material point at the contact is r below the
centre, so its velocity is v_c + w x (-r n), and a rolling foot obeys a_c = r (dw x n)
(differentiate v_c = r w x n). ``J_contacts`` is therefore J_c - r (J_w x n), and
``drift_contacts`` the matching velocity-dependent part, without the centripetal term that belongs
to the material point.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, fields

import numpy as np
from jaxtyping import Bool, Float

from go2_wbc.arguments import typed
from go2_wbc.brief import brief
from go2_wbc.errors import CommandError
from go2_wbc.records import Array3, Array3x3, Array4, Array4x3, Array12, Array18, Array19, Record
from go2_wbc.robot.description import RobotProfile, find_profile


def have_equal_fields(one: RobotState | JointCommand, other: object) -> bool:
    """Whether both are of one class, and their arrays equal; what is no number equals itself."""
    names = one.__dataclass_fields__
    return type(one) is type(other) and all(
        np.array_equal(getattr(one, name), getattr(other, name), equal_nan=True) for name in names
    )


@dataclass(frozen=True, slots=True, eq=False)
class RobotState:
    """The measured state of the robot at one instant.

    Attributes:
        time: plant time [s].
        q: base position [m] in the world, quaternion x y z w, 12 joint angles [rad].
        v: base linear [m/s] then angular [rad/s] velocity, both in the base frame, 12 joint
            velocities [rad/s].
        tau: joint torques that acted over the last step [N m].
        foot_forces: normal force that each foot's contact sensor reads [N].
        feet_in_contact: whether each foot's sensor reads a contact. Without any, a robot never
            counts as standing, and a walking one takes the ground for level.
    """

    time: float
    q: Array19
    v: Array18
    tau: Array12
    foot_forces: Array4
    feet_in_contact: Bool[np.ndarray, "4"]

    __eq__ = have_equal_fields

    def __repr__(self) -> str:
        place = ", ".join(f"{part:.3f}" for part in self.p_world_base.tolist())
        angles = ", ".join(f"{angle:.1f}" for angle in np.degrees(self.rpy).tolist())
        return f"RobotState(at {self.time:.3f} s: base ({place}) m, rpy ({angles}) deg)"

    def read_only(self) -> RobotState:
        """The same; an attempt to write into its arrays ends in an error."""
        arrays = [getattr(self, part.name).copy() for part in fields(self)[1:]]
        for array in arrays:
            array.flags.writeable = False
        return RobotState(self.time, *arrays)

    @property
    def p_world_base(self) -> Array3:
        """Position of the base in the world [m]."""
        return self.q[:3]

    @property
    def R_world_base(self) -> Array3x3:
        """Rotation from the base frame to the world."""
        x, y, z, w = self.q[3:7].tolist()
        return np.array(
            [
                [1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)],
                [2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)],
                [2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)],
            ]
        )

    @property
    def rpy(self) -> Array3:
        """Roll, pitch, yaw [rad] of the base (R = Rz(yaw) Ry(pitch) Rx(roll))."""
        x, y, z, w = self.q[3:7].tolist()
        roll = math.atan2(2 * (w * x + y * z), 1 - 2 * (x * x + y * y))
        pitch = math.asin(min(1.0, max(-1.0, 2 * (w * y - z * x))))
        return np.array([roll, pitch, self.yaw])

    @property
    def yaw(self) -> float:
        """Heading [rad] of the base, in (-pi, pi]."""
        x, y, z, w = self.q[3:7].tolist()
        return math.atan2(2 * (w * z + x * y), 1 - 2 * (y * y + z * z))

    @property
    def tilt(self) -> float:
        """Angle [rad] between the base's z axis and the vertical, 0 to pi."""
        x, y = self.q[3:5].tolist()
        return math.acos(min(max(1 - 2 * (x * x + y * y), -1.0), 1.0))

    @property
    def joint_positions(self) -> Array12:
        """Joint angles [rad]."""
        return self.q[7:]

    @property
    def joint_velocities(self) -> Array12:
        """Joint velocities [rad/s]."""
        return self.v[6:]


@dataclass(frozen=True, slots=True)
class SensorReading:
    """What the robot measures at one instant."""

    time: float  #: robot time [s]
    gyro: Array3  #: angular velocity [rad/s] in the base frame
    accelerometer: Array3  #: specific force [m/s^2] in the base frame; +9.81 upwards at rest
    q_joints: Array12  #: joint angles [rad]
    v_joints: Array12  #: joint velocities [rad/s]
    tau: Array12  #: joint torques [N m]
    foot_forces: Array4  #: normal force at each foot [N]


@dataclass(frozen=True, slots=True)
class PartFault:
    """A part of the robot that is broken."""

    part: str  #: its name, as ``FL_calf_joint``, ``FL_foot``, ``gyro``
    what: str  #: is the matter with it, in plain words
    is_survived: bool  #: whether the robot can go on
    since: float  #: robot time [s] at which it was noticed

    def __str__(self) -> str:
        return f"{self.part} {self.what} (since {self.since:.2f} s)"


@dataclass(frozen=True, slots=True)
class Health:
    """What of a robot is broken."""

    faults: tuple[PartFault, ...] = ()
    """In the order in which they were noticed; empty if it seems sound."""

    @property
    def is_sound(self) -> bool:
        """Whether nothing was found to be broken."""
        return not self.faults

    def __str__(self) -> str:
        return "; ".join(map(str, self.faults)) or "sound"


@dataclass(frozen=True, slots=True)
class OdometryCovariance:
    """How sure a state is of the base: of its errors, as ``nav_msgs/Odometry`` has them."""

    pose: Float[np.ndarray, "6 6"]  #: of position [m] and turn about fixed axes [rad], in the world
    twist: Float[np.ndarray, "6 6"]
    """Of linear [m/s] and angular [rad/s] velocity, in the base frame."""

    __repr__ = brief

    @classmethod
    def of_deviations(
        cls, position: float, turn: float, linear: float, angular: float
    ) -> OdometryCovariance:
        """Of independent errors with these standard deviations."""
        pose, twist = np.repeat([position, turn], 3), np.repeat([linear, angular], 3)
        return cls(np.diag(pose**2), np.diag(twist**2))


@dataclass(frozen=True, slots=True, eq=False)
class JointCommand:
    """What the motors are told: tau + kp (q_des - q) + kd (v_des - v), clipped to the limits.

    This is the motor law of the Go2's own joint boards, so a simulator and the robot take the
    same command. A plant evaluates it with its newest encoder values.

    Attributes:
        tau: feed-forward torque [N m].
        q_des: desired joint angles [rad].
        v_des: desired joint velocities [rad/s].
        kp: stiffness [N m/rad].
        kd: damping [N m s/rad].
    """

    tau: Array12
    q_des: Array12
    v_des: Array12
    kp: Array12
    kd: Array12

    __repr__, __eq__ = brief, have_equal_fields

    def asked(self, q: Array12, v: Array12) -> Array12:
        """Torques [N m] asked for at angles ``q`` and velocities ``v``, before any limit."""
        return self.kp * (self.q_des - q) + self.tau + self.kd * (self.v_des - v)

    def numbers(self) -> Float[np.ndarray, "5 12"]:
        """All of it, in the order above.

        Raises:
            CommandError: for a value that is not finite, or an array of another shape.
        """
        names = self.__dataclass_fields__
        rows = [getattr(self, name) for name in names]
        for name, row in zip(names, rows, strict=True):
            if row.shape != (12,):
                raise CommandError(f"command.{name} must have shape (12,), got {row.shape}")
        numbers = np.array(rows, dtype=float)
        if not math.isfinite(np.vdot(numbers, numbers)):  # cheap, but huge numbers overflow
            for name, row in zip(names, rows, strict=True):
                if not np.isfinite(row).all():
                    raise CommandError(f"command.{name} is not finite: {row}")
        return numbers

    @staticmethod
    def torque(tau: Array12) -> JointCommand:
        """Pure torque: no stiffness, no damping."""
        return JointCommand(tau, _ZEROS, _ZEROS, _ZEROS, _ZEROS)

    @staticmethod
    @typed()
    def damping(kd: float) -> JointCommand:
        """Limp and damped: the safe command."""
        return JointCommand(_ZEROS, _ZEROS, _ZEROS, _ZEROS, np.full(12, kd))

    @staticmethod
    @typed()
    def servo(q_des: Array12, v_des: Array12, kp: float, kd: float) -> JointCommand:
        """A joint servo around a moving target."""
        return JointCommand(_ZEROS, q_des, v_des, np.full(12, kp), np.full(12, kd))


_ZEROS = np.zeros(12)
_ZEROS.flags.writeable = False


class Snapshot(Record):
    """State and dynamics of one tick. Accelerations use Pinocchio's spatial base acceleration.

    Attributes:
        state, profile: the measured state that everything here belongs to, and that of the robot.
        q, v: its configuration and velocity.
        R_world_base: base orientation.
        mass_matrix: M(q) with rotor inertia.
        bias: h(q, v): Coriolis, centrifugal and gravity terms [N, N m].
        p_world_com, v_world_com: CoM position [m] and velocity [m/s].
        J_com: CoM Jacobian (world); drift_com: CoM acceleration [m/s^2] at zero joint acceleration.
        p_world_feet, v_world_feet: foot centres [m], [m/s].
        J_feet, drift_feet: Jacobians and drifts of the foot centres (world).
        J_contacts, drift_contacts: the same for the rolling contact points.
        v_world_contacts: velocity of the material contact points [m/s].
        payload: mass [kg] and weight [N] of what the trunk is taken to carry; it is in all the
            dynamics above.
        com_shift: by which it moves the CoM [m] in the world.
        foot_radius: of the spherical feet [m].
    """

    __slots__ = ("profile", "state")

    state: RobotState
    profile: RobotProfile
    q: Array19
    v: Array18
    R_world_base: Array3x3
    mass_matrix: Float[np.ndarray, "18 18"]
    bias: Array18
    p_world_com: Array3
    v_world_com: Array3
    J_com: Float[np.ndarray, "3 18"]
    drift_com: Array3
    p_world_feet: Array4x3
    v_world_feet: Array4x3
    J_feet: Float[np.ndarray, "4 3 18"]
    drift_feet: Array4x3
    J_contacts: Float[np.ndarray, "4 3 18"]
    drift_contacts: Array4x3
    v_world_contacts: Array4x3
    payload: Float[np.ndarray, "2"]
    com_shift: Array3
    foot_radius: float

    def __init__(
        self,
        state: RobotState,
        profile: RobotProfile | None = None,
        **parts: Float[np.ndarray, "..."] | float,
    ) -> None:
        """From the ``state`` and the other parts by name; what is left out is 0.

        Without a ``profile`` the robot is a Go2.

        Raises:
            CommandError: for an array of another shape than it should have.
        """
        try:
            super().__init__(q=state.q, v=state.v, **parts)
        except (ValueError, TypeError) as error:
            raise CommandError(f"snapshot: {error}") from error
        object.__setattr__(self, "state", state)
        object.__setattr__(self, "profile", profile or find_profile())

    @staticmethod
    def of_row(
        state: RobotState, row: Float[np.ndarray, " size"], profile: RobotProfile
    ) -> Snapshot:
        """The snapshot of ``state`` whose numbers lie in ``row``."""
        snapshot = Snapshot.of(row)
        object.__setattr__(snapshot, "state", state)
        object.__setattr__(snapshot, "profile", profile)
        return snapshot

    def replaced(
        self, state: RobotState | None = None, **parts: Float[np.ndarray, "..."] | float
    ) -> Snapshot:
        """A copy with another state, or other parts by name."""
        own = {
            name: getattr(self, name) for name in Snapshot.part_names() if name not in ("q", "v")
        }
        return Snapshot(state or self.state, self.profile, **(own | parts))

    def __reduce__(self) -> tuple[object, ...]:
        return Snapshot.of_row, (self.state, self.row, self.profile)
