"""Where the Go2's quantities are inside a compiled MuJoCo model, and what is read there in a tick.

MuJoCo's conventions (quaternion w x y z, linear velocity in the world) end here.
"""

from __future__ import annotations

from dataclasses import dataclass

import mujoco
import numpy as np
from jaxtyping import Float, Int, Int32

from go2_wbc.compilation import Foreign, kernel
from go2_wbc.legs import JOINT_NAMES, LEGS, Leg

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
