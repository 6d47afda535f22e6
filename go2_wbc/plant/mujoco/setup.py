"""Turns a plant's settings into a compiled model and lays the robot on the ground."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from pathlib import Path

import mujoco
import numpy as np

from go2_wbc.errors import ConfigError, DescriptionError, ModelMismatch
from go2_wbc.legs import LEGS
from go2_wbc.plant.mujoco.layout import MujocoLayout, find_layout, foot_geoms
from go2_wbc.plant.mujoco.model import JointDynamics, add_payload, build_spec, finish
from go2_wbc.plant.mujoco.user_model import load_user_model
from go2_wbc.plant.terrain import Boxes
from go2_wbc.robot.description import BASE_LINK, find_description
from go2_wbc.robot.motor import MotorModel, require_motor
from go2_wbc.validation import require_finite, require_not_negative, require_positive

# Dry rubber on a hard floor; Unitree publishes none. The prototype's runs used it.
DEFAULT_FRICTION = 0.8
# Joint angles [rad] of the Go2 lying limp, belly down: where this model comes to rest within 1e-3
# after 15 s of damped simulation. Gravity folds the calves onto their limit of -2.7227.
LYING_POSE = (
    *(0.053, 1.236, -2.722),
    *(-0.053, 1.236, -2.722),
    *(0.372, 1.239, -2.722),
    *(-0.372, 1.239, -2.722),
)
LYING_DAMPING = 3.0  # N m s/rad of the joints while lying; the value of Unitree's damping mode
_DROP_HEIGHT = 0.11  # m of the base above the ground; it rests at 0.085
_SETTLE_LIMIT = 3.0  # s of simulation; it settles in well under one
_SETTLED_SPEED = 1e-3  # rad/s and m/s, largest entry of the velocity
_RAY_TOP = 20.0  # m above the world's origin from which the ground is looked for
_FOOTPRINT = (-0.3, 0.0, 0.3)  # m; the grid, about the Go2's size, on which it is looked for


@dataclass(frozen=True, slots=True)
class PlantSetup:
    """The settings of a ``MujocoPlant``; its docstring says what they mean."""

    mjcf: Path | str | None
    urdf: Path | str | None
    timestep: float
    control_period: float
    friction: float | None
    payload: float
    mass_scale: float
    terrain: Boxes | None
    initial_yaw: float
    initial_joint_noise: float
    joint_dynamics: JointDynamics | None
    motor: str
    visuals: bool
    seed: int

    def __post_init__(self) -> None:
        for name in ("mjcf", "urdf"):
            path = getattr(self, name)
            if path is not None and not isinstance(path, Path | str):
                raise ConfigError(f"{name} must be a path, got {path!r}")
        if self.terrain is not None and not isinstance(self.terrain, Boxes):
            raise ConfigError(f"terrain must be Boxes(...) or None, got {self.terrain!r}")
        require_positive(self, "timestep", "control_period", "mass_scale")
        if self.friction is not None:
            require_positive(self, "friction")
        require_not_negative(self, "payload", "initial_joint_noise", "seed")
        require_finite(self, "initial_yaw")
        require_motor(self.motor)
        ratio = self.control_period / self.timestep
        if not math.isclose(ratio, round(ratio)):  # only the two decimal numbers' rounding
            raise ConfigError(
                f"control_period must be an integer multiple of timestep: "
                f"{self.control_period!r} s is {ratio:.6g} times {self.timestep!r} s"
            )
        if self.mjcf is not None and self.terrain is not None:
            raise ConfigError("terrain is only for the built model; put it into the mjcf instead")


def prepare(setup: PlantSetup) -> tuple[mujoco.MjModel, MujocoLayout, MotorModel]:
    """The compiled model, its index tables and its motors.

    Raises:
        ModelMismatch: if the user's MJCF cannot be used.
        DescriptionError: if the robot's files are missing or broken.
    """
    description = find_description(setup.urdf)
    if setup.mjcf is None:
        source, mistake = description.urdf_path, DescriptionError
        base = BASE_LINK
        spec = build_spec(
            description,
            setup.joint_dynamics or JointDynamics(),
            friction=DEFAULT_FRICTION if setup.friction is None else setup.friction,
            terrain=setup.terrain,
            visuals=setup.visuals,
        )
    else:
        source, mistake = setup.mjcf, ModelMismatch
        spec, base = load_user_model(setup.mjcf, description, setup.joint_dynamics)
    if setup.payload > 0.0:
        add_payload(spec, base, setup.payload)
    try:
        model = finish(spec, timestep=setup.timestep, mass_scale=setup.mass_scale)
    except ValueError as error:
        raise mistake(f"MuJoCo cannot compile {source}: {error}") from error
    if setup.mjcf is not None and setup.friction is not None:
        feet = [geom.id for leg in LEGS for geom in foot_geoms(spec, leg)]
        model.geom_friction[feet, 0] = setup.friction
        model.geom_priority[feet] = model.geom_priority.max() + 1
    layout = find_layout(spec, model, description.efforts)
    motor = replace(MotorModel.named(setup.motor, description), peak=layout.torque_limits)
    return model, layout, motor


def settle(
    model: mujoco.MjModel,
    data: mujoco.MjData,
    layout: MujocoLayout,
    setup: PlantSetup,
    rng: np.random.Generator,
) -> None:
    """Lets the damped robot drop a few centimetres, belly down and legs folded, and come to rest.

    Leaves ``data`` as ``mj_step1`` does.
    """
    _place(model, data, layout, setup.initial_yaw)
    pose = np.array(LYING_POSE) + setup.initial_joint_noise * rng.standard_normal(12)
    joints = model.dof_jntid[layout.joint_v]
    is_limited, ranges = model.jnt_limited[joints, None], model.jnt_range[joints]
    low, high = np.where(is_limited, ranges, (-np.inf, np.inf)).T
    data.qpos[layout.joint_q] = np.clip(pose, low, high)
    data.ctrl[:] = 0.0
    limits = layout.torque_limits
    mujoco.mj_step1(model, data)
    for _ in range(round(_SETTLE_LIMIT / setup.timestep)):
        tau = -LYING_DAMPING * data.qvel[layout.joint_v]
        data.ctrl[layout.motors] = np.clip(tau, -limits, limits)
        mujoco.mj_step2(model, data)
        mujoco.mj_step1(model, data)
        if data.ncon and np.abs(data.qvel).max() < _SETTLED_SPEED:
            break


def _place(model: mujoco.MjModel, data: mujoco.MjData, layout: MujocoLayout, yaw: float) -> None:
    """Puts the base a little above the highest ground around the origin."""
    base_q = data.qpos[layout.base_q]
    base_q[:2] = 0.0
    base_q[2] = 2.0 * _RAY_TOP  # out of the rays' way
    base_q[3:] = (math.cos(0.5 * yaw), 0.0, 0.0, math.sin(0.5 * yaw))
    mujoco.mj_kinematics(model, data)
    geom, down = np.zeros(1, dtype=np.int32), np.array([0.0, 0.0, -1.0])
    tops = [np.array([x, y, _RAY_TOP]) for x in _FOOTPRINT for y in _FOOTPRINT]
    distances = [mujoco.mj_ray(model, data, top, down, None, True, -1, geom) for top in tops]
    ground = max((_RAY_TOP - distance for distance in distances if distance >= 0.0), default=0.0)
    base_q[2] = ground + _DROP_HEIGHT
