"""Indices of the Go2's quantities in a compiled MuJoCo model, and the forces that act on it there.

MuJoCo's conventions (quaternion w x y z, linear velocity in the world) end here. Forces are pushes,
which have a duration and may overlap, and contacts as measured. A held foot is a point on a spring
and a damper, whose force is limited:

    f = k (p_held - p) - d v,  |f| <= f_most
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import final

import mujoco
import numpy as np
from jaxtyping import Bool, Float, Int, Int32

from go2_wbc.brief import brief
from go2_wbc.compilation import Foreign, kernel
from go2_wbc.errors import CommandError, unknown_name
from go2_wbc.legs import FOOT_NAMES, JOINT_NAMES, LEGS, Leg
from go2_wbc.robot.description import BASE_LINK
from go2_wbc.validation import LARGEST

# Bins into which contacts between the robot and anything else are sorted, after the four feet.
TRUNK_BIN = 4
LIMB_BIN = 5
ROBOT_BINS = 6
# Code of a geom that is not the robot's. The sum of two codes tells a robot-world pair (FOREIGN to
# FOREIGN + 5) from robot-robot (at most 10) and world-world (2 FOREIGN).
FOREIGN = 16


@kernel
def read_joints(
    qpos: Float[np.ndarray, " nq"],
    qvel: Float[np.ndarray, " nv"],
    R: Float[np.ndarray, "3 3"],
    base_q: int,
    base_v: int,
    places: Int[np.ndarray, "3 12"],
    q: Float[np.ndarray, "19"],
    v: Float[np.ndarray, "18"],
) -> None:
    """Fill q and v of a ``RobotState``.

    Args:
        R: the base's orientation.
        base_q: where in ``qpos`` the free joint's numbers begin.
        base_v: where in ``qvel`` they do.
        places: where each joint's angle and velocity are, in the first two rows.
    """
    for i in range(3):
        q[i] = qpos[base_q + i]
        q[3 + i] = qpos[base_q + 4 + i]
        v[i] = 0.0
        for k in range(3):
            v[i] += R[k, i] * qvel[base_v + k]
        v[3 + i] = qvel[base_v + 3 + i]
    q[6] = qpos[base_q + 3]
    for n in range(12):
        q[7 + n], v[6 + n] = qpos[places[0, n]], qvel[places[1, n]]


@kernel
def bin_forces(
    geoms: Foreign[Int32[np.ndarray, "n 2"]],
    addresses: Foreign[Int32[np.ndarray, " n"]],
    dimensions: Foreign[Int32[np.ndarray, " n"]],
    efc_force: Foreign[Float[np.ndarray, " rows"]],
    codes: Int[np.ndarray, " ngeom"],
    is_elliptic: bool,
    forces: Float[np.ndarray, " bins"],
) -> None:
    """Fill the normal forces [N] of contacts between robot and world, summed per bin.

    A contact's rows of ``efc_force`` begin at its address: with elliptic cones, or without
    friction, by the normal force; with pyramids by forces along 2 (dimension - 1) edges, of which
    the normal force is the sum (MuJoCo's documentation, chapter Computation, "Contact").

    Args:
        addresses: of each contact, below 0 for one without force.
        efc_force: forces of all constraints.
        codes: as in ``MujocoLayout``.
        is_elliptic: of the friction cones.
    """
    forces[:] = 0.0
    for contact in range(geoms.shape[0]):
        which = codes[geoms[contact, 0]] + codes[geoms[contact, 1]] - FOREIGN
        address = addresses[contact]
        if not 0 <= which < forces.shape[0] or address < 0:
            continue
        rows = 1 if is_elliptic else max(2 * (dimensions[contact] - 1), 1)
        for row in range(address, address + rows):
            forces[which] += efc_force[row]


def ground_forces(
    data: mujoco.MjData, codes: Int[np.ndarray, " ngeom"], is_elliptic: bool
) -> Float[np.ndarray, "6"]:
    """Normal forces [N] of contacts with anything but the robot, summed per bin of the layout.

    Valid between ``mj_step2`` and the next ``mj_step1``: they acted over the last step.
    """
    contact, forces = data.contact, np.empty(ROBOT_BINS)
    rows = (contact.geom, contact.efc_address, contact.dim, data.efc_force)
    bin_forces(*rows, codes, is_elliptic, forces)
    return forces


@dataclass(frozen=True, slots=True)
class MujocoLayout:
    """Index tables of one compiled model."""

    base: int  #: id of the base body, the one with the free joint
    base_q: slice  #: the free joint's 7 entries of ``qpos``
    base_v: slice  #: and 6 of ``qvel``
    joint_q: Int[np.ndarray, "12"]  #: entries of ``qpos`` in the order of ``JOINT_NAMES``
    joint_v: Int[np.ndarray, "12"]  #: entries of ``qvel``, likewise
    motors: Int[np.ndarray, "12"]  #: entries of ``ctrl``, likewise
    torque_limits: Float[np.ndarray, "12"]  #: least of motor, joint and given limits [N m]
    foot_geoms: Int[np.ndarray, "4"]  #: one geom of each foot, whose centre is the foot's position
    foot_bodies: Int[np.ndarray, "4"]  #: the body that carries each foot's geom
    geom_codes: Int[np.ndarray, " ngeom"]
    """For each geom its contact bin: 0 to 3 a foot, ``TRUNK_BIN``, ``LIMB_BIN``; or ``FOREIGN`` if
    it does not belong to the robot."""


def find_layout(
    spec: mujoco.MjSpec, model: mujoco.MjModel, efforts: tuple[float, ...]
) -> MujocoLayout:
    """The index tables of ``model``.

    Args:
        spec: built or checked by this package: it has the Go2's joints and one motor for each.
        model: what ``spec`` was compiled to.
        efforts: torque limits [N m] that apply unless the model's are tighter.
    """
    joints = np.array([model.joint(name).id for name in JOINT_NAMES])
    base = int(model.body_rootid[model.jnt_bodyid[joints[0]]])
    free = int(model.body_jntadr[base])
    q, v = int(model.jnt_qposadr[free]), int(model.jnt_dofadr[free])
    drives = {motor.target: motor.id for motor in spec.actuators if is_on_joint(motor)}
    motors = np.array([drives[name] for name in JOINT_NAMES])
    feet = [[geom.id for geom in foot_geoms(spec, leg)] for leg in LEGS]
    first = np.array([ids[0] for ids in feet])
    body = model.geom_bodyid
    on_trunk = model.body_weldid[body] == model.body_weldid[base]
    codes = np.where(on_trunk, TRUNK_BIN, LIMB_BIN)
    codes[model.body_rootid[body] != base] = FOREIGN
    for leg, ids in zip(LEGS, feet, strict=True):
        codes[ids] = int(leg)
    return MujocoLayout(
        base=base,
        base_q=slice(q, q + 7),
        base_v=slice(v, v + 6),
        joint_q=model.jnt_qposadr[joints].astype(int),
        joint_v=model.jnt_dofadr[joints].astype(int),
        motors=motors,
        torque_limits=_torque_limits(model, joints, motors, efforts),
        foot_geoms=first,
        foot_bodies=body[first],
        geom_codes=codes,
    )


def foot_geoms(spec: mujoco.MjSpec, leg: Leg) -> list[mujoco.MjsGeom]:
    """The geoms that are the foot of ``leg`` and can collide; empty if there are none.

    They are the geoms of a body ``FL_foot``, else those named ``FL_foot`` or ``FL``.
    """
    solid = [geom for geom in spec.geoms if geom.contype or geom.conaffinity]
    inside = [geom for geom in solid if geom.parent.name == leg.foot]
    return inside or [geom for geom in solid if geom.name in (leg.foot, leg.name)]


def is_on_joint(actuator: mujoco.MjsActuator) -> bool:
    """Whether an actuator drives a joint, and not a tendon, site or body."""
    return actuator.trntype in (mujoco.mjtTrn.mjTRN_JOINT, mujoco.mjtTrn.mjTRN_JOINTINPARENT)


def _torque_limits(
    model: mujoco.MjModel,
    joints: Int[np.ndarray, "12"],
    motors: Int[np.ndarray, "12"],
    efforts: tuple[float, ...],
) -> Float[np.ndarray, "12"]:
    limits = np.array(efforts)
    for limited, ranges in (
        (model.actuator_ctrllimited[motors], model.actuator_ctrlrange[motors]),
        (model.actuator_forcelimited[motors], model.actuator_forcerange[motors]),
        (model.jnt_actfrclimited[joints], model.jnt_actfrcrange[joints]),
    ):
        tightest = np.minimum(-ranges[:, 0], ranges[:, 1])
        limits = np.where(limited, np.minimum(limits, tightest), limits)
    return limits


STIFFNESS, DAMPING = 1e4, 50.0
"""k [N/m] and d [N s/m] of a held foot: 2 cm at 200 N, and stable for a calf at steps of 2 ms."""


@dataclass(frozen=True, slots=True)
class Push:
    """An external force that acts for some more physics steps."""

    body: int  #: its id
    p_body_point: Float[np.ndarray, "3"]  #: where it acts, in the body's frame [m]
    f_world: Float[np.ndarray, "3"]  #: in the world [N]; of what holds, the greatest length
    steps_left: int  #: physics steps for which it still acts
    p_world_held: Float[np.ndarray, "3"] | None = None
    """Where the point is held [m]; None where the force is given."""


@final
class Pushes:
    """The pushes that act now on one model."""

    def __init__(self, model: mujoco.MjModel, data: mujoco.MjData, layout: MujocoLayout) -> None:
        self._model, self._data, self._layout = model, data, layout
        self._wrenches = data.xfrc_applied  # a view, made once because making it is slow
        self.active: tuple[Push, ...] = ()  #: each loses one step at every ``apply``

    def add(self, force: Float[np.ndarray, "3"], duration: float, at: str) -> None:
        """Starts a push at the next physics step; see ``MujocoPlant.push``."""
        f_world = np.array(force, dtype=float)
        if f_world.shape != (3,) or not np.isfinite(f_world).all():
            raise CommandError(f"push force must be three finite numbers [N], got {force!r}")
        if isinstance(duration, bool) or not 0.0 < duration <= LARGEST:
            raise CommandError(f"push duration must be positive and finite [s], got {duration!r}")
        body, point = self._point(at)
        steps = max(1, round(duration / self._model.opt.timestep))
        self.active = (*self.active, Push(body, point, f_world, steps))

    def hold(self, foot: str, most: float, duration: float) -> None:
        """Holds a foot where it is from the next physics step on, by a force of at most [N]."""
        self.add(np.array([0.0, 0.0, most]), duration, foot)
        push = self.active[-1]
        here = self._data.xipos[push.body] + self._arm(push)
        self.active = (*self.active[:-1], replace(push, p_world_held=here))

    def apply(self) -> None:
        """Writes the forces for one physics step."""
        wrenches = self._wrenches
        wrenches[:] = 0.0
        if not self.active:
            return
        for push in self.active:
            arm = self._arm(push)
            held = push.p_world_held
            force = push.f_world if held is None else self._holding(push, held, arm)
            wrenches[push.body, :3] += force
            wrenches[push.body, 3:] += np.cross(arm, force)
        later = (replace(push, steps_left=push.steps_left - 1) for push in self.active)
        self.active = tuple(push for push in later if push.steps_left > 0)

    def _arm(self, push: Push) -> Float[np.ndarray, "3"]:
        """From the body's centre of mass, where MuJoCo applies wrenches, to the push's point."""
        R_world_body = self._data.xmat[push.body].reshape(3, 3)
        p_world_point = self._data.xpos[push.body] + R_world_body @ push.p_body_point
        return p_world_point - self._data.xipos[push.body]

    def _holding(
        self, push: Push, held: Float[np.ndarray, "3"], arm: Float[np.ndarray, "3"]
    ) -> Float[np.ndarray, "3"]:
        """The force of what holds a point [N]."""
        data, twist = self._data, np.empty(6)  # angular before linear, at the centre of mass
        body = mujoco.mjtObj.mjOBJ_BODY
        mujoco.mj_objectVelocity(self._model, data, body, push.body, twist, 0)
        velocity = twist[3:] + np.cross(twist[:3], arm)
        force = STIFFNESS * (held - data.xipos[push.body] - arm) - DAMPING * velocity
        most = float(np.linalg.norm(push.f_world))
        return force * min(1.0, most / max(float(np.linalg.norm(force)), 1e-9))

    def _point(self, at: str) -> tuple[int, Float[np.ndarray, "3"]]:
        """Body and point that a name means."""
        model, layout = self._model, self._layout
        if at in FOOT_NAMES:
            leg = FOOT_NAMES.index(at)
            return int(layout.foot_bodies[leg]), model.geom_pos[layout.foot_geoms[leg]].copy()
        bodies = {model.body(i).name: i for i in range(1, model.nbody)} | {BASE_LINK: layout.base}
        if at not in bodies:
            raise CommandError(unknown_name("body to push", at, {*bodies, *FOOT_NAMES} - {""}))
        return bodies[at], model.body_ipos[bodies[at]].copy()


@dataclass(frozen=True, slots=True)
class FootContacts:
    """Where each foot touches, and how the touching material moves there.

    The velocity is that of the point of the foot that is at the contact now, not of the foot's
    centre: a round foot that rolls has a moving centre and a resting contact point.
    """

    p_world_contact: Float[np.ndarray, "4 3"]
    """The deepest contact point of each foot [m]; nan without contact."""
    v_world_contact: Float[np.ndarray, "4 3"]
    """Tangential velocity of the foot's material there [m/s]; 0 without contact."""

    __repr__ = brief


@dataclass(frozen=True, slots=True)
class Contacts:
    """All contacts of one instant as MuJoCo holds them, copied: quick to take, evaluated later.

    Taken after ``mj_step1``: places and velocities belong to that state.
    """

    codes: Int[np.ndarray, " n"]
    """Sum of both geoms' codes: ``FOREIGN`` plus a bin if exactly one is the robot's."""
    distances: Float[np.ndarray, " n"]  #: of the surfaces [m]; they touch from 0 on
    points: Float[np.ndarray, "n 3"]  #: of contact in the world [m]
    normals: Float[np.ndarray, "n 3"]  #: of each contact
    p_world_com: Float[np.ndarray, "3"]  #: the robot's centre of mass [m]
    twists: Float[np.ndarray, "4 6"]
    """Velocities of the feet's bodies about it, angular first, along world axes."""

    __repr__ = brief

    @staticmethod
    def of(data: mujoco.MjData, layout: MujocoLayout) -> Contacts:
        """The present ones."""
        contacts = data.contact
        return Contacts(
            layout.geom_codes[contacts.geom].sum(axis=1),
            contacts.dist.copy(),
            contacts.pos.copy(),
            contacts.frame[:, :3].copy(),
            data.subtree_com[layout.base].copy(),
            data.cvel[layout.foot_bodies],
        )


def foot_contacts(
    instants: Sequence[Contacts],
) -> tuple[Float[np.ndarray, "t 4 3"], Float[np.ndarray, "t 4 3"]]:
    """Points and velocities as in ``FootContacts``, at each of the instants."""
    points, velocities = np.full((len(instants), 4, 3), np.nan), np.zeros((len(instants), 4, 3))
    when, codes, distances = _gathered(instants)
    legs = codes - FOREIGN
    rows = np.flatnonzero((legs >= 0) & (legs < len(LEGS)) & (distances <= 0.0))
    rows = rows[np.argsort(-distances[rows], kind="stable")]  # a foot's deepest is written last
    place = (when[rows], legs[rows])
    point = np.concatenate([contacts.points for contacts in instants])[rows]
    normal = np.concatenate([contacts.normals for contacts in instants])[rows]
    com = np.array([contacts.p_world_com for contacts in instants])
    twist = np.array([contacts.twists for contacts in instants])[place]
    velocity = twist[:, 3:] + np.cross(twist[:, :3], point - com[place[0]])
    along_normal = (normal * velocity).sum(axis=1, keepdims=True)
    points[place], velocities[place] = point, velocity - along_normal * normal
    return points, velocities


def touches_itself(instants: Sequence[Contacts]) -> Bool[np.ndarray, " t"]:
    """Whether two links of the robot touch that its SRDF does not let touch, at each instant."""
    when, codes, distances = _gathered(instants)
    touches = np.zeros(len(instants), dtype=bool)
    touches[when[(codes < FOREIGN) & (distances <= 0.0)]] = True
    return touches


def _gathered(
    instants: Sequence[Contacts],
) -> tuple[Int[np.ndarray, " n"], Int[np.ndarray, " n"], Float[np.ndarray, " n"]]:
    """Of all contacts of all instants: the instant, the code and the distance."""
    when = np.repeat(np.arange(len(instants)), [len(contacts.codes) for contacts in instants])
    codes = np.concatenate([contacts.codes for contacts in instants])
    return when, codes, np.concatenate([contacts.distances for contacts in instants])
