"""Loads a user's own MJCF or scene of a robot, checks it, and adds what may be missing.

The file must have the robot's twelve joints below one body with a free joint, and its four feet as
bodies ``FL_foot`` or geoms ``FL_foot`` or ``FL``. Added when absent: a floor, a torque motor for a
joint that no actuator drives, and the IMU. It must have the size of the controlled robot: another
robot with joints of these names is refused, and named if there is a profile of it. Everything else
stays as in the file, except for the time step, which is the plant's. An actuator that is not a
plain torque motor is refused, never replaced; so are angles that must be degrees, and ranges that
keep the robot from folding its legs. ``starter_scene`` writes a file to start from: the robot, a
box on its back, a ramp, and keyframes.
"""

from __future__ import annotations

import re
from collections.abc import Mapping
from pathlib import Path

import mujoco
import numpy as np
from jaxtyping import Float

from go2_wbc.errors import ModelMismatch
from go2_wbc.legs import JOINT_NAMES, LEGS
from go2_wbc.plant.mujoco.forces import foot_geoms, is_on_joint
from go2_wbc.plant.mujoco.model import (
    DEFAULT_FRICTION,
    GYRO,
    JointDynamics,
    add_floor,
    add_imu,
    add_motors,
    build_spec,
    set_joint_dynamics,
)
from go2_wbc.robot.description import BASE_LINK, RobotDescription, find_description, profile_names

_BASE_FALLBACK = "go2_wbc_base"
MASS_RATIO = 1.6
"""Times heavier or lighter than the controlled robot a user's one may be: it may carry things."""
LENGTH_TOLERANCE = 0.01
"""m; files of one robot by several authors differ by 1 mm, a Go1 from a Go2 by 15."""
NARROW_RANGE = 0.2
"""rad; ranges in radians that were read as degrees are all narrower, those of a leg wider."""
RANGE_SLACK = 0.05
"""rad by which a joint may be beyond its range, of which files of several authors differ."""
LEAST_COSINE = 0.9
"""Of the angle between a joint's axis and the one meant: models of real robots are off by less."""
GRAVITY, GRAVITY_SLACK = 9.81, 0.05  #: m/s^2, and the share by which a place's may differ
_NEEDED = {
    mujoco.mjtDisableBit.mjDSBL_CONSTRAINT: "constraints",
    mujoco.mjtDisableBit.mjDSBL_CONTACT: "contacts",
    mujoco.mjtDisableBit.mjDSBL_GRAVITY: "gravity",
    mujoco.mjtDisableBit.mjDSBL_ACTUATION: "actuation",
    mujoco.mjtDisableBit.mjDSBL_SENSOR: "sensors",
}
_TURN, _DEGREES = 2.0 * np.pi, "these must be degrees, and the file's angles are in radians"
SPANS = {
    "from its front to its rear hip": ("FL_hip_joint", "RL_hip_joint"),
    "from its left to its right hip": ("FL_hip_joint", "FR_hip_joint"),
    "from its hip to its thigh's joint": ("FL_hip_joint", "FL_thigh_joint"),
    "its thigh": ("FL_thigh_joint", "FL_calf_joint"),
}
"""Distances of joints that tell one robot from another."""


def load_user_model(
    mjcf: Path | str, description: RobotDescription, joint_dynamics: JointDynamics | None = None
) -> tuple[mujoco.MjSpec, str]:
    """Reads and checks a user's MJCF; returns the completed spec and the name of its base body.

    Args:
        mjcf: the file; what it includes is read relative to it.
        description: gives the torque limits of motors that are added.
        joint_dynamics: replaces the file's joint friction, damping and armature; ``None`` keeps
            the file's.

    Raises:
        ModelMismatch: if the file cannot be read, or lacks something; the message names all that
            it lacks.
    """
    spec = _read(mjcf)
    problems = _joint_problems(spec) + _foot_problems(spec) + _actuator_problems(spec)
    if not problems:
        model = _compiled(spec, mjcf)
        problems = _other_robot(model, description) or [
            *_angle_problems(model, description),
            *_axis_problems(model),
            *_option_problems(model),
        ]
    if problems:
        title = description.profile.title
        listing = "".join(f"\n  - {problem}" for problem in problems)
        raise ModelMismatch(f"{mjcf} cannot be driven as a {title}:{listing}")
    base = _root(spec.joint(JOINT_NAMES[0]))
    base.name = base.name or _BASE_FALLBACK
    driven = {actuator.target for actuator in spec.actuators if is_on_joint(actuator)}
    add_motors(spec, [name for name in JOINT_NAMES if name not in driven], description)
    if all(sensor.name != GYRO for sensor in spec.sensors):  # else it is an export of our own
        add_imu(spec, base.name, description.profile)
    if not _has_ground(spec):
        add_floor(spec)
    if joint_dynamics is not None:
        set_joint_dynamics(spec, joint_dynamics)
    return spec, base.name


def _read(mjcf: Path | str) -> mujoco.MjSpec:
    if not Path(mjcf).is_file():
        raise ModelMismatch(f"cannot read {mjcf}: no such file")
    try:
        return mujoco.MjSpec.from_file(str(mjcf))
    except (ValueError, OSError) as error:
        raise ModelMismatch(f"MuJoCo cannot read {mjcf}: {error}") from error


def _joint_problems(spec: mujoco.MjSpec) -> list[str]:
    joints = {joint.name: joint for joint in spec.joints}
    problems = [f"no joint {name}" for name in JOINT_NAMES if name not in joints]
    present = [joints[name] for name in JOINT_NAMES if name in joints]
    problems += [
        f"joint {joint.name} is not a hinge"
        for joint in present
        if joint.type != mujoco.mjtJoint.mjJNT_HINGE
    ]
    bases = {_root(joint).id: _root(joint) for joint in present}
    if len(bases) > 1:
        names = ", ".join(repr(body.name) for body in bases.values())
        problems.append(f"the joints belong to several robots ({names}); need exactly one")
    for body in bases.values():
        kinds = [joint.type for joint in body.joints]
        if kinds != [mujoco.mjtJoint.mjJNT_FREE]:
            problems.append(f"base body {body.name!r} has no free joint")
    return problems


def _foot_problems(spec: mujoco.MjSpec) -> list[str]:
    return [
        f"no foot {leg.name}: need a colliding geom in a body {leg.foot}, "
        f"or one named {leg.foot} or {leg.name}"
        for leg in LEGS
        if not foot_geoms(spec, leg)
    ]


def _actuator_problems(spec: mujoco.MjSpec) -> list[str]:
    problems: list[str] = []
    seen: dict[str, str] = {}
    for actuator in spec.actuators:
        joint = actuator.target
        if not is_on_joint(actuator) or joint not in JOINT_NAMES:
            continue
        label = f"actuator {actuator.name or '(unnamed)'} of {joint}"
        if joint in seen:
            problems.append(f"{label} is a second actuator of the joint, besides {seen[joint]}")
        seen[joint] = actuator.name or "(unnamed)"
        problems += [f"{label} {fault}" for fault in _motor_faults(actuator)]
    return problems


def _motor_faults(actuator: mujoco.MjsActuator) -> list[str]:
    """What keeps an actuator from being a plain torque motor: 1 N m for a control of 1."""
    if actuator.biastype != mujoco.mjtBias.mjBIAS_NONE:
        return ["is a position or velocity servo; the controller needs a torque <motor>"]
    if (
        actuator.dyntype != mujoco.mjtDyn.mjDYN_NONE
        or actuator.gaintype != mujoco.mjtGain.mjGAIN_FIXED
    ):
        return ["has internal dynamics; the controller needs a torque <motor>"]
    ratio = float(actuator.gear[0] * actuator.gainprm[0])
    return [] if ratio == 1.0 else [f"has gear times gain {ratio:g}; the controller needs 1"]


def _compiled(spec: mujoco.MjSpec, mjcf: Path | str) -> mujoco.MjModel:
    try:
        return spec.copy().compile()
    except ValueError as error:
        raise ModelMismatch(f"MuJoCo cannot compile {mjcf}: {error}") from error


def _other_robot(model: mujoco.MjModel, description: RobotDescription) -> list[str]:
    """What makes it another robot than that of ``description``, and which one it is, if known."""
    problems = _size_problems(model, description)
    if not problems:
        return []
    for name in profile_names():
        other = find_description(robot=name)
        if not _size_problems(model, other):
            problems.append(f"it has the size of a {other.profile.title}: give robot={name!r}")
    return problems


def _size_problems(model: mujoco.MjModel, description: RobotDescription) -> list[str]:
    """What makes it another robot than that of ``description``, or a file in other units."""
    data = mujoco.MjData(model)
    mujoco.mj_kinematics(model, data)
    joints = {name: model.joint(name).id for name in JOINT_NAMES}
    base = model.body_rootid[model.jnt_bodyid[joints[JOINT_NAMES[0]]]]
    mass, usual = float(model.body_subtreemass[base]), description.mass
    problems = []
    if not usual / MASS_RATIO <= mass <= usual * MASS_RATIO:
        heaviest = model.body(int(np.argmax(model.body_mass)))
        problems.append(
            f"it weighs {mass:.1f} kg, the robot that is controlled {usual:.1f} kg; the heaviest "
            f"part is {heaviest.name!r}: {float(heaviest.mass[0]):.1f} kg"
        )
    anchors = {name: data.xanchor[joint] for name, joint in joints.items()}
    for what, (first, second) in SPANS.items():
        length = float(np.linalg.norm(anchors[first] - anchors[second]))
        expected = description.distance(first, second)
        if abs(length - expected) > LENGTH_TOLERANCE:
            problems.append(f"{what} is {length:.3f} m, not {expected:.3f} m")
    widths = np.ptp(model.jnt_range[list(joints.values())], axis=1)
    is_limited = model.jnt_limited[list(joints.values())] != 0
    if is_limited.any() and widths[is_limited].max() < NARROW_RANGE:
        problems.append(
            f"its joints turn by {widths[is_limited].max():.3f} rad at most: if its angles are in "
            'radians, it needs <compiler angle="radian"/>'
        )
    return problems


def _angle_problems(model: mujoco.MjModel, description: RobotDescription) -> list[str]:
    """Ranges of joints and angles of keyframes that cannot be meant."""
    problems = []
    keys = [model.key(number) for number in range(model.nkey)]
    for name, tucked in zip(JOINT_NAMES, description.profile.tucked_joints.tolist(), strict=True):
        joint = model.joint(name)
        low, high = joint.range.tolist() if model.jnt_limited[joint.id] else (-_TURN, _TURN)
        if max(-low, high) > _TURN:
            problems.append(f"{name} turns from {low:g} to {high:g} rad: {_DEGREES}")
        elif not low - RANGE_SLACK <= tucked <= high + RANGE_SLACK:
            problems.append(f"{name} turns from {low:g} to {high:g} rad: lying needs {tucked:g}")
        for key in keys:
            angle = float(key.qpos[joint.qposadr[0]])
            if abs(angle) > _TURN:
                problems.append(f"keyframe {key.name!r} has {name} at {angle:g} rad: {_DEGREES}")
    return problems


def _axis_problems(model: mujoco.MjModel) -> list[str]:
    """Joints that turn another way than those whose angles the controller takes them for."""
    data = mujoco.MjData(model)
    mujoco.mj_kinematics(model, data)
    problems = []
    for name in JOINT_NAMES:
        joint = model.joint(name).id
        base = model.body_rootid[model.jnt_bodyid[joint]]
        axis = data.xaxis[joint] @ data.xmat[base].reshape(3, 3)
        ahead = name.endswith("hip_joint")
        if axis[0 if ahead else 1] < LEAST_COSINE:
            told = ", ".join(f"{part:.2f}" for part in (axis + 0.0).tolist())
            wanted = "1, 0, 0" if ahead else "0, 1, 0"
            problems.append(f"{name} turns about ({told}) of the base, not ({wanted})")
    return problems


def _option_problems(model: mujoco.MjModel) -> list[str]:
    """Physics under which no robot can stand, or that the controller does not reckon with."""
    problems = [
        f"its <option> disables {what}"
        for flag, what in _NEEDED.items()
        if model.opt.disableflags & flag
    ]
    size, upward = float(np.linalg.norm(model.opt.gravity)), float(model.opt.gravity[2])
    if abs(size / GRAVITY - 1.0) > GRAVITY_SLACK or upward >= 0.0:
        told = f"{size:.2f} m/s^2{' upward' if upward > 0.0 else ''}"
        problems.append(f"its gravity is {told}, the controller reckons with {GRAVITY} downward")
    return problems


def _root(joint: mujoco.MjsJoint) -> mujoco.MjsBody:
    """The top body above ``joint``, whose parent is the world."""
    body = joint.parent
    while body.parent.name != "world":
        body = body.parent
    return body


def _has_ground(spec: mujoco.MjSpec) -> bool:
    """Whether the file has ground: a plane, a height field, or any colliding geom of the world."""
    kinds = (mujoco.mjtGeom.mjGEOM_PLANE, mujoco.mjtGeom.mjGEOM_HFIELD)
    return any(
        (geom.contype or geom.conaffinity) and (geom.type in kinds or geom.parent.name == "world")
        for geom in spec.geoms
    )


RAMP_PITCH = np.deg2rad(10.0)
RAMP_START, RAMP_HALF_SIZE = 0.6, (1.0, 0.6, 0.02)
"""m; from where on it rises ahead of the robot, and half its length, width and height."""
RAMP_MIDDLE = (RAMP_START + np.cos(RAMP_PITCH), 0.0, np.sin(RAMP_PITCH))  #: m; of its upper side
_BOX_MASS, _BOX_PLACE, _BOX_HALF_SIZE = 2.0, (0.0, 0.0, 0.10), (0.10, 0.06, 0.04)
_NOTES = {
    "<mujoco ": """A Go2 with a box on its back, before a ramp. Lengths in m, masses in kg, angles
     in rad. MujocoPlant("FILE") begins lying, MujocoPlant("FILE", keyframe="ramp") in a stance.""",
    '<geom name="ramp"': "The ramp: pos and quat (w x y z) of its middle, half its size.",
    '<body name="box"': "The box on the back: pos in the base's frame, half its size, mass.",
    "<keyframe>": """Where it may begin. qpos: place of the base, its quaternion w x y z,
       then hip, thigh, calf of FL, FR, RL, RR.""",
}
"""What is said above each part."""


def starter_scene(stances: Mapping[str, Float[np.ndarray, "19"]]) -> str:
    """MJCF with a keyframe for each of the configurations (quaternion x y z w).

    The meshes are those of the installed robot, by absolute paths.
    """
    spec = build_spec(find_description(), JointDynamics(), friction=DEFAULT_FRICTION)
    box = spec.body(BASE_LINK).add_body(name="box", pos=list(_BOX_PLACE))
    kind = mujoco.mjtGeom.mjGEOM_BOX
    box.add_geom(name="box", type=kind, size=list(_BOX_HALF_SIZE), mass=_BOX_MASS)
    normal = np.array([-np.sin(RAMP_PITCH), 0.0, np.cos(RAMP_PITCH)])
    spec.worldbody.add_geom(
        name="ramp",
        type=kind,
        pos=(RAMP_MIDDLE - RAMP_HALF_SIZE[2] * normal).tolist(),
        quat=[np.cos(0.5 * RAMP_PITCH), 0.0, -np.sin(0.5 * RAMP_PITCH), 0.0],
        size=list(RAMP_HALF_SIZE),
        friction=[DEFAULT_FRICTION, 0.005, 0.0001],
    )
    for name, q in stances.items():
        spec.add_key(name=name, qpos=[*q[:3], *q[[6, 3, 4, 5]], *q[7:]])
    spec.compile()
    text = spec.to_xml()
    for place, note in _NOTES.items():
        text = re.sub(f"^( *)(?={place})", rf"\1<!-- {note} -->\n\1", text, flags=re.MULTILINE)
    return text
