"""MuJoCo against Pinocchio, both from the same URDF, number by number on a random state.

Each error is the Euclidean (Frobenius) norm of the difference over the norm of Pinocchio's value. A
norm of the whole vector or matrix, because single entries are legitimately zero; and computed block
by block where blocks have different units, so that a large block cannot hide a small one.
"""

from dataclasses import dataclass
from itertools import product

import mujoco
import numpy as np
import pinocchio as pin
from jaxtyping import Float

from go2_wbc.legs import JOINT_NAMES
from go2_wbc.plant.mujoco.model import JointDynamics, build_spec, finish
from go2_wbc.robot.description import BASE_LINK, RobotDescription

# Blocks of a generalised vector by unit: base linear, base angular, joints.
_BLOCKS = (slice(0, 3), slice(3, 6), slice(6, 18))
_BASE_SPEED = 2.0  # m/s and rad/s, standard deviation; the fastest the Go2 trots
_JOINT_SPEED = 10.0  # rad/s, standard deviation; a third of the hip's limit
_BASE_ACCELERATION = 20.0  # m/s^2 and rad/s^2; about two gravities
_JOINT_ACCELERATION = 100.0  # rad/s^2
_TORQUE = 10.0  # N m and N; half the hip's limit


@dataclass(frozen=True, slots=True)
class DynamicsSample:
    """One random state, with an acceleration and a force, in Pinocchio's conventions.

    The first six of ``tau`` are an external wrench on the base, in its frame as ``v`` and ``a``.
    """

    q: Float[np.ndarray, "19"]
    v: Float[np.ndarray, "18"]
    a: Float[np.ndarray, "18"]
    tau: Float[np.ndarray, "18"]


Dynamics = dict[str, Float[np.ndarray, "..."]]
"""What one engine computes for a sample, in Pinocchio's conventions.

    mass: of the whole robot [kg].
    com: centre of mass in the world [m].
    composite_inertia: rotational inertia about the centre of mass, world axes [kg m^2].
    mass_matrix: joint-space inertia, 18 x 18.
    inverse_dynamics: generalised force that yields the sample's acceleration.
    forward_dynamics: acceleration that the sample's generalised force yields.
"""


def ideal_mujoco_model(description: RobotDescription) -> mujoco.MjModel:
    """The built model without what the URDF lacks: no joint friction, contacts or limits."""
    spec = build_spec(description, JointDynamics.none(), friction=1.0)
    spec.option.disableflags |= int(mujoco.mjtDisableBit.mjDSBL_CONSTRAINT)
    return finish(spec, timestep=0.002)


def random_sample(model: pin.Model, rng: np.random.Generator) -> DynamicsSample:
    """A state anywhere within the joint limits, with any orientation."""
    place, quaternion = rng.uniform(-1.0, 1.0, 3), rng.standard_normal(4)
    joints = rng.uniform(model.lowerPositionLimit[7:], model.upperPositionLimit[7:])
    q = np.concatenate([place, quaternion / np.linalg.norm(quaternion), joints])
    speeds = np.repeat([_BASE_SPEED, _JOINT_SPEED], [6, 12])
    accelerations = np.repeat([_BASE_ACCELERATION, _JOINT_ACCELERATION], [6, 12])
    v, a, tau = (s * rng.standard_normal(18) for s in (speeds, accelerations, _TORQUE))
    return DynamicsSample(q, v, a, tau)


def pinocchio_dynamics(model: pin.Model, sample: DynamicsSample) -> Dynamics:
    """Pinocchio's answer; its joints must be in the order of ``JOINT_NAMES``."""
    order = [model.joints[model.getJointId(name)].idx_v for name in JOINT_NAMES]
    if order != list(range(6, 18)):
        raise ValueError(f"Pinocchio orders the joints otherwise: {order}")
    data = model.createData()
    pin.crba(model, data, sample.q, pin.Convention.WORLD)
    mass_matrix = np.triu(data.M) + np.triu(data.M, 1).T
    pin.ccrba(model, data, sample.q, sample.v)
    return {
        "mass": np.array(pin.computeTotalMass(model)),
        "com": pin.centerOfMass(model, data, sample.q).copy(),
        "composite_inertia": np.array(data.Ig.inertia),
        "mass_matrix": mass_matrix,
        "inverse_dynamics": pin.rnea(model, data, sample.q, sample.v, sample.a).copy(),
        "forward_dynamics": pin.aba(model, data, sample.q, sample.v, sample.tau).copy(),
    }


def mujoco_dynamics(model: mujoco.MjModel, sample: DynamicsSample) -> Dynamics:
    """MuJoCo's answer, turned into Pinocchio's conventions.

    With ``T = diag(R_world_base, 1, 1)`` from Pinocchio's velocities to MuJoCo's:
    ``M_pin = T' M T``, ``tau_pin = T' tau`` and ``a_lin_pin = R' a_lin - w x v_lin``.
    """
    data = mujoco.MjData(model)
    T = _write_state(model, data, sample)
    base = model.body(BASE_LINK).id
    coriolis = np.cross(sample.v[3:6], sample.v[:3])

    data.qfrc_applied[:] = T @ sample.tau
    mujoco.mj_forward(model, data)
    forward = T.T @ data.qacc
    forward[:3] -= coriolis

    acceleration = sample.a.copy()
    acceleration[:3] += coriolis
    data.qacc[:] = T @ acceleration
    mujoco.mj_inverse(model, data)
    dense = np.zeros((18, 18))
    mujoco.mj_fullM(model, data, dense)
    return {
        "mass": np.array(model.body_subtreemass[base]),
        "com": data.subtree_com[base].copy(),
        "composite_inertia": _composite_inertia(model, data),
        "mass_matrix": T.T @ dense @ T,
        "inverse_dynamics": T.T @ data.qfrc_inverse,
        "forward_dynamics": forward,
    }


def relative_errors(found: Dynamics, expected: Dynamics) -> dict[str, float]:
    """Relative error of each quantity; see the module's docstring for the norm."""
    return {
        name: max(
            float(np.linalg.norm(a - b) / np.linalg.norm(b))
            for a, b in zip(_blocks(found[name]), _blocks(expected[name]), strict=True)
        )
        for name in expected
    }


def _blocks(value: np.ndarray) -> list[np.ndarray]:
    """The parts of a generalised vector or matrix that have different units."""
    if value.shape[:1] != (18,):
        return [value]
    return [value[index] for index in product(_BLOCKS, repeat=value.ndim)]


def _write_state(
    model: mujoco.MjModel, data: mujoco.MjData, sample: DynamicsSample
) -> Float[np.ndarray, "18 18"]:
    """Puts the sample into ``data``; returns ``T`` from Pinocchio's velocities to MuJoCo's."""
    data.qpos[:3], data.qpos[7:] = sample.q[:3], sample.q[7:]
    data.qpos[3:7] = sample.q[[6, 3, 4, 5]]
    R_world_base = np.empty(9)
    mujoco.mju_quat2Mat(R_world_base, data.qpos[3:7])
    T = np.eye(18)
    T[:3, :3] = R_world_base.reshape(3, 3)
    data.qvel[:] = T @ sample.v
    mujoco.mj_fwdPosition(model, data)
    return T


def _composite_inertia(model: mujoco.MjModel, data: mujoco.MjData) -> Float[np.ndarray, "3 3"]:
    """Sum of every body's inertia about the common centre of mass (parallel-axis theorem)."""
    com = data.subtree_com[model.body(BASE_LINK).id]
    R, arm, mass = data.ximat.reshape(-1, 3, 3), data.xipos - com, model.body_mass
    own = np.einsum("bij,bj,bkj->ik", R[1:], model.body_inertia[1:], R[1:])
    square = np.einsum("b,bi,bi->", mass[1:], arm[1:], arm[1:]) * np.eye(3)
    return own + square - np.einsum("b,bi,bj->ij", mass[1:], arm[1:], arm[1:])
