"""The trunk's pose on top of walking: height, roll, pitch and yaw that are asked for, and the way.

The pose is taken from that of a trunk which walks: level along the ground, at the walking height,
facing the heading. The heading stays that of the command and of the feet, so that a trunk with yaw
looks aside while it walks ahead. A new pose is approached without a jump of its rates: each is
``sharpness`` times what is missing, within a greatest rate, and changes by ``sharpness`` times that
in a second at most, which is as fast as it must fall at the end, so that nothing overshoots.
"""

from __future__ import annotations

from dataclasses import dataclass, fields

import numpy as np
from jaxtyping import Float

from go2_wbc.compilation import subroutine
from go2_wbc.errors import CommandError, ConfigError
from go2_wbc.planning.command import finite_number
from go2_wbc.validation import NOT_NEGATIVE, POSITIVE, ranged


@dataclass(frozen=True, slots=True)
class BodyPose:
    """Of the trunk, from that of one that walks level, facing ahead.

    Attributes:
        height: above the walking height [m], negative is lower.
        roll: positive lowers the right side [rad].
        pitch: positive lowers the front [rad].
        yaw: positive looks to the left of the heading [rad].
    """

    height: float = 0.0
    roll: float = 0.0
    pitch: float = 0.0
    yaw: float = 0.0

    def __post_init__(self) -> None:
        """Make every component a float; raise CommandError unless it is a finite number."""
        for part in fields(self):
            object.__setattr__(self, part.name, finite_number(part.name, getattr(self, part.name)))

    @property
    def row(self) -> Float[np.ndarray, "4"]:
        """Height [m], roll, pitch, yaw [rad]."""
        return np.array([self.height, self.roll, self.pitch, self.yaw])


LEVEL = BodyPose()
"""The pose of a robot that walks and is asked for nothing else."""


@dataclass(frozen=True, slots=True)
@ranged(highest=NOT_NEGATIVE, roll=NOT_NEGATIVE, pitch=NOT_NEGATIVE, yaw=NOT_NEGATIVE)
class PoseEnvelope:
    """Poses that are held while the robot walks, each with all others at their bounds.

    Attributes:
        lowest, highest: heights, from the walking height [m]; 0 lies between.
        roll, pitch, yaw: angles either way [rad].
    """

    lowest: float = -0.05
    highest: float = 0.02
    roll: float = 0.15
    pitch: float = 0.15
    yaw: float = 0.20

    def __post_init__(self) -> None:
        """Raise ConfigError for a lowest trunk that is above the usual one."""
        if not -np.inf < self.lowest <= 0.0:
            raise ConfigError(f"PoseEnvelope.lowest must be 0 or below, got {self.lowest!r}")

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
    """How a new pose is approached (own choice: about a second for what is allowed).

    Attributes:
        height_rate: greatest rate of the height [m/s].
        turning_rate: greatest rate of roll, pitch and yaw [rad/s].
        sharpness: share of what is missing that is made up in a second, near the end [1/s].
    """

    height_rate: float = 0.10
    turning_rate: float = 0.35
    sharpness: float = 5.0


@subroutine
def advance_pose(
    pose: Float[np.ndarray, "4"],
    rate: Float[np.ndarray, "4"],
    c: PoseConfig,
    asked: Float[np.ndarray, "4"],
    dt: float,
) -> None:
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
def lean_rotation(pose: Float[np.ndarray, "4"], R: Float[np.ndarray, "3 3"]) -> None:
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
def pose_turn(
    yaw: float,
    pose: Float[np.ndarray, "4"],
    rate: Float[np.ndarray, "4"],
    turn: Float[np.ndarray, "3"],
    w: Float[np.ndarray, "3"],
) -> None:
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
