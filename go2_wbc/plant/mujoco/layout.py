"""Where the Go2's quantities are inside a compiled MuJoCo model."""

from __future__ import annotations

from dataclasses import dataclass

import mujoco
import numpy as np
from jaxtyping import Float, Int

from go2_wbc.legs import JOINT_NAMES, LEGS, Leg

# Bins into which contacts between the robot and anything else are sorted, after the four feet.
TRUNK_BIN = 4
LIMB_BIN = 5
ROBOT_BINS = 6
# Code of a geom that is not the robot's. The sum of two codes tells a robot-world pair (FOREIGN to
# FOREIGN + 5) from robot-robot (at most 10) and world-world (2 FOREIGN).
FOREIGN = 16


@dataclass(frozen=True, slots=True)
class MujocoLayout:
    """Index tables of one compiled model.

    Attributes:
        base: id of the base body, the one with the free joint.
        base_q: the free joint's 7 entries of ``qpos``.
        base_v: its 6 entries of ``qvel``.
        joint_q: entries of ``qpos`` in the order of ``JOINT_NAMES``.
        joint_v: entries of ``qvel``, likewise.
        motors: entries of ``ctrl``, likewise.
        torque_limits: least of motor, joint and given limits [N m].
        foot_geoms: one geom of each foot, whose centre is the foot's position.
        foot_bodies: the body that carries each foot's geom.
        geom_codes: for each geom its contact bin: 0 to 3 a foot, ``TRUNK_BIN``, ``LIMB_BIN``; or
            ``FOREIGN`` if it does not belong to the robot.
    """

    base: int
    base_q: slice
    base_v: slice
    joint_q: Int[np.ndarray, "12"]
    joint_v: Int[np.ndarray, "12"]
    motors: Int[np.ndarray, "12"]
    torque_limits: Float[np.ndarray, "12"]
    foot_geoms: Int[np.ndarray, "4"]
    foot_bodies: Int[np.ndarray, "4"]
    geom_codes: Int[np.ndarray, " ngeom"]


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
