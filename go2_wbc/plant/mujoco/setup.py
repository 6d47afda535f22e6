"""Turns a plant's settings into a compiled model; and what is saved of a plant."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any, NamedTuple

import mujoco
import numpy as np
from jaxtyping import Float

from go2_wbc.arguments import typed
from go2_wbc.errors import CommandError, ConfigError, DescriptionError, ModelMismatch
from go2_wbc.legs import LEGS
from go2_wbc.plant.mujoco.layout import MujocoLayout, find_layout, foot_geoms
from go2_wbc.plant.mujoco.model import JointDynamics, add_payload, build_spec, finish
from go2_wbc.plant.mujoco.pushes import Push
from go2_wbc.plant.mujoco.user_model import load_user_model
from go2_wbc.plant.sensors import ImuSample
from go2_wbc.plant.terrain import Terrain
from go2_wbc.robot.description import BASE_LINK, RobotDescription, find_description
from go2_wbc.robot.motor import MotorModel, require_motor
from go2_wbc.robot.state import JointCommand, RobotState
from go2_wbc.validation import FINITE, NOT_NEGATIVE, POSITIVE, Rule, between, ranged
from go2_wbc.world import RANGES

# Dry rubber on a hard floor; Unitree publishes none. The prototype's runs used it.
DEFAULT_FRICTION = 0.8
HEADING = Rule("within 2 pi rad (degrees: deg(90))", lambda yaw: abs(yaw) <= math.tau)


@typed()
@dataclass(frozen=True, slots=True)
@ranged(
    NOT_NEGATIVE,
    timestep=POSITIVE,
    control_period=POSITIVE,
    payload=between(0.0, 4.0 * RANGES["payload"][1]),
    **{name: between(*RANGES[name]) for name in ("friction", "mass_scale", "delay")},
    initial_yaw=HEADING,
    initial_joint_noise=between(0.0, 1.0),
    payload_place=FINITE,
)
class PlantSetup:
    """The settings of a ``MujocoPlant``; its docstring says what they mean."""

    mjcf: Path | str | None
    urdf: Path | str | None
    robot: str
    timestep: float
    control_period: float
    friction: float | None
    payload: float
    payload_place: tuple[float, float, float]
    mass_scale: float
    terrain: Terrain | None
    initial_yaw: float
    initial_joint_noise: float
    joint_dynamics: JointDynamics | None
    motor: str
    visuals: bool
    delay: float
    seed: int
    keyframe: str | None

    def __post_init__(self) -> None:
        for name in ("mjcf", "urdf"):
            path = getattr(self, name)
            if path is not None and not isinstance(path, Path | str):
                raise ConfigError(f"{name} must be a path, got {path!r}")
        if self.terrain is not None and not isinstance(self.terrain, Terrain):
            raise ConfigError(
                f"terrain must be a Terrain, as Boxes(...), or None, got {self.terrain!r}"
            )
        require_motor(self.motor)
        ratio = self.control_period / self.timestep
        if not math.isclose(ratio, round(ratio)):  # only the two decimal numbers' rounding
            raise ConfigError(
                f"control_period must be an integer multiple of timestep: "
                f"{self.control_period!r} s is {ratio:.6g} times {self.timestep!r} s"
            )
        if self.keyframe is not None and (self.mjcf is None or self.initial_yaw):
            raise ConfigError("keyframe needs an mjcf that has it, and says the initial_yaw, too")
        if self.mjcf is not None and self.terrain is not None:
            raise ConfigError("terrain is only for the built model; put it into the mjcf instead")


class SavedPhysics(NamedTuple):
    """Everything that decides how a ``MujocoPlant`` goes on; see ``MujocoPlant.save``."""

    integration: Float[np.ndarray, " n"]
    ticks: int
    pushes: tuple[Push, ...]
    waiting: tuple[Float[np.ndarray, "5 12"], ...]
    tau: Float[np.ndarray, "12"]
    forces: Float[np.ndarray, "6"]
    noise_state: Mapping[str, Any]
    state: RobotState | None
    imu: ImuSample | None
    senses: Mapping[str, Any] | None
    faults: Mapping[str, Any]
    lidar: Mapping[str, Any] | None = None

    def __repr__(self) -> str:
        """After how many ticks, and what waits."""
        return f"SavedPhysics(ticks={self.ticks}, pushes={len(self.pushes)})"


def prepare(setup: PlantSetup) -> tuple[mujoco.MjModel, MujocoLayout, MotorModel, RobotDescription]:
    """The compiled model, its index tables, its motors, and what it was taken for.

    Raises:
        ModelMismatch: if the user's MJCF cannot be used.
        DescriptionError: if the robot's files are missing or broken.
    """
    description = find_description(setup.urdf, setup.robot)
    if setup.mjcf is None:
        source, mistake = description.urdf_path, DescriptionError
        base = BASE_LINK
        spec = build_spec(
            description,
            setup.joint_dynamics or JointDynamics.of(description.profile),
            friction=DEFAULT_FRICTION if setup.friction is None else setup.friction,
            terrain=setup.terrain,
            visuals=setup.visuals,
        )
    else:
        source, mistake = setup.mjcf, ModelMismatch
        spec, base = load_user_model(setup.mjcf, description, setup.joint_dynamics)
    if setup.payload > 0.0:
        add_payload(spec, base, setup.payload, setup.payload_place)
    try:
        model = finish(spec, timestep=setup.timestep, mass_scale=setup.mass_scale)
    except ValueError as error:
        raise mistake(f"MuJoCo cannot compile {source}: {error}") from error
    if setup.mjcf is not None and setup.friction is not None:
        feet = [geom.id for leg in LEGS for geom in foot_geoms(spec, leg)]
        model.geom_friction[feet, 0] = setup.friction
        model.geom_priority[feet] = model.geom_priority.max() + 1
    layout = find_layout(spec, model, description.efforts)
    motor = MotorModel.named(setup.motor, description).with_peak(layout.torque_limits)
    return model, layout, motor, description


def command_numbers(command: JointCommand) -> Float[np.ndarray, "5 12"]:
    """The numbers of a command, in the order that the motors read.

    Raises:
        CommandError: if it has a value that is not finite, or an array of the wrong shape.
    """
    rows = [getattr(command, name) for name in _COMMANDED]
    for name, row in zip(_COMMANDED, rows, strict=True):
        if row.shape != (12,):
            raise CommandError(f"command.{name} must have shape (12,), got {row.shape}")
    numbers = np.array(rows, dtype=float)
    if not math.isfinite(np.vdot(numbers, numbers)):  # cheap, but huge numbers overflow
        for name, row in zip(_COMMANDED, rows, strict=True):
            if not np.isfinite(row).all():
                raise CommandError(f"command.{name} is not finite: {row}")
    return numbers


_COMMANDED = ("tau", "q_des", "v_des", "kp", "kd")
