"""Builds the MuJoCo model of a robot from the same URDF that Pinocchio loads.

The URDF's bodies keep their masses and inertias exactly; what the URDF lacks (floor, motors, joint
friction, contact parameters) is added here, of the robot by its profile. Its looks are
the URDF's .dae meshes, which MuJoCo cannot read.
"""

from __future__ import annotations

import xml.etree.ElementTree as ET
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import NamedTuple

import mujoco
import numpy as np
from jaxtyping import Float

from go2_wbc.arguments import typed
from go2_wbc.errors import DescriptionError
from go2_wbc.legs import FOOT_NAMES, JOINT_NAMES
from go2_wbc.plant.terrain import Terrain
from go2_wbc.robot.description import (
    BASE_LINK,
    MeshPart,
    RobotDescription,
    RobotProfile,
    find_profile,
    read_mesh,
    solid,
)
from go2_wbc.validation import NOT_NEGATIVE, ranged
from go2_wbc.world import PAYLOAD_HALF_SIZE

FLOOR = "go2_wbc_floor"
_GRID = "go2_wbc_grid"
IMU_SITE = "go2_wbc_imu"
GYRO = "go2_wbc_gyro"
ACCELEROMETER = "go2_wbc_accelerometer"
ORIENTATION = "go2_wbc_orientation"
PAYLOAD_BODY = "go2_wbc_payload"

DEFAULT_FRICTION = 0.8  #: Dry rubber on a hard floor; Unitree publishes none
# Torsional (m) and rolling (m) friction: MuJoCo's defaults; unused by point contacts (condim 3).
_TORSIONAL, _ROLLING = 0.005, 0.0001
# Ratio of frictional to normal constraint impedance. 1 lets a standing foot creep; 10 does not, and
# still converges in 2 ms steps (MuJoCo documentation, "impratio", advises large values for grip).
_IMPRATIO = 10.0
_POINT = 1e-5  # kg, of a link that stands for a frame only
_FLOOR_HALF_SIZE = (0.0, 0.0, 0.05)  # m; 0 is infinite, the third is the rendered grid spacing


@typed()
@dataclass(frozen=True, slots=True)
@ranged(NOT_NEGATIVE)
class JointDynamics:
    """What the URDF does not say about the joints; each triple is hip, thigh, calf.

    By default that of a Go2's profile, which says where it comes from.
    """

    armature: tuple[float, float, float] = field(default_factory=lambda: find_profile().armature)
    """Rotor inertia seen at the joint [kg m^2]."""
    damping: tuple[float, float, float] = field(default_factory=lambda: find_profile().damping)
    """Viscous friction [N m s/rad]."""
    friction_loss: tuple[float, float, float] = field(
        default_factory=lambda: find_profile().friction_loss
    )  #: dry friction [N m]

    @staticmethod
    def of(profile: RobotProfile) -> JointDynamics:
        """Those of a robot."""
        return JointDynamics(profile.armature, profile.damping, profile.friction_loss)

    def scaled(self, friction: float) -> JointDynamics:
        """The same with friction and damping ``friction`` times as large."""
        damping, loss = (
            (friction * hip, friction * thigh, friction * calf)
            for hip, thigh, calf in (self.damping, self.friction_loss)
        )
        return replace(self, damping=damping, friction_loss=loss)

    @staticmethod
    def none() -> JointDynamics:
        """Ideal joints, exactly the URDF: for comparing with Pinocchio."""
        zeros = (0.0, 0.0, 0.0)
        return JointDynamics(zeros, zeros, zeros)


def build_spec(
    description: RobotDescription,
    joint_dynamics: JointDynamics,
    *,
    friction: float,
    terrain: Terrain | None = None,
    visuals: bool = False,
) -> mujoco.MjSpec:
    """The robot of ``description`` on a floor, with torque motors and an IMU.

    Args:
        description: which files.
        joint_dynamics: friction, damping and armature of the joints.
        friction: sliding friction coefficient of every pair of surfaces.
        terrain: the ground, where it is not a level floor.
        visuals: also convert the .dae visual meshes, which takes about 2 s; physics ignores them.

    Raises:
        DescriptionError: if MuJoCo cannot read the URDF or a mesh is missing.
    """
    spec = _spec_from_urdf(description)
    spec.modelname = description.profile.name
    spec.body(BASE_LINK).add_freejoint(name="root")
    _replace_feet(spec, description.profile.foot_radius)
    _exclude_pairs(spec, description)
    set_joint_dynamics(spec, joint_dynamics)
    add_motors(spec, JOINT_NAMES, description)
    add_imu(spec, BASE_LINK, description.profile)
    add_floor(spec)
    for geom in spec.geoms:
        geom.friction = [friction, _TORSIONAL, _ROLLING]
    if terrain is not None:
        add_terrain(spec, terrain, friction)
    if visuals:
        add_visuals(spec, description)
    spec.option.cone = mujoco.mjtCone.mjCONE_ELLIPTIC
    spec.option.impratio = _IMPRATIO
    spec.option.integrator = mujoco.mjtIntegrator.mjINT_IMPLICITFAST
    return spec


def _spec_from_urdf(description: RobotDescription) -> mujoco.MjSpec:
    """The bare URDF, with absolute mesh paths and without visuals (MuJoCo cannot read .dae)."""
    root = ET.parse(description.urdf_path).getroot()
    for link in root.findall("link"):
        for visual in link.findall("visual"):
            link.remove(visual)
    for inertia in root.iterfind("link/inertial"):
        _make_definite(inertia)
    for mesh in root.iter("mesh"):
        mesh.set("filename", str(description.mesh_path(mesh.get("filename", ""))))
    switches: tuple[str, ...] = ("strippath", "fusestatic", "balanceinertia", "discardvisual")
    options: dict[str, str] = dict.fromkeys(switches, "false")
    ET.SubElement(ET.SubElement(root, "mujoco"), "compiler", options)
    try:
        return mujoco.MjSpec.from_string(ET.tostring(root, encoding="unicode"))
    except ValueError as error:
        message = f"MuJoCo cannot read {description.urdf_path}: {error}"
        raise DescriptionError(message) from error


def _make_definite(inertial: ET.Element) -> None:
    """Leave out a point's products of inertia, as of a Go1's base of 1 mg: MuJoCo refuses them."""
    mass, inertia = inertial.find("mass"), inertial.find("inertia")
    if mass is None or inertia is None:
        return
    if float(mass.get("value", "nan")) <= _POINT:
        inertia.attrib |= dict.fromkeys(("ixy", "ixz", "iyz"), "0")


def _replace_feet(spec: mujoco.MjSpec, radius: float) -> None:
    for name in FOOT_NAMES:
        body = spec.body(name)
        for geom in list(body.geoms):
            spec.delete(geom)
        body.add_geom(
            name=name,
            type=mujoco.mjtGeom.mjGEOM_SPHERE,
            size=[radius, 0.0, 0.0],
            rgba=[0.1, 0.1, 0.1, 1.0],
        )


def _exclude_pairs(spec: mujoco.MjSpec, description: RobotDescription) -> None:
    bodies = {body.name for body in spec.bodies}
    for first, second in description.disabled_pairs:
        if first in bodies and second in bodies:
            spec.add_exclude(name=f"{first}-{second}", bodyname1=first, bodyname2=second)


def set_joint_dynamics(spec: mujoco.MjSpec, dynamics: JointDynamics) -> None:
    """Writes friction, damping and armature into the twelve joints."""
    for index, name in enumerate(JOINT_NAMES):
        joint, part = spec.joint(name), index % 3
        joint.armature = dynamics.armature[part]
        joint.damping = [dynamics.damping[part], 0.0, 0.0]
        joint.frictionloss = dynamics.friction_loss[part]


def add_motors(spec: mujoco.MjSpec, joints: Sequence[str], description: RobotDescription) -> None:
    """Adds a torque motor, limited to the URDF's effort, to each joint of ``joints``."""
    efforts = dict(zip(JOINT_NAMES, description.efforts, strict=True))
    for name in joints:
        motor = spec.add_actuator(name=name.removesuffix("_joint"), target=name)
        motor.trntype = mujoco.mjtTrn.mjTRN_JOINT
        motor.set_to_motor()
        motor.gear = [1.0, 0.0, 0.0, 0.0, 0.0, 0.0]
        motor.ctrllimited = mujoco.mjtLimited.mjLIMITED_TRUE
        motor.ctrlrange = [-efforts[name], efforts[name]]


def add_imu(spec: mujoco.MjSpec, base: str, profile: RobotProfile) -> None:
    """Adds the IMU's site to the body ``base`` with gyro, accelerometer and orientation."""
    if spec.site(IMU_SITE) is None:  # else its sensors were deleted from an export of ours
        place = list(profile.imu_place)
        spec.body(base).add_site(name=IMU_SITE, pos=place, size=[0.005, 0.005, 0.005])
    for name, kind in (
        (GYRO, mujoco.mjtSensor.mjSENS_GYRO),
        (ACCELEROMETER, mujoco.mjtSensor.mjSENS_ACCELEROMETER),
        (ORIENTATION, mujoco.mjtSensor.mjSENS_FRAMEQUAT),
    ):
        site = mujoco.mjtObj.mjOBJ_SITE
        spec.add_sensor(name=name, type=kind, objtype=site, objname=IMU_SITE)


def add_floor(spec: mujoco.MjSpec) -> None:
    """Adds an infinite chequered plane at z = 0, and a light."""
    if spec.material(_GRID) is None:
        spec.add_texture(
            name=_GRID,
            type=mujoco.mjtTexture.mjTEXTURE_2D,
            builtin=mujoco.mjtBuiltin.mjBUILTIN_CHECKER,
            rgb1=[0.42, 0.47, 0.53],
            rgb2=[0.36, 0.41, 0.47],
            width=256,
            height=256,
        )
        grid = spec.add_material(name=_GRID, texrepeat=[2, 2], texuniform=True)
        grid.textures[mujoco.mjtTextureRole.mjTEXROLE_RGB] = _GRID
    spec.worldbody.add_geom(
        name=FLOOR, type=mujoco.mjtGeom.mjGEOM_PLANE, size=list(_FLOOR_HALF_SIZE), material=_GRID
    )
    spec.worldbody.add_light(pos=[0, 0, 5], dir=[0, 0, -1], castshadow=False)


def add_terrain(spec: mujoco.MjSpec, terrain: Terrain, friction: float) -> None:
    """Adds a terrain to a floor."""
    floor = spec.geom(FLOOR)
    floor.quat, floor.pos = _quaternion(0.0, terrain.floor_pitch), [0.0, 0.0, terrain.floor_height]
    for index, block in enumerate((*terrain.blocks(), *terrain.banks())):
        mu = friction if block.friction is None else block.friction
        spec.worldbody.add_geom(
            name=f"box{index}",
            type=mujoco.mjtGeom.mjGEOM_BOX,
            pos=list(block.centre),
            quat=_quaternion(block.yaw, block.pitch),
            size=list(block.half_size),
            rgba=[0.55, 0.45, 0.35, 1.0],
            friction=[mu, _TORSIONAL, _ROLLING],
            # The one of the higher priority says what the friction is; else the greater number.
            priority=int(block.friction is not None),
        )


def _quaternion(yaw: float, pitch: float) -> list[float]:
    """MuJoCo's, w x y z, of Rz(yaw) Ry(pitch)."""
    a, b, c, d = np.cos(0.5 * yaw), np.sin(0.5 * yaw), np.cos(0.5 * pitch), np.sin(0.5 * pitch)
    return [float(a * c), float(-b * d), float(a * d), float(b * c)]


def add_payload(
    spec: mujoco.MjSpec, base: str, payload: float, place: tuple[float, float, float]
) -> None:
    """Fixes ``payload`` kg, a solid box, to ``place`` [m] in the frame of the body ``base``."""
    x, y, z = (2.0 * half for half in PAYLOAD_HALF_SIZE)
    body = spec.body(base).add_body(name=PAYLOAD_BODY, mass=payload, pos=list(place))
    body.inertia = [payload / 12.0 * s for s in (y * y + z * z, x * x + z * z, x * x + y * y)]
    body.ipos = [0.0, 0.0, 0.0]
    body.explicitinertial = True


def finish(spec: mujoco.MjSpec, *, timestep: float, mass_scale: float = 1.0) -> mujoco.MjModel:
    """Compiles ``spec`` and scales every mass and inertia but the payload's by ``mass_scale``.

    Raises:
        ValueError: MuJoCo's own, if the spec does not compile; callers say what it was built from.
    """
    spec.option.timestep = timestep
    spec.option.jacobian = mujoco.mjtJacobian.mjJAC_DENSE
    if spec.option.integrator == mujoco.mjtIntegrator.mjINT_RK4:
        # The plant steps in two halves (mj_step1, mj_step2), which Runge-Kutta cannot.
        spec.option.integrator = mujoco.mjtIntegrator.mjINT_IMPLICITFAST
    # A diverged state must stay visible instead of being reset without a word.
    spec.option.disableflags |= int(mujoco.mjtDisableBit.mjDSBL_AUTORESET)
    model = spec.compile()
    scaled = np.array([model.body(i).name != PAYLOAD_BODY for i in range(model.nbody)])
    model.body_mass[scaled] *= mass_scale
    model.body_inertia[scaled] *= mass_scale
    mujoco.mj_setConst(model, mujoco.MjData(model))
    return model


VISUAL_GROUP = 2  # MuJoCo's usual group of visual geoms; collision geoms go to 3, hidden at first
COLLISION_GROUP = 3


def add_visuals(spec: mujoco.MjSpec, description: RobotDescription) -> None:
    """Adds one geom per coloured part of each visual mesh; physics ignores them.

    Collision meshes of the robot move to ``COLLISION_GROUP``, which viewers hide.

    Raises:
        DescriptionError: if a mesh file is missing or cannot be read.
    """
    for geom in spec.geoms:
        if geom.parent.name != "world":
            geom.group = COLLISION_GROUP
    colors: dict[Path, dict[str, tuple[float, ...]]] = {}
    for link in ET.parse(description.urdf_path).getroot().findall("link"):
        for visual in link.findall("visual"):
            mesh = visual.find("geometry/mesh")
            if mesh is None:
                continue
            path = description.mesh_path(mesh.get("filename", ""))
            if path not in colors:
                colors[path] = _add_meshes(spec, path)
            _add_geoms(spec.body(link.get("name", "")), colors[path], visual.find("origin"))


def _add_meshes(spec: mujoco.MjSpec, path: Path) -> dict[str, tuple[float, ...]]:
    """The colours of the mesh assets that one file becomes, by name."""
    colors = {}
    for index, part in enumerate(read_mesh(path)):
        name = f"visual_{path.stem}_{index}"
        spec.add_mesh(
            name=name,
            uservert=part.points.ravel(),
            userface=part.triangles.astype(np.int32).ravel(),
            inertia=mujoco.mjtMeshInertia.mjMESH_INERTIA_SHELL,
        )
        colors[name] = part.rgba
    return colors


def _add_geoms(
    body: mujoco.MjsBody, colors: Mapping[str, tuple[float, ...]], origin: ET.Element | None
) -> None:
    place = {} if origin is None else origin.attrib
    position, angles = (
        np.array(place.get(name, "0 0 0").split(), dtype=float) for name in ("xyz", "rpy")
    )
    quaternion = np.empty(4)
    mujoco.mju_euler2Quat(quaternion, angles, "XYZ")  # capitals: fixed axes
    for name, rgba in colors.items():
        body.add_geom(
            type=mujoco.mjtGeom.mjGEOM_MESH,
            meshname=name,
            pos=position,
            quat=quaternion,
            rgba=rgba,
            contype=0,
            conaffinity=0,
            group=VISUAL_GROUP,
            mass=0.0,
        )


class DrawnShape(NamedTuple):
    """A shape that MuJoCo's own viewer shows."""

    joint: str  #: that moves it; empty for the trunk
    link: str  #: name of its body
    mesh: str  #: name of its mesh
    T_base_shape: Float[np.ndarray, "4 4"]  #: its pose in the base frame when all joints are at 0


def drawn_shapes(mjcf: Path | str) -> tuple[dict[str, MeshPart], list[DrawnShape]]:
    """The meshes by name, and the shapes that they draw of the robot of a user's MJCF.

    Raises:
        DescriptionError: if MuJoCo cannot read it, or it shows nothing of the robot.
    """
    try:
        model = mujoco.MjModel.from_xml_path(str(mjcf))
        joints = {model.joint(name).bodyid[0]: name for name in JOINT_NAMES}
    except (ValueError, KeyError) as error:
        raise DescriptionError(f"cannot draw the robot of {mjcf}: {error}") from error
    data, base = mujoco.MjData(model), model.body_rootid[next(iter(joints))]
    data.qpos[[model.joint(name).qposadr[0] for name in JOINT_NAMES]] = 0.0
    mujoco.mj_kinematics(model, data)
    T_world_base = _pose(data.xpos[base], data.xmat[base])
    meshes: dict[str, MeshPart] = {}
    shapes = []
    for geom in range(model.ngeom):
        body, material = model.geom_bodyid[geom], model.geom_matid[geom]
        color = model.mat_rgba[material] if material >= 0 else model.geom_rgba[geom]
        rgba = tuple(color.tolist())
        if model.body_rootid[body] != base or model.geom_group[geom] > VISUAL_GROUP or not rgba[3]:
            continue
        link = model.body(body).name
        while body not in joints and body != base:
            body = model.body_parentid[body]
        found = _shape(model, geom, rgba)
        if found is not None:
            name, part = found
            meshes.setdefault(name, part)
            T_world_shape = _pose(data.geom_xpos[geom], data.geom_xmat[geom])
            T_base_shape = np.linalg.solve(T_world_base, T_world_shape)
            shapes.append(DrawnShape(joints.get(body, ""), link, name, T_base_shape))
    if not shapes:
        raise DescriptionError(f"{mjcf} shows nothing of the robot: no shape in groups 0 to 2")
    return meshes, shapes


def _pose(place: Float[np.ndarray, "3"], turn: Float[np.ndarray, "9"]) -> Float[np.ndarray, "4 4"]:
    T = np.eye(4)
    T[:3, :3], T[:3, 3] = turn.reshape(3, 3), place
    return T


def _shape(
    model: mujoco.MjModel, geom: int, rgba: tuple[float, ...]
) -> tuple[str, MeshPart] | None:
    """A name and the triangles of a shape in its own frame; None of what is no solid."""
    kind = mujoco.mjtGeom(model.geom_type[geom]).name.removeprefix("mjGEOM_").lower()
    if kind != "mesh":
        found = solid(kind, model.geom_size[geom], rgba)
        return None if found is None else (f"{kind} {model.geom_size[geom]} {rgba}", found)
    mesh = model.mesh(model.geom_dataid[geom])
    points, faces = mesh.vertadr[0], mesh.faceadr[0]
    part = MeshPart(
        model.mesh_vert[points : points + mesh.vertnum[0]].astype(float),
        model.mesh_face[faces : faces + mesh.facenum[0]].astype(int),
        rgba,
    )
    return f"{mesh.id} {rgba}", part
