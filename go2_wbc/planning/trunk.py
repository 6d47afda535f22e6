"""The trunk's reference: the command ramped, integrated to a pose and kept near the robot.

The velocity is in the heading frame (z up, x along the reference's yaw); the heading is integrated
first and turns it. A body that only followed a velocity would keep a steady error of position and
heading, so the command is integrated to a pose, which is kept within a limit (a leash) of the
measured one: a robot that is held back does not accumulate an error, to jump afterwards.

A ``BodyPose`` is added to the pose of a walking trunk: level along the ground, at the walking
height, facing the heading. The heading stays that of the command and of the feet, so that a trunk
with yaw looks aside while it walks ahead. A new pose is approached without a jump of its rates:
each is ``sharpness`` times the remaining error, within a greatest rate, and changes by
``sharpness`` times that in a second at most, which is as fast as it must fall at the end, so that
nothing overshoots.

Sag under a load, and lean by joint friction, are removed by an integral: a task of the whole-body
QP is a proportional-derivative law, whose error then settles at a value that is not zero. Per axis
in the world

    o' = rate * clip(e, -window, window);   |o| <= limit

is added to the reference, so that the measured body settles at its target. The window bounds how
fast the integral grows. An error beyond it still counts: a body that a load or dry friction holds
far off would otherwise stay there for good. The limit is an anti-windup by saturation (Astrom &
Hagglund, PID Controllers, 1995, sec. 3.5), for instance while the body is on its way, or against a
contact that gives way.
"""

from __future__ import annotations

from dataclasses import dataclass, fields

import numpy as np
from jaxtyping import Bool, Float

from go2_wbc.algebra.linear import cross, rotation_by
from go2_wbc.arguments import typed
from go2_wbc.compilation import Foreign, subroutine
from go2_wbc.errors import CommandError, ConfigError
from go2_wbc.planning.command import finite_number
from go2_wbc.planning.ground import Ground, ground_at, tilt
from go2_wbc.records import V3, Array3, Array3x3, Array4, Record
from go2_wbc.reference import Target
from go2_wbc.robot.state import Snapshot
from go2_wbc.validation import NOT_NEGATIVE, POSITIVE, ranged

RATE = 2.0  #: Share of the remaining error that is added per second [1/s]
POSITION_LIMIT, POSITION_WINDOW = 0.06, 0.04
"""Greatest correction [m] per axis, and the error [m] beyond which one counts as this."""
ANGLE_LIMIT, ANGLE_WINDOW = 0.3, 0.3
"""The same of the attitude [rad]. A load of 4 kg, 5 cm beside the middle of the simulated robot,
leaned it by 15 deg where errors beyond 0.1 rad were dropped, by 9 with a limit of 0.15 rad, by 2
with these."""
EAGERNESS = 0.05
"""Time [s] within which footholds are moved for an acceleration that has just begun."""
SETTLED_COMMAND = 1e-3
"""Ramped velocity command [m/s, rad/s] below which it counts as arrived at zero."""
STRIDE_RATE, STRIDE_WINDOW = 1.0, 0.05
"""How the lean is taken out in stride [1/s], [rad], slowly and whatever a push does: 6 kg that are
believed 2 cm beside their place, as gravity is known to 1 deg, leaned a trot by 4 deg. A robot that
stands ready does it as a motion does: the joints' friction leaves 2.5 deg of a pose undone, and a
payload that reaches farther than is believed leans it by 4 deg."""
LEAN_LIMIT = 0.15  #: Greatest lean [rad] that is taken out
_TINY = 1e-9  #: Velocity [m/s] that stands in for none where one divides by it


@dataclass(frozen=True, slots=True)
class BodyPose:
    """Of the trunk, from that of one that walks level, facing ahead."""

    height: float = 0.0  #: above the walking height [m], negative is lower
    roll: float = 0.0  #: positive lowers the right side [rad]
    pitch: float = 0.0  #: positive lowers the front [rad]
    yaw: float = 0.0  #: positive looks to the left of the heading [rad]

    def __post_init__(self) -> None:
        """Make every component a float; raise CommandError unless it is a finite number."""
        for part in fields(self):
            object.__setattr__(self, part.name, finite_number(part.name, getattr(self, part.name)))

    @property
    def row(self) -> Array4:
        """Height [m], roll, pitch, yaw [rad]."""
        return np.array([self.height, self.roll, self.pitch, self.yaw])


LEVEL = BodyPose()  #: The pose of a robot that walks and is asked for nothing else


@typed()
@dataclass(frozen=True, slots=True)
@ranged(highest=NOT_NEGATIVE, roll=NOT_NEGATIVE, pitch=NOT_NEGATIVE, yaw=NOT_NEGATIVE)
class PoseEnvelope:
    """Limits of the trunk's pose while the robot walks, each measured with all others at theirs.

    Attributes:
        lowest, highest: heights, relative to the walking height [m]; 0 lies between.
        roll, pitch, yaw: angles either way [rad].
    """

    lowest: float = -0.05
    highest: float = 0.02
    roll: float = 0.15
    pitch: float = 0.15
    yaw: float = 0.20

    def __post_init__(self) -> None:
        """Raise ConfigError for a lowest trunk that is above the usual one."""
        if not -1.0 <= self.lowest <= 0.0:
            raise ConfigError(f"PoseEnvelope.lowest must be between -1 and 0, got {self.lowest!r}")

    def bounds(self, name: str) -> tuple[float, float]:
        """Least and greatest value of a component of the pose."""
        if name == "height":
            return self.lowest, self.highest
        most: float = getattr(self, name)
        return -most, most

    def require(self, pose: BodyPose) -> None:
        """Raise CommandError, with all that is out of range, unless ``pose`` lies inside."""
        beyond = []
        for part in fields(pose):
            least, most = self.bounds(part.name)
            value, unit = getattr(pose, part.name), "m" if part.name == "height" else "rad"
            if not least <= value <= most:
                beyond.append(f"{part.name} must be {least:g} to {most:g} {unit}, got {value:g}")
        if beyond:
            raise CommandError(f"beyond the envelope of poses while walking: {'; '.join(beyond)}")


@dataclass(frozen=True, slots=True)
@ranged(POSITIVE)
class PoseConfig:
    """How a new pose is approached (own choice: about a second for any allowed pose)."""

    height_rate: float = 0.10  #: greatest rate of the height [m/s]
    turning_rate: float = 0.35  #: greatest rate of roll, pitch and yaw [rad/s]
    sharpness: float = 5.0  #: rate [1/s] at which the remaining error decays near the end


@subroutine
def advance_pose(pose: Array4, rate: Array4, c: PoseConfig, asked: Array4, dt: float) -> None:
    """Bring a pose (height [m], roll, pitch, yaw [rad]) and its rate nearer to what is asked for.

    ``dt`` [s] is what passes.
    """
    for i in range(4):
        most = c.height_rate if i == 0 else c.turning_rate
        wanted = min(max(c.sharpness * (asked[i] - pose[i]), -most), most)
        change = c.sharpness * most * dt
        rate[i] += min(max(wanted - rate[i], -change), change)
        pose[i] += rate[i] * dt


@subroutine
def lean_rotation(pose: Array4, R: Array3x3) -> None:
    """Turn the rotation of a trunk that walks level by that of the pose: R Rz Ry Rx."""
    sr, cr = np.sin(pose[1]), np.cos(pose[1])
    sp, cp = np.sin(pose[2]), np.cos(pose[2])
    sy, cy = np.sin(pose[3]), np.cos(pose[3])
    for i in range(3):
        x, y, z = R[i, 0], R[i, 1], R[i, 2]
        R[i, 0] = (x * cy + y * sy) * cp - z * sp
        R[i, 1] = (x * cy + y * sy) * sp * sr + (y * cy - x * sy) * cr + z * cp * sr
        R[i, 2] = (x * cy + y * sy) * sp * cr - (y * cy - x * sy) * sr + z * cp * cr


@subroutine
def pose_turn(yaw: float, pose: Array4, rate: Array4, turn: Array3, w: Array3) -> None:
    """What roll, pitch and yaw of a pose add to a level trunk of that heading ``yaw`` [rad].

    Fills the turn [rad] from a level trunk that has the pose's yaw already (the quaternions of
    pitch and roll, multiplied), and the angular velocity [rad/s] (Craig, Introduction to Robotics,
    3rd ed., eq. 5.44); both are vectors in the world.
    """
    cosine, sine = np.cos(yaw + pose[3]), np.sin(yaw + pose[3])
    sp, cp = np.sin(pose[2]), np.cos(pose[2])
    w[0] = cosine * cp * rate[1] - sine * rate[2]
    w[1] = sine * cp * rate[1] + cosine * rate[2]
    w[2] = rate[3] - sp * rate[1]
    sr, cr, sp, cp = (
        np.sin(pose[1] / 2),
        np.cos(pose[1] / 2),
        np.sin(pose[2] / 2),
        np.cos(pose[2] / 2),
    )
    x, y, z = cp * sr, sp * cr, -sp * sr
    length = np.sqrt(x * x + y * y + z * z)
    share = 2.0 * np.arctan2(length, cp * cr) / length if length > 0.0 else 2.0
    turn[0] = share * (cosine * x - sine * y)
    turn[1] = share * (sine * x + cosine * y)
    turn[2] = share * z


class Command(Record):
    """What the planner is asked for."""

    velocity: Array3  #: ahead, left [m/s], turning [rad/s], in the heading frame
    pose: Array4  #: of the trunk: height [m], roll, pitch, yaw [rad]; see ``BodyPose``


class Trunk(Record):
    """Where the trunk shall be."""

    yaw: float  #: heading [rad]
    position: Float[np.ndarray, "2"]  #: of the CoM, on the level [m]
    velocity: Array3  #: ramped command in the heading frame [m/s], [rad/s]
    missing: Float[np.ndarray, "2"]
    """What of the command ahead and to the left has yet to be ramped [m/s]."""
    acceleration: Float[np.ndarray, "2"]
    """At which that happens, smoothed, in the heading frame [m/s^2]."""
    height_offset: float  #: what is added to the wanted height against a load [m]
    lean_offset: Float[np.ndarray, "2"]
    """Turn about x and y of the world [rad] that is added against the lean."""
    pose: Array4  #: on top of walking level: height [m], roll, pitch, yaw [rad]
    pose_rate: Array4  #: of these, per second


@subroutine
def heading(now: Snapshot) -> float:
    """Measured yaw [rad] of the base."""
    x, y, z, w = now.q[3], now.q[4], now.q[5], now.q[6]
    return np.arctan2(2 * (w * z + x * y), 1 - 2 * (y * y + z * z))


@subroutine
def is_zero(command: Command) -> bool:
    """Whether the robot is asked to stay."""
    v = command.velocity
    return v[0] == 0.0 and v[1] == 0.0 and v[2] == 0.0


@subroutine
def is_settled(trunk: Trunk) -> bool:
    """Whether the ramped command has arrived at zero."""
    x, y, turn = abs(trunk.velocity[0]), abs(trunk.velocity[1]), abs(trunk.velocity[2])
    return x < SETTLED_COMMAND and y < SETTLED_COMMAND and turn < SETTLED_COMMAND


@subroutine
def world_velocity(trunk: Trunk) -> tuple[float, float]:
    """Wanted velocity of the CoM [m/s]."""
    cosine, sine = np.cos(trunk.yaw), np.sin(trunk.yaw)
    x, y = trunk.velocity[0], trunk.velocity[1]
    return cosine * x - sine * y, sine * x + cosine * y


@subroutine
def ramp(velocity: Array3, command: Command, linear: float, angular: float, dt: float) -> None:
    """Bring a velocity nearer to the commanded one, by these accelerations [m/s^2], [rad/s^2]."""
    x, y = command.velocity[0] - velocity[0], command.velocity[1] - velocity[1]
    share = min(linear * dt / max(np.hypot(x, y), _TINY), 1.0)
    velocity[0] += share * x
    velocity[1] += share * y
    most = angular * dt
    velocity[2] += min(max(command.velocity[2] - velocity[2], -most), most)


@subroutine
def accelerate(trunk: Trunk, command: Command, linear: float, angular: float, dt: float) -> None:
    """Bring the trunk's velocity nearer to the commanded one; ``linear`` [m/s^2], ``angular``."""
    ramp(trunk.velocity, command, linear, angular, dt)
    for i in range(2):
        trunk.missing[i] = command.velocity[i] - trunk.velocity[i]
    share = linear / max(np.hypot(trunk.missing[0], trunk.missing[1]), _TINY)
    for i in range(2):
        rise = share * trunk.missing[i] - trunk.acceleration[i]
        trunk.acceleration[i] += min(dt / EAGERNESS, 1.0) * rise


@subroutine
def give_way(trunk: Trunk, now: Snapshot) -> None:
    """Take the robot's own speed on its way, if that is less: it has been stopped."""
    x, y = world_velocity(trunk)
    along = x * now.v_world_com[0] + y * now.v_world_com[1]
    share = min(max(along / max(x * x + y * y, _TINY), 0.0), 1.0)
    trunk.velocity[0] *= share
    trunk.velocity[1] *= share


@subroutine
def gained(trunk: Trunk, axis: int, time: float) -> tuple[float, float]:
    """Velocity [m/s] that the ramp adds along an axis within a ``time`` [s], and the way [m]."""
    missing, a = trunk.missing[axis], trunk.acceleration[axis]
    if missing * a <= 0.0:
        return 0.0, 0.0
    lasts = min(missing / a, time)
    return a * lasts, a * lasts * (time - 0.5 * lasts)


@subroutine
def follow_heading(trunk: Trunk, now: Snapshot, leash: float, dt: float) -> None:
    """Integrate the heading, at most ``leash`` [rad] ahead of the measured one."""
    trunk.yaw += trunk.velocity[2] * dt
    difference = trunk.yaw + trunk.pose[3] - heading(now)
    lead = np.arctan2(np.sin(difference), np.cos(difference))
    trunk.yaw += min(max(lead, -leash), leash) - lead


@subroutine
def follow_position(trunk: Trunk, now: Snapshot, leash: float, dt: float) -> None:
    """Integrate the position, at most ``leash`` [m] ahead of the measured one."""
    v_x, v_y = world_velocity(trunk)
    trunk.position[0] += v_x * dt
    trunk.position[1] += v_y * dt
    p = now.p_world_com
    x, y = trunk.position[0] - p[0], trunk.position[1] - p[1]
    distance = np.hypot(x, y)
    if distance > leash:
        trunk.position[0] = p[0] + x * leash / distance
        trunk.position[1] = p[1] + y * leash / distance


@subroutine
def correct_height(trunk: Trunk, now: Snapshot, height: float, dt: float) -> None:
    """Integrate the error from ``height`` [m], the pose's added: a payload makes it sag."""
    sag = height + trunk.pose[0] - now.p_world_com[2]
    offset = trunk.height_offset
    trunk.height_offset = integrated(offset, sag, dt, RATE, POSITION_WINDOW, POSITION_LIMIT)


@subroutine
def fill_body(trunk: Trunk, ground: Ground, height: float, target: Target) -> None:
    """The trunk's reference: along the ground, its CoM at ``height`` [m], with the pose."""
    target.is_com = True
    p, v, R = target.p_world, target.v_world, target.R_world_base
    p[0], p[1] = trunk.position[0], trunk.position[1]
    p[2] = ground_at(ground, trunk.position[0], trunk.position[1])
    p[2] += height + trunk.height_offset + trunk.pose[0]
    v[0], v[1] = world_velocity(trunk)
    v[2] = ground.slope[0] * v[0] + ground.slope[1] * v[1] + trunk.pose_rate[0]
    cosine, sine = np.cos(trunk.yaw), np.sin(trunk.yaw)
    a, b = tilt(ground)
    rise = a * cosine + b * sine
    length, steep = np.sqrt(1.0 + rise * rise), np.sqrt(1.0 + a * a + b * b)
    x = cosine / length, sine / length, rise / length
    z = -a / steep, -b / steep, 1.0 / steep
    y = cross(z, x)
    for i in range(3):
        R[i, 0] = x[i]
        R[i, 1] = y[i]
        R[i, 2] = z[i]
    lean_rotation(trunk.pose, R)
    turn = np.empty(3)
    pose_turn(trunk.yaw, trunk.pose, trunk.pose_rate, turn, target.w_world)
    target.w_world[2] += trunk.velocity[2]


@subroutine
def level(
    trunk: Trunk,
    now: Snapshot,
    contact: Foreign[Bool[np.ndarray, "4"]],
    is_stepping: bool,
    dt: float,
    target: Target,
) -> None:
    """Integrate what is left of the lean, and turn the trunk's reference by that.

    That is the integral of the vertical's error. It rests while a foot of a robot that stands ready
    has no contact.
    """
    wanted, offset, R = target.R_world_base, trunk.lean_offset, now.R_world_base
    if is_stepping or (contact[0] and contact[1] and contact[2] and contact[3]):
        rate = STRIDE_RATE if is_stepping else RATE
        window = STRIDE_WINDOW if is_stepping else ANGLE_WINDOW
        measured = R[0, 2], R[1, 2], R[2, 2]
        error = cross(measured, (wanted[0, 2], wanted[1, 2], wanted[2, 2]))
        for i in range(2):
            offset[i] = integrated(offset[i], error[i], dt, rate, window, LEAN_LIMIT)
    turn_by((offset[0], offset[1], 0.0), wanted)


@subroutine
def integrated(
    offset: float, error: float, dt: float, rate: float, window: float, limit: float
) -> float:
    """One axis' offset after ``dt`` seconds of ``error``."""
    counted = min(max(error, -window), window)
    return min(max(offset + rate * dt * counted, -limit), limit)


@subroutine
def turn_by(rotation: V3, R: Array3x3) -> None:
    """Turn an attitude by a rotation vector [rad] in the world."""
    turn, before = np.empty((3, 3)), R.copy()
    rotation_by(rotation, turn)
    for i in range(3):
        for k in range(3):
            R[i, k] = (
                turn[i, 0] * before[0, k] + turn[i, 1] * before[1, k] + turn[i, 2] * before[2, k]
            )
