"""The robot as Pinocchio sees it: limits, geometry, and the per-tick snapshot.

One ``RobotModel`` owns one Pinocchio model and data. ``snapshot(state)`` computes every dynamic
quantity of the tick, by ``robot.rigid_body`` if the robot's legs turn about the axes of a Go2's.
"""

from __future__ import annotations

import hashlib
from dataclasses import replace
from functools import cached_property
from pathlib import Path

import numpy as np
import pinocchio as pin

from go2_wbc.arguments import typed
from go2_wbc.errors import DescriptionError
from go2_wbc.legs import FOOT_NAMES, JOINT_NAMES, LEGS
from go2_wbc.records import Array3, Array4x3, Array12, Array18, Array19, layout_of
from go2_wbc.robot.description import RobotDescription, find_description
from go2_wbc.robot.motor import TORQUE_SPEED, MotorModel
from go2_wbc.robot.rigid_body import NO_PAYLOAD, Payload, RigidBodies, fill_snapshot
from go2_wbc.robot.state import RobotState, Snapshot
from go2_wbc.world import PAYLOAD_HALF_SIZE, World

IMU_FRAME = "imu"
LEG_AXES = ("JointModelRX", "JointModelRY", "JointModelRY")
"""What Pinocchio calls the joints of a leg: they turn about x, y and y."""
FINGERPRINT_DECIMALS = 9
"""Decimals of the numbers [SI units] that count: what a file was computed for stays the same robot
if another Pinocchio rounds its last digits differently."""
FINGERPRINT = 16  #: Letters of a fingerprint


class RobotModel:
    """Constants and dynamics of the robot.

    Attributes:
        description: the files that the robot was loaded from.
        profile: what they do not say of it.
        pin_model: Pinocchio's model, with rotor inertia.
        foot_radius, mass, gravity: radius [m] of the spherical feet, total mass [kg], 9.81 [m/s^2].
        motor: what the motors give at which speed.
        torque_limits, speed_limits: (12,) the motors' peak [N m], and [rad/s].
        q_lower, q_upper: (12,) joint limits [rad], the tighter of URDF and published ones.
        p_base_imu: (3,) place of the IMU in the base frame [m].
        p_base_hips: (4, 3) hip abduction axes' origins in the base frame [m].
        hip_width: lateral distance [m] from the abduction axis to the leg plane.
        p_base_feet_nominal: (4, 3) points of the leg planes beside the hips in the base frame [m];
            below them the feet stand squarely.
    """

    @typed()
    def __init__(
        self,
        description: RobotDescription | None = None,
        *,
        armature: Array12 | None = None,
        foot_radius: float | None = None,
        motor: str = TORQUE_SPEED,
        world: World | None = None,
    ) -> None:
        """Load the robot.

        Args:
            description: the robot's files; by default those of the installed package.
            armature: reflected rotor inertias [kg m^2]; by default the profile's.
            foot_radius: radius [m] of the spherical feet; 0 puts contacts at the foot frames; by
                default the profile's.
            motor: "torque-speed", or "ideal" for the peak torque at every speed.
            world: whose load the robot carries, and by whose factor it is heavier; none by default.

        Raises:
            ConfigError: for an unknown motor.
            DescriptionError: if the files are missing, broken, or not such a robot's.
        """
        self.description = description or find_description()
        self.profile = profile = self.description.profile
        self.motor = MotorModel.named(motor, self.description)
        self.foot_radius = profile.foot_radius if foot_radius is None else foot_radius
        self.pin_model = _load(self.description.urdf_path)
        if world is not None:
            _burden(self.pin_model, world)
        own = np.tile(profile.armature, 4) if armature is None else armature
        self.pin_model.armature = np.concatenate([np.zeros(6), own])
        self._data = self.pin_model.createData()
        self._foot_frames = [self.pin_model.getFrameId(name) for name in FOOT_NAMES]
        self._zero_acceleration = np.zeros(18)
        self._carried = NO_PAYLOAD, RigidBodies()
        self._read_constants()

    def __repr__(self) -> str:
        return f"<RobotModel: {self.profile.title}, {self.mass:.2f} kg>"

    def _read_constants(self) -> None:
        model = self.pin_model
        self.gravity = float(-model.gravity.linear[2])
        self.mass = float(pin.computeTotalMass(model))
        self.torque_limits = self.motor.peak.copy()
        self.speed_limits = np.array(model.velocityLimit[6:])
        self.q_lower = np.array(model.lowerPositionLimit[7:])
        self.q_upper = np.array(model.upperPositionLimit[7:])
        hip = self.profile.hip_limit
        self.q_lower[0::3] = np.maximum(self.q_lower[0::3], -hip)
        self.q_upper[0::3] = np.minimum(self.q_upper[0::3], hip)
        self.p_base_imu = np.array(self.profile.imu_place)
        if model.existFrame(IMU_FRAME):
            imu = model.frames[model.getFrameId(IMU_FRAME)]
            self.p_base_imu = np.array(imu.placement.translation)
        hips = [model.jointPlacements[model.getJointId(JOINT_NAMES[3 * leg])] for leg in LEGS]
        self.p_base_hips = np.array([T.translation for T in hips])
        thigh = model.jointPlacements[model.getJointId(JOINT_NAMES[1])]
        self.hip_width = float(abs(thigh.translation[1]))
        self.p_base_feet_nominal = self.p_base_hips.copy()
        self.p_base_feet_nominal[:, 1] += self.hip_width * np.array([leg.side for leg in LEGS])

    @typed(late=True)
    def snapshot(self, state: RobotState, payload: Payload = NO_PAYLOAD) -> Snapshot:
        """Every dynamic quantity of ``state``, computed once.

        By ``robot.rigid_body`` if the robot's legs turn about x, y and y, as a Go2's do, else by
        Pinocchio. The former takes the robot as it is at the first call.

        Args:
            payload: what the trunk carries beside what the model has.
        """
        if not state.q.flags.writeable:  # compiled code takes what it may write to
            state = replace(state, q=state.q.copy(), v=state.v.copy())
        robot = self._bodies
        if robot is None:
            return self.pinocchio_snapshot(state, payload)
        if payload.mass:
            robot = self._loaded(robot, payload)
        snapshot = Snapshot.of_row(state, np.empty(_SNAPSHOT_SIZE), self.profile)
        fill_snapshot(state.q, state.v, robot, snapshot)
        return snapshot

    @cached_property
    def _bodies(self) -> RigidBodies | None:
        """The robot's numbers; None for a robot with other legs."""
        model = self.pin_model
        places = list(model.jointPlacements)[1:]
        feet = [model.frames[frame] for frame in self._foot_frames]
        is_known = (
            list(model.parents) == _PARENTS
            and [model.joints[n].shortname() for n in range(2, 14)] == [*LEG_AXES * 4]
            and all(np.array_equal(place.rotation, np.eye(3)) for place in places)
            and not np.any([places[0].translation, model.gravity.linear * [1.0, 1.0, 0.0]])
            and [foot.parentJoint for foot in feet] == _CALVES
        )
        if not is_known:
            return None
        robot = RigidBodies(
            mass=self.mass,
            gravity=self.gravity,
            foot_radius=self.foot_radius,
            p_joints=[place.translation for place in places[1:]],
            p_calf_feet=[foot.placement.translation for foot in feet],
            armature=model.armature[6:],
        )
        for link, inertia in enumerate(list(model.inertias)[1:]):
            _add_inertia(robot, link, inertia)
        return robot

    def _loaded(self, own: RigidBodies, payload: Payload) -> RigidBodies:
        """The robot's ``own`` numbers with ``payload``; kept until it changes."""
        carried, robot = self._carried
        if carried != payload:
            robot = RigidBodies.of(own.row.copy())
            robot.mass += payload.mass
            _add_inertia(robot, 0, payload.inertia)
            robot.row[_PAYLOAD] = payload.mass, *payload.place
            self._carried = payload, robot
        return robot

    @typed(late=True)
    def pinocchio_snapshot(self, state: RobotState, payload: Payload = NO_PAYLOAD) -> Snapshot:
        """The same as ``snapshot`` by Pinocchio's own functions, for any robot."""
        model, data, q, v = self.pin_model, self._data, state.q, state.v
        bare = np.array(pin.centerOfMass(model, data, q))
        if payload.mass:
            model = model.copy()
            model.inertias[1] = model.inertias[1] + payload.inertia
        M = pin.crba(model, data, q, pin.Convention.WORLD)  # a copy, both triangles filled
        h = np.array(pin.nonLinearEffects(model, data, q, v))
        J_com = np.array(pin.jacobianCenterOfMass(model, data, q))
        com = np.array(pin.centerOfMass(model, data, q, v, self._zero_acceleration))
        J, drift = np.empty((4, 6, 18)), np.empty((4, 6))
        p_feet = np.empty((4, 3))
        for leg, frame in enumerate(self._foot_frames):
            p_feet[leg] = pin.updateFramePlacement(model, data, frame).translation
            J[leg] = pin.computeFrameJacobian(model, data, q, frame, _ALIGNED)
            drift[leg] = pin.getFrameClassicalAcceleration(model, data, frame, _ALIGNED).vector
        # The contact is r below the centre of the sphere, which rolls: see ``robot.snapshot``.
        J_contacts = J[:, :3] - self.foot_radius * np.cross(J[:, 3:], _UP, axisa=1, axisc=1)
        drift_contacts = drift[:, :3] - self.foot_radius * np.cross(drift[:, 3:], _UP)
        return Snapshot(
            state,
            self.profile,
            foot_radius=self.foot_radius,
            R_world_base=state.R_world_base,
            mass_matrix=M,
            bias=h,
            p_world_com=com,
            v_world_com=data.vcom[0],
            J_com=J_com,
            drift_com=data.acom[0],
            p_world_feet=p_feet,
            v_world_feet=J[:, :3] @ v,
            J_feet=J[:, :3],
            drift_feet=drift[:, :3],
            J_contacts=J_contacts,
            drift_contacts=drift_contacts,
            v_world_contacts=J_contacts @ v,
            payload=payload.mass * np.array([1.0, self.gravity]),
            com_shift=com - bare,
        )

    @typed()
    def center_of_mass(self, q: Array19) -> Array3:
        """CoM in the world [m] at configuration ``q``."""
        return np.array(pin.centerOfMass(self.pin_model, self._data, q))

    @typed()
    def forward_kinematics(self, q: Array19) -> tuple[Array3, Array4x3]:
        """CoM (3,) and foot centres (4, 3) in the world [m] at configuration ``q``."""
        com = np.array(pin.centerOfMass(self.pin_model, self._data, q))
        pin.updateFramePlacements(self.pin_model, self._data)
        feet = np.array([self._data.oMf[f].translation for f in self._foot_frames])
        return com, feet

    @typed(late=True)
    def inverse_dynamics(self, q: Array19, v: Array18, a: Array18) -> Array18:
        """Generalised force M(q) a + h(q, v) [N, N m]."""
        return np.array(pin.rnea(self.pin_model, self._data, q, v, a))


def fingerprint(model: RobotModel) -> str:
    """What tells the robot of ``model`` from others: masses, lengths, limits and motors.

    Comments and order of its URDF, meshes and colours do not count.
    """
    pin_model = model.pin_model
    feet = [pin_model.frames[pin_model.getFrameId(name)].placement for name in FOOT_NAMES]
    numbers = [
        *(placement.homogeneous for placement in pin_model.jointPlacements),
        *(inertia.matrix() for inertia in pin_model.inertias),
        *(placement.homogeneous for placement in feet),
        pin_model.armature,
        model.q_lower,
        model.q_upper,
        model.torque_limits,
        model.speed_limits,
        np.array([model.foot_radius, model.gravity]),
    ]
    digest = hashlib.sha256()
    for array in numbers:
        digest.update((np.round(array, FINGERPRINT_DECIMALS) + 0.0).tobytes())  # no -0
    return digest.hexdigest()[:FINGERPRINT]


def _burden(model: pin.Model, world: World) -> None:
    """Make the robot as heavy as it is in ``world``, with its payload on the trunk."""
    for joint in range(1, model.njoints):
        own = model.inertias[joint]
        scale = world.mass_scale
        model.inertias[joint] = pin.Inertia(scale * own.mass, own.lever, scale * own.inertia)
    if world.payload > 0.0:
        box = pin.Inertia.FromBox(world.payload, *(2.0 * half for half in PAYLOAD_HALF_SIZE))
        place = pin.SE3(np.eye(3), np.array(world.payload_place))
        model.inertias[1] = model.inertias[1] + place.act(box)


def _add_inertia(robot: RigidBodies, link: int, inertia: pin.Inertia) -> None:
    """Add mass, first moment and inertia about the origin of the joint to a link's."""
    mass, c = inertia.mass, inertia.lever
    moved = inertia.inertia + mass * (c @ c * np.eye(3) - np.outer(c, c))
    robot.link_mass[link] += mass
    robot.link_moment[link] += mass * c
    robot.link_inertia[link] += moved[np.triu_indices(3)]


_SNAPSHOT_SIZE = layout_of(Snapshot).size
_PAYLOAD = layout_of(RigidBodies).slice("payload")
_UP = np.array([0.0, 0.0, 1.0])
_PARENTS = [0, 0, 1, 2, 3, 1, 5, 6, 1, 8, 9, 1, 11, 12]
"""The joint before each, in Pinocchio's order: universe, base, and four legs of three."""
_CALVES = [4, 7, 10, 13]
_ALIGNED = pin.ReferenceFrame.LOCAL_WORLD_ALIGNED


def _load(urdf: Path) -> pin.Model:
    try:
        model = pin.buildModelFromUrdf(str(urdf), pin.JointModelFreeFlyer())
    except ValueError as error:
        raise DescriptionError(f"Pinocchio cannot read the URDF {urdf}: {error}") from error
    names = list(model.names)[2:]
    if names != list(JOINT_NAMES):
        raise DescriptionError(f"{urdf} has joints {names}; expected {list(JOINT_NAMES)}")
    return model
