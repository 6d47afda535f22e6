"""What makes a robot this one: files ``profiles/NAME.toml``, one for each robot that ships.

Masses, lengths, ranges of the joints, torques and speeds come from its URDF, which the profile
names; the profile has what no URDF says.
"""

from __future__ import annotations

import tomllib
from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np

from go2_wbc.brief import brief
from go2_wbc.errors import ConfigError, unknown_name
from go2_wbc.records import V3, Array6, Array12, ArrayNx3

GO2 = "go2"  #: Name of the robot where none is given
FOLDER = Path(__file__).with_name("profiles")
SPLAY = 0.3
"""Angle [rad] of hips that put the feet beside them, so that the folded legs carry nothing."""


@dataclass(frozen=True, slots=True)
class RobotProfile:
    """A robot, beside its URDF. Triples of joints are hip, thigh, calf.

    Attributes:
        name: what ``robot=`` takes.
        title: what people call it.
        description: its folder in the ``example-robot-data`` package.
        foot_radius: radius [m] of the spherical feet.
        hip_limit: angle [rad] beyond which no hip is turned, if the URDF's range is wider.
        imu_place: place [m] of the IMU in the base frame.
        armature: rotor inertia seen at the joints [kg m^2].
        damping: viscous friction of simulated joints [N m s/rad].
        friction_loss: their dry friction [N m].
        knee_share: speed from which a driving motor's torque falls, as a share of the speed
            without load (``robot.motor``).
        envelope: speeds ahead, back, aside [m/s] and turning rate [rad/s] within which it trots
            in simulation where nothing is configured.
        stand_height: height [m] of the CoM above the ground when standing.
        sit: height [m] of the base and pitch [rad] of the dog-like sit: rump down, front legs up.
        lie_height: height [m] of the base just above the ground, from which it goes limp.
        tucked: joint angles [rad] with the feet under the hips and the belly on the ground.
        underside: points [m] of the trunk in the base frame that touch flat ground first, within
            1 cm, at tilts up to 60 deg.
        motions: arguments that motions of the library are given unless told otherwise, by motion.
        config: tables of the configuration (``go2_wbc.config``) that are other than the usual.
    """

    name: str
    title: str
    description: str
    foot_radius: float
    hip_limit: float
    imu_place: V3
    armature: V3
    damping: V3
    friction_loss: V3
    knee_share: float
    envelope: tuple[float, float, float, float]
    stand_height: float
    sit: tuple[float, float]
    lie_height: float
    tucked: V3
    underside: tuple[V3, ...]
    motions: Mapping[str, Mapping[str, float]] = field(default_factory=dict, hash=False)
    config: Mapping[str, Any] = field(default_factory=dict, hash=False)

    __repr__ = brief

    @property
    def stand_pose(self) -> Array6:
        """CoM position [m] in the motion's frame, then roll, pitch, yaw [rad], when standing."""
        return np.array([0.0, 0.0, self.stand_height, 0.0, 0.0, 0.0])

    @property
    def sit_pose(self) -> Array6:
        """Base position [m] and roll, pitch, yaw [rad] when sitting."""
        return np.array([0.0, 0.0, self.sit[0], 0.0, self.sit[1], 0.0])

    @property
    def lie_pose(self) -> Array6:
        """Base position [m] and roll, pitch, yaw [rad] just above lying."""
        return np.array([0.0, 0.0, self.lie_height, 0.0, 0.0, 0.0])

    @property
    def tucked_joints(self) -> Array12:
        """Joint angles [rad] with the legs folded below the trunk."""
        return np.tile(self.tucked, 4)

    @property
    def splayed_joints(self) -> Array12:
        """Joint angles [rad] with the folded legs beside the trunk."""
        return self.tucked_joints + np.tile([SPLAY, 0.0, 0.0, -SPLAY, 0.0, 0.0], 2)

    @property
    def underside_points(self) -> ArrayNx3:
        """``underside`` as an array."""
        return np.array(self.underside)


def profile_names() -> tuple[str, ...]:
    """The robots that ship."""
    return tuple(sorted(file.stem for file in FOLDER.glob("*.toml")))


@cache
def find_profile(name: str = GO2) -> RobotProfile:
    """The profile of a robot that ships.

    Raises:
        ConfigError: for an unknown one; lists the valid ones.
    """
    if name not in profile_names():
        raise ConfigError(unknown_name("robot", str(name), profile_names()))
    values = tomllib.loads((FOLDER / f"{name}.toml").read_text(encoding="utf-8"))
    numbers: dict[str, Any] = {key: _tuples(value) for key, value in values.items()}
    return RobotProfile(name=name, **numbers)


def _tuples(value: object) -> object:
    return tuple(_tuples(part) for part in value) if isinstance(value, list) else value
