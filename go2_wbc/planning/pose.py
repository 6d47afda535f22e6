"""The trunk's pose on top of walking: height, roll, pitch and yaw that are asked for, and the way.

The pose is taken from that of a trunk which walks: level along the ground, at the walking height,
facing the heading. The heading stays that of the command and of the feet, so that a trunk with yaw
looks aside while it walks ahead. A new pose is approached without a jump of its rates: each is
``sharpness`` times what is missing, within a greatest rate, and changes by ``sharpness`` times that
in a second at most, which is as fast as it must fall at the end, so that nothing overshoots.

``kernels.pose`` is the compiled form.
"""

from __future__ import annotations

from dataclasses import dataclass, fields

import numpy as np
from jaxtyping import Float

from go2_wbc.errors import CommandError, ConfigError
from go2_wbc.planning.command import finite_number
from go2_wbc.robot.rotations import angular_velocity_from_rpy, rotation_from_rpy
from go2_wbc.validation import require_not_negative, require_positive


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
        """Raise ConfigError for a bound on the wrong side of 0."""
        require_not_negative(self, "highest", "roll", "pitch", "yaw")
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

    def __post_init__(self) -> None:
        """Raise ConfigError for a number that is not positive."""
        require_positive(self, "height_rate", "turning_rate", "sharpness")


class PosePath:
    """The pose on its way to the one that is asked for.

    Attributes:
        pose: height [m], roll, pitch, yaw [rad].
        rate: of these, per second.
    """

    def __init__(self, config: PoseConfig) -> None:
        """Begin level, at rest."""
        self._sharpness = config.sharpness
        self._most = np.array([config.height_rate] + [config.turning_rate] * 3)
        self.pose, self.rate = np.zeros(4), np.zeros(4)

    def advance(self, target: BodyPose, dt: float) -> None:
        """Bring the pose nearer to ``target`` in ``dt`` seconds."""
        self.pose, self.rate = self._after(self.pose, self.rate, target.row, dt)

    def ahead(self, target: BodyPose, step: float, count: int) -> Float[np.ndarray, "count 2 4"]:
        """Pose and rate at the ends of the next ``count`` steps [s]."""
        path, pose, rate, wanted = np.empty((count, 2, 4)), self.pose, self.rate, target.row
        for node in path:
            pose, rate = self._after(pose, rate, wanted, step)
            node[:] = pose, rate
        return path

    def _after(
        self,
        pose: Float[np.ndarray, "4"],
        rate: Float[np.ndarray, "4"],
        target: Float[np.ndarray, "4"],
        dt: float,
    ) -> tuple[Float[np.ndarray, "4"], Float[np.ndarray, "4"]]:
        wanted = np.clip(self._sharpness * (target - pose), -self._most, self._most)
        change = self._sharpness * self._most * dt
        rate = rate + np.clip(wanted - rate, -change, change)
        return pose + rate * dt, rate

    @property
    def rotation(self) -> Float[np.ndarray, "3 3"]:
        """Of the trunk, from that of one that walks level, facing ahead."""
        return rotation_from_rpy(*self.pose[1:].tolist())


def pose_turn(
    yaw: float, pose: Float[np.ndarray, "4"], rate: Float[np.ndarray, "4"]
) -> tuple[Float[np.ndarray, "3"], Float[np.ndarray, "3"]]:
    """What roll, pitch and yaw of a pose add to a level trunk of that heading ``yaw`` [rad].

    Returns:
        The turn [rad] from a level trunk that has the pose's yaw already (the quaternions of pitch
        and roll, multiplied), and the angular velocity [rad/s]; both are vectors in the world.
    """
    roll, pitch, aside = pose[1:].tolist()
    facing = yaw + aside
    w, _ = angular_velocity_from_rpy(np.array([roll, pitch, facing]), rate[1:].copy(), np.zeros(3))
    sr, cr, sp, cp = np.sin(roll / 2), np.cos(roll / 2), np.sin(pitch / 2), np.cos(pitch / 2)
    x, y, z = cp * sr, sp * cr, -sp * sr
    length = float(np.sqrt(x * x + y * y + z * z))
    share = 2.0 * float(np.arctan2(length, cp * cr)) / length if length > 0.0 else 2.0
    cosine, sine = np.cos(facing), np.sin(facing)
    turn = share * np.array([cosine * x - sine * y, sine * x + cosine * y, z])
    return turn, w
