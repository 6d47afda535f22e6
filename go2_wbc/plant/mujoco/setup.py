"""Turns a plant's settings into a compiled model, and lets the robot settle in its first pose.

It is laid on the ground, or held in a keyframe until it rests. Its last millimetres take 2.6 s of
simulation, 0.06 s of processor time, at every start. What comes out is kept beside the compiled
kernels, for this processor, under a hash of the model, of the state it fell from and of this file:
the next start continues with the same bits.
"""

from __future__ import annotations

import hashlib
import math
import shutil
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any, NamedTuple

import mujoco
import numpy as np
from jaxtyping import Float

from go2_wbc.arguments import typed
from go2_wbc.errors import ConfigError, DescriptionError, ModelMismatch, unknown_name
from go2_wbc.files import write_atomically
from go2_wbc.legs import LEGS
from go2_wbc.machine_code import kernel_folder
from go2_wbc.plant.mujoco.forces import MujocoLayout, Push, find_layout, foot_geoms
from go2_wbc.plant.mujoco.model import (
    DEFAULT_FRICTION,
    JointDynamics,
    add_payload,
    build_spec,
    finish,
)
from go2_wbc.plant.mujoco.user_model import load_user_model
from go2_wbc.plant.sensors import ImuSample
from go2_wbc.plant.terrain import Terrain
from go2_wbc.robot.description import BASE_LINK, RobotDescription, find_description
from go2_wbc.robot.motor import MotorModel, require_motor
from go2_wbc.robot.state import JointCommand, RobotState
from go2_wbc.validation import FINITE, NOT_NEGATIVE, POSITIVE, Rule, between, ranged
from go2_wbc.world import RANGES

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
    commands: tuple[int, tuple[Float[np.ndarray, "5 12"], ...]]
    tau: Float[np.ndarray, "12"]
    forces: Float[np.ndarray, "6"]
    noise_state: Mapping[str, Any]
    state: RobotState | None
    imu: ImuSample | None
    senses: Mapping[str, Any] | None
    faults: Mapping[str, Any]
    lidar: Mapping[str, Any] | None = None

    def __repr__(self) -> str:
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


# Joint angles [rad] of the Go2 lying limp, belly down: where this model comes to rest within 1e-3
# after 15 s of damped simulation. Gravity folds the calves onto their limit of -2.7227.
LYING_POSE = (
    *(0.053, 1.236, -2.722),
    *(-0.053, 1.236, -2.722),
    *(0.372, 1.239, -2.722),
    *(-0.372, 1.239, -2.722),
)
LYING_DAMPING = 3.0  # N m s/rad of the joints while lying; the value of Unitree's damping mode
HOLDING = (200.0, 4.0)  # N m/rad, N m s/rad of joints held in a keyframe: a stance sinks by 7 mm
_DROP_HEIGHT = 0.11  # m of the base above the ground; it rests at 0.085
_SETTLE_LIMIT = 3.0  # s of simulation; it settles in well under one
_SETTLED_SPEED = 1e-3  # rad/s and m/s, largest entry of the velocity
_RAY_TOP = 20.0  # m above the world's origin from which the ground is looked for
_FOOTPRINT = (-0.3, 0.0, 0.3)  # m; the grid, about the Go2's size, on which it is looked for
_STATE = mujoco.mjtState.mjSTATE_INTEGRATION
_KEPT_STATES = 500  # files of 1 kB; when there are more, all go


def settle(
    model: mujoco.MjModel,
    data: mujoco.MjData,
    layout: MujocoLayout,
    setup: PlantSetup,
    rng: np.random.Generator,
) -> JointCommand:
    """Lets the damped robot drop a few centimetres, belly down and legs folded, and come to rest.

    Or brings it to rest with its joints held where the keyframe of ``setup`` has them. Leaves
    ``data`` as ``mj_step1`` does, and returns the command under which it rests.

    Raises:
        ConfigError: for a keyframe that the model does not have.
        ModelMismatch: if there is no ground below the robot.
    """
    if setup.keyframe is None:
        _place(model, data, layout, setup.initial_yaw)
        pose = np.array(LYING_POSE)
    else:
        names = [model.key(number).name for number in range(model.nkey)]
        if setup.keyframe not in names:
            raise ConfigError(unknown_name("keyframe", setup.keyframe, names))
        mujoco.mj_resetDataKeyframe(model, data, names.index(setup.keyframe))
        pose = data.qpos[layout.joint_q].copy()
    pose = pose + setup.initial_joint_noise * rng.standard_normal(12)
    joints = model.dof_jntid[layout.joint_v]
    is_limited, ranges = model.jnt_limited[joints, None], model.jnt_range[joints]
    low, high = np.where(is_limited, ranges, (-np.inf, np.inf)).T
    data.qpos[layout.joint_q] = np.clip(pose, low, high)
    data.ctrl[:] = 0.0
    resting = JointCommand.damping(LYING_DAMPING)
    if setup.keyframe is not None:
        resting = JointCommand.servo(pose, np.zeros(12), *HOLDING)
    kept = _kept_file(model, data, resting)
    state = None if kept is None else _read(kept, mujoco.mj_stateSize(model, _STATE))
    if state is not None:
        mujoco.mj_setState(model, data, state, _STATE)
        mujoco.mj_step1(model, data)
        return resting
    _come_to_rest(model, data, layout, resting)
    if kept is not None and not data.warning.number.any():
        state = np.empty(mujoco.mj_stateSize(model, _STATE))
        mujoco.mj_getState(model, data, state, _STATE)
        _write(kept, state)
    return resting


def _come_to_rest(
    model: mujoco.MjModel, data: mujoco.MjData, layout: MujocoLayout, resting: JointCommand
) -> None:
    limits = layout.torque_limits
    mujoco.mj_step1(model, data)
    for _ in range(round(_SETTLE_LIMIT / model.opt.timestep)):
        tau = resting.asked(data.qpos[layout.joint_q], data.qvel[layout.joint_v])
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
    found = [_RAY_TOP - distance for distance in distances if distance >= 0.0]
    if not (found or _has_floor(model)):
        raise ModelMismatch("there is no ground at x = y = 0, where the robot begins lying")
    base_q[2] = max(found, default=0.0) + _DROP_HEIGHT


def _has_floor(model: mujoco.MjModel) -> bool:
    """Whether a plane collides: unseen, and beyond what is drawn of it, no ray meets it."""
    collides = (model.geom_contype | model.geom_conaffinity).astype(bool)
    return bool((collides & (model.geom_type == mujoco.mjtGeom.mjGEOM_PLANE)).any())


def _kept_file(model: mujoco.MjModel, data: mujoco.MjData, resting: JointCommand) -> Path | None:
    """Where the outcome is kept; None if nothing can be."""
    folder = kernel_folder()
    if folder is None:
        return None
    binary = np.empty(mujoco.mj_sizeModel(model), dtype=np.uint8)
    mujoco.mj_saveModel(model, None, binary)
    start = np.empty(mujoco.mj_stateSize(model, _STATE))
    mujoco.mj_getState(model, data, start, _STATE)
    digest = hashlib.sha256(mujoco.mj_versionString().encode() + Path(__file__).read_bytes())
    digest.update(binary.data)
    digest.update(start.data)
    digest.update(resting.kp.data)
    return folder / "lying" / digest.hexdigest()[:32]


def _read(file: Path, size: int) -> Float[np.ndarray, " size"] | None:
    """The state that was kept, if there is one and it is whole."""
    try:
        content = file.read_bytes()
    except OSError:
        return None
    numbers = content[: 8 * size]
    if content[8 * size :] != hashlib.sha256(numbers).digest():
        return None
    return np.frombuffer(numbers)


def _write(file: Path, state: Float[np.ndarray, " size"]) -> None:
    """Keep ``state``; where that is refused, the next start simulates again."""
    numbers = state.tobytes()
    try:
        file.parent.mkdir(exist_ok=True)
        if len(list(file.parent.iterdir())) >= _KEPT_STATES:
            shutil.rmtree(file.parent)
            file.parent.mkdir()
        write_atomically(file, numbers + hashlib.sha256(numbers).digest())
    except (OSError, ConfigError):
        return
