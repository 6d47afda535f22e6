"""The trunk's way: the command ramped, integrated to a pose and kept near the robot.

The velocity is in the heading frame (z up, x along the reference's yaw); the heading is integrated
first and turns it. A body that only followed a velocity would keep a steady error of place and
heading, so the command is integrated to a pose, which is held within reach (a leash) of the
measured one: a robot that is held does not store up a way to jump afterwards.

What sags under a load, and the lean that the joints' friction leaves, are integrated and taken out:
``o' = rate * clip(error, -window, window)``, ``|o| <= limit`` (see ``planning.correction``).
"""

from __future__ import annotations

import numpy as np
from jaxtyping import Bool, Float

from go2_wbc.algebra.vectors import cross
from go2_wbc.compilation import Foreign, subroutine
from go2_wbc.planning.correction import (
    ANGLE_WINDOW,
    POSITION_LIMIT,
    POSITION_WINDOW,
    RATE,
    integrated,
    turn_by,
)
from go2_wbc.planning.ground import Ground, ground_at, tilt
from go2_wbc.planning.pose import lean_rotation, pose_turn
from go2_wbc.records import Array3, Array4, Record
from go2_wbc.reference import Target
from go2_wbc.robot.snapshot import Snapshot

SETTLED_COMMAND = 1e-3
"""Ramped velocity command [m/s, rad/s] below which it counts as arrived at zero."""
STRIDE_RATE, STRIDE_WINDOW = 1.0, 0.05
"""How the lean is taken out in stride [1/s], [rad], slowly and whatever a push does: 6 kg that are
believed 2 cm beside their place, as gravity is known to 1 deg, leaned a trot by 4 deg. A robot that
stands ready does it as a motion does: the joints' friction leaves 2.5 deg of a pose undone, and a
payload that reaches farther than is believed leans it by 4 deg."""
LEAN_LIMIT = 0.15
"""Greatest lean [rad] that is taken out."""


class Command(Record):
    """What the planner is asked for.

    Attributes:
        velocity: ahead, left [m/s], turning [rad/s], in the heading frame.
        pose: of the trunk: height [m], roll, pitch, yaw [rad]; see ``BodyPose``.
    """

    velocity: Array3
    pose: Array4


class Trunk(Record):
    """Where the trunk shall be.

    Attributes:
        yaw: heading [rad].
        position: of the CoM, on the level [m].
        velocity: ramped command in the heading frame [m/s], [rad/s].
        height_offset: what is added to the wanted height against a load [m].
        lean_offset: turn about x and y of the world [rad] that is added against the lean.
        pose: on top of walking level: height [m], roll, pitch, yaw [rad].
        pose_rate: of these, per second.
    """

    yaw: float
    position: Float[np.ndarray, "2"]
    velocity: Array3
    height_offset: float
    lean_offset: Float[np.ndarray, "2"]
    pose: Array4
    pose_rate: Array4


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
    for i in range(3):
        most = (angular if i == 2 else linear) * dt
        velocity[i] += min(max(command.velocity[i] - velocity[i], -most), most)


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
