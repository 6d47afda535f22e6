"""The Go2 as Pinocchio sees it: limits, geometry, and the per-tick snapshot.

One ``RobotModel`` owns one Pinocchio model and data. ``snapshot(state)`` computes every dynamic
quantity of the tick in a kernel, which ``readable_snapshot`` is the law of: CRBA in the world
convention, the nonlinear effects, and the feet's Jacobians and drifts; the CoM terms are read off
the first rows of the mass matrix, which are the robot's linear momentum (Wieber, Tedrake &
Kuindersma 2016, eq. 48.16).
"""

from __future__ import annotations

from collections.abc import Callable
from functools import cached_property
from pathlib import Path

import numpy as np
import pinocchio as pin
from jaxtyping import Float

from go2_wbc.errors import DescriptionError
from go2_wbc.kernels.layout import ROBOT
from go2_wbc.legs import FOOT_NAMES, JOINT_NAMES, LEGS
from go2_wbc.records import layout_of
from go2_wbc.robot.description import RobotDescription, find_description
from go2_wbc.robot.motor import TORQUE_SPEED, MotorModel
from go2_wbc.robot.payload import NO_PAYLOAD, Payload
from go2_wbc.robot.snapshot import Snapshot
from go2_wbc.robot.state import RobotState
from go2_wbc.world import PAYLOAD_HALF_SIZE, World

FOOT_RADIUS = 0.022
"""Radius [m] of the spherical foot: the foot mesh's, see the robot description."""
ROTOR_ARMATURE = np.tile([0.0045, 0.0045, 0.0164], 4)
"""Reflected rotor inertia [kg m^2] per joint; same provenance as the plant's ``JointDynamics``."""
LEG_AXES = ("JointModelRX", "JointModelRY", "JointModelRY")
"""What Pinocchio calls the joints of a leg: they turn about x, y and y."""
HIP_LIMIT = 0.838
"""Published hip abduction limit [rad]; the URDF's 1.0472 is wider."""


class RobotModel:
    """Constants and dynamics of the robot.

    Attributes:
        description: the files that the robot was loaded from.
        pin_model: Pinocchio's model, with rotor inertia.
        foot_radius: radius [m] of the spherical feet.
        mass: total mass [kg].
        gravity: 9.81 [m/s^2].
        motor: what the motors give at which speed.
        torque_limits: (12,) [N m], the motors' peak.
        speed_limits: (12,) [rad/s].
        q_lower, q_upper: (12,) joint limits [rad], the tighter of URDF and published ones.
        p_base_hips: (4, 3) hip abduction axes' origins in the base frame [m].
        hip_width: lateral distance [m] from the abduction axis to the leg plane.
        p_base_feet_nominal: (4, 3) points of the leg planes beside the hips in the base frame [m];
            below them the feet stand squarely.
    """

    def __init__(
        self,
        description: RobotDescription | None = None,
        *,
        armature: Float[np.ndarray, "12"] = ROTOR_ARMATURE,
        foot_radius: float = FOOT_RADIUS,
        motor: str = TORQUE_SPEED,
        world: World | None = None,
    ) -> None:
        """Load the robot.

        Args:
            description: the robot's files; by default those of the installed package.
            armature: reflected rotor inertias [kg m^2].
            foot_radius: radius [m] of the spherical feet; 0 puts contacts at the foot frames.
            motor: "torque-speed", or "ideal" for the peak torque at every speed.
            world: whose load the robot carries, and by whose factor it is heavier; none by default.

        Raises:
            ConfigError: for an unknown motor.
            DescriptionError: if the files are missing, broken, or not a Go2's.
        """
        self.description = description or find_description()
        self.motor = MotorModel.named(motor, self.description)
        self.foot_radius = foot_radius
        self.pin_model = _load(self.description.urdf_path)
        if world is not None:
            _burden(self.pin_model, world)
        self.pin_model.armature = np.concatenate([np.zeros(6), armature])
        self._data = self.pin_model.createData()
        self._foot_frames = [self.pin_model.getFrameId(name) for name in FOOT_NAMES]
        self._zero_acceleration = np.zeros(18)
        self._carried: tuple[Payload, Float[np.ndarray, " size"]] = NO_PAYLOAD, np.zeros(0)
        self._read_constants()

    def _read_constants(self) -> None:
        model = self.pin_model
        self.gravity = float(-model.gravity.linear[2])
        self.mass = float(pin.computeTotalMass(model))
        self.torque_limits = self.motor.peak.copy()
        self.speed_limits = np.array(model.velocityLimit[6:])
        self.q_lower = np.array(model.lowerPositionLimit[7:])
        self.q_upper = np.array(model.upperPositionLimit[7:])
        self.q_lower[0::3] = np.maximum(self.q_lower[0::3], -HIP_LIMIT)
        self.q_upper[0::3] = np.minimum(self.q_upper[0::3], HIP_LIMIT)
        hips = [model.jointPlacements[model.getJointId(JOINT_NAMES[3 * leg])] for leg in LEGS]
        self.p_base_hips = np.array([T.translation for T in hips])
        thigh = model.jointPlacements[model.getJointId(JOINT_NAMES[1])]
        self.hip_width = float(abs(thigh.translation[1]))
        self.p_base_feet_nominal = self.p_base_hips.copy()
        self.p_base_feet_nominal[:, 1] += self.hip_width * np.array([leg.side for leg in LEGS])

    def snapshot(self, state: RobotState, payload: Payload = NO_PAYLOAD) -> Snapshot:
        """Every dynamic quantity of ``state``, computed once.

        By a kernel if the robot's legs turn about x, y and y, as a Go2's do, else by Pinocchio's
        functions. The kernel takes the robot as it is at the first call.

        Args:
            state: measured.
            payload: what the trunk carries beside what the model has.
        """
        numbers = self._numbers
        if numbers is None:
            return self.readable_snapshot(state, payload)
        if payload.mass:
            numbers = self._loaded(numbers, payload)
        row = np.empty(_SNAPSHOT_SIZE)
        self._fill_snapshot(state.q, state.v, numbers, row)
        return Snapshot.of_row(state, row)

    @cached_property
    def _fill_snapshot(self) -> Callable[..., None]:
        from go2_wbc.kernels.rigid_body import fill_snapshot  # compiled; only who needs it waits

        return fill_snapshot

    @cached_property
    def _numbers(self) -> Float[np.ndarray, " size"] | None:
        """The robot's numbers for the kernel; None for a robot that it does not know."""
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
        return ROBOT.pack(
            [
                *self._constants,
                [_about_joint(inertia) for inertia in list(model.inertias)[1:]],
                [place.translation for place in places[1:]],
                [foot.placement.translation for foot in feet],
                model.armature[6:],
                np.zeros(4),
            ]
        )

    def _loaded(
        self, own: Float[np.ndarray, " size"], payload: Payload
    ) -> Float[np.ndarray, " size"]:
        """The robot's ``own`` numbers with ``payload``; kept until it changes."""
        carried, numbers = self._carried
        if carried != payload:
            numbers = own.copy()
            numbers[ROBOT.start["mass"]] += payload.mass
            ROBOT.view(numbers, "links")[0] += _about_joint(payload.inertia)
            ROBOT.view(numbers, "payload")[:] = payload.mass, *payload.place
            self._carried = payload, numbers
        return numbers

    def readable_snapshot(self, state: RobotState, payload: Payload = NO_PAYLOAD) -> Snapshot:
        """The same as ``snapshot``, by Pinocchio's own functions: what the kernel is held to."""
        model, data = self.pin_model, self._data
        if payload.mass:
            model = model.copy()
            model.inertias[1] = model.inertias[1] + payload.inertia
        q, v = state.q, state.v
        M = pin.crba(model, data, q, pin.Convention.WORLD)  # a copy, both triangles filled
        h = np.array(pin.nonLinearEffects(model, data, q, v))
        pin.forwardKinematics(model, data, q, v, self._zero_acceleration)
        J_feet = np.empty((4, 6, 18))
        drift_feet = np.empty((4, 6))
        p_feet = np.empty((4, 3))
        for leg, frame in enumerate(self._foot_frames):
            p_feet[leg] = pin.updateFramePlacement(model, data, frame).translation
            J_feet[leg] = pin.getFrameJacobian(model, data, frame, _ALIGNED)
            drift_feet[leg] = pin.getFrameClassicalAcceleration(model, data, frame, _ALIGNED).vector
        return Snapshot.build(state, M, h, p_feet, J_feet, drift_feet, self._constants, payload)

    @property
    def _constants(self) -> tuple[float, float, float]:
        return self.mass, self.gravity, self.foot_radius

    def center_of_mass(self, q: Float[np.ndarray, "19"]) -> Float[np.ndarray, "3"]:
        """CoM in the world [m] at configuration ``q``."""
        return np.array(pin.centerOfMass(self.pin_model, self._data, q))

    def forward_kinematics(
        self, q: Float[np.ndarray, "19"]
    ) -> tuple[Float[np.ndarray, "3"], Float[np.ndarray, "4 3"]]:
        """CoM (3,) and foot centres (4, 3) in the world [m] at configuration ``q``."""
        com = np.array(pin.centerOfMass(self.pin_model, self._data, q))
        pin.updateFramePlacements(self.pin_model, self._data)
        feet = np.array([self._data.oMf[f].translation for f in self._foot_frames])
        return com, feet

    def inverse_dynamics(
        self, q: Float[np.ndarray, "19"], v: Float[np.ndarray, "18"], a: Float[np.ndarray, "18"]
    ) -> Float[np.ndarray, "18"]:
        """Generalised force M(q) a + h(q, v) [N, N m]."""
        return np.array(pin.rnea(self.pin_model, self._data, q, v, a))


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


def _about_joint(inertia: pin.Inertia) -> Float[np.ndarray, "10"]:
    """Mass, first moment and inertia (xx, xy, xz, yy, yz, zz) about the origin of the joint."""
    mass, c = inertia.mass, inertia.lever
    moved = inertia.inertia + mass * (c @ c * np.eye(3) - np.outer(c, c))
    return np.array([mass, *(mass * c), *moved[np.triu_indices(3)]])


_SNAPSHOT_SIZE = layout_of(Snapshot).size
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
