"""The trunk's way: the command ramped, integrated to a pose and kept near the robot.

The velocity is in the heading frame (z up, x along the reference's yaw); the heading is integrated
first and turns it.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Float

from go2_wbc.planning.command import VelocityCommand
from go2_wbc.planning.correction import CorrectionConfig, SteadyStateCorrection
from go2_wbc.planning.ground import GroundPlane, tilted_rotation
from go2_wbc.planning.pose import BodyPose, PoseConfig, PosePath, pose_turn
from go2_wbc.reference import BodyTarget, TrackedPoint
from go2_wbc.robot.rotations import exp_rotation, wrap_angle, yaw_rotation
from go2_wbc.robot.snapshot import Snapshot

SETTLED_COMMAND = 1e-3
"""Ramped velocity command [m/s, rad/s] below which it counts as arrived at zero."""
READY = CorrectionConfig(angle_limit=0.15)
"""How the lean of a robot that stands ready is taken out. The joints' friction leaves 2.5 deg of a
pose undone, and a payload that reaches farther than is believed leans it by 4 deg."""
STRIDE = CorrectionConfig(rate=1.0, angle_window=0.05, angle_limit=0.15)
"""The same in stride, slowly and whatever a push does: 6 kg that are believed 2 cm beside their
place, as gravity is known to 1 deg, leaned a trot by 4 deg."""


@dataclass(frozen=True, slots=True)
class TrunkLimits:
    """How fast the reference changes, and how far it may run ahead of the robot.

    Attributes:
        rate: greatest change of the velocity: ahead, left [m/s^2], turning [rad/s^2].
        position_leash: [m].
        yaw_leash: [rad].
        pose: how a new pose is approached.
    """

    rate: Float[np.ndarray, "3"]
    position_leash: float
    yaw_leash: float
    pose: PoseConfig


class TrunkPath:
    """Where the trunk shall be.

    Attributes:
        yaw: heading [rad].
        position: of the CoM, on the level [m].
        velocity: ramped command in the heading frame [m/s], [rad/s].
        height_offset: what is added to the wanted height against a load [m].
        pose: on top of walking level.
    """

    def __init__(self, snapshot: Snapshot, limits: TrunkLimits) -> None:
        """Begin where the robot is, at rest."""
        self._limits = limits
        self.yaw = snapshot.state.yaw
        self.position = snapshot.p_world_com[:2].copy()
        self.velocity = np.zeros(3)
        self.height_offset = 0.0
        self.pose = PosePath(limits.pose)
        self._correction = SteadyStateCorrection()
        self._lean_offset = np.zeros(2)

    @property
    def is_settled(self) -> bool:
        """Whether the ramped command has arrived at zero."""
        return bool(np.abs(self.velocity).max() < SETTLED_COMMAND)

    @property
    def world_velocity(self) -> Float[np.ndarray, "3"]:
        """Wanted velocity of the CoM [m/s]."""
        return yaw_rotation(self.yaw) @ np.array([self.velocity[0], self.velocity[1], 0.0])

    def integrate(
        self, snapshot: Snapshot, command: VelocityCommand, pose: BodyPose, dt: float
    ) -> None:
        """Ramp towards ``command`` and ``pose``, integrate to the place, and apply the leash."""
        limits = self._limits
        self.pose.advance(pose, dt)
        wanted = np.array([command.linear_x, command.linear_y, command.angular_z])
        most = limits.rate * dt
        self.velocity += np.clip(wanted - self.velocity, -most, most)
        self.yaw += self.velocity[2] * dt
        lead = wrap_angle(self.yaw + self.pose.pose[3] - snapshot.state.yaw)
        self.yaw += np.clip(lead, -limits.yaw_leash, limits.yaw_leash) - lead
        self.position = self.position + self.world_velocity[:2] * dt
        offset = self.position - snapshot.p_world_com[:2]
        distance = float(np.linalg.norm(offset))
        if distance > limits.position_leash:
            self.position = snapshot.p_world_com[:2] + offset * (limits.position_leash / distance)

    def correct_height(self, snapshot: Snapshot, height: float, dt: float) -> None:
        """Integrate the error from ``height`` [m], the pose's added: a payload makes it sag."""
        sag = height + self.pose.pose[0] - snapshot.p_world_com[2]
        error = np.array([0.0, 0.0, sag, 0.0, 0.0, 0.0])
        self.height_offset = float(self._correction.update(error, dt)[2])

    def levelled(
        self, target: BodyTarget, snapshot: Snapshot, dt: float, *, is_stepping: bool
    ) -> BodyTarget:
        """``target`` turned against the lean that is left, ``dt`` seconds after the last one.

        That is the integral of the vertical's error. It rests while a foot of a robot that stands
        ready has no contact.
        """
        R, numbers = target.R_world_base, STRIDE if is_stepping else READY
        if is_stepping or snapshot.state.feet_in_contact.all():
            error = np.cross(snapshot.R_world_base[:, 2], R[:, 2])[:2]
            counted = np.clip(error, -numbers.angle_window, numbers.angle_window)
            offset, limit = self._lean_offset + numbers.rate * dt * counted, numbers.angle_limit
            self._lean_offset = np.clip(offset, -limit, limit)
        return replace(target, R_world_base=exp_rotation(np.append(self._lean_offset, 0.0)) @ R)

    def place(self, ground: GroundPlane, height: float) -> Float[np.ndarray, "3"]:
        """Where the CoM of a level trunk shall be [m]: ``height`` above ground, plus the offset."""
        top = ground.at(self.position) + height + self.height_offset
        return np.array([*self.position, top])

    def target(self, ground: GroundPlane, height: float) -> BodyTarget:
        """The trunk's reference: along the ground, its CoM at ``height`` [m], with the pose."""
        v_world = self.world_velocity
        (raised, *_), (rising, *_) = self.pose.pose, self.pose.rate
        v_world[2] = ground.slope @ v_world[:2] + rising
        _, w_world = pose_turn(self.yaw, self.pose.pose, self.pose.rate)
        return BodyTarget(
            point=TrackedPoint.COM,
            p_world=self.place(ground, height) + [0.0, 0.0, raised],
            v_world=v_world,
            a_world=np.zeros(3),
            R_world_base=tilted_rotation(self.yaw, ground.tilt) @ self.pose.rotation,
            w_world=w_world + [0.0, 0.0, self.velocity[2]],
            dw_world=np.zeros(3),
        )
