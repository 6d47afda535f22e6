"""The model and the equations: MuJoCo against Pinocchio, and every whole-body solution audited.

Both models are built from the same URDF: that nothing was lost on the way to MuJoCo is measured
number by number, on random states. Each error is the Euclidean (Frobenius) norm of the difference
over the norm of Pinocchio's value. A norm of the whole vector or matrix, because single entries are
legitimately zero; and computed block by block where blocks have different units, so that a large
block cannot hide a small one.
"""

from contextlib import closing
from dataclasses import dataclass
from itertools import product

import mujoco
import numpy as np
import pinocchio as pin
from jaxtyping import Float

from benchmarks.study import Study, TrialResult
from controller.assembly import build_pilot
from controller.modes import Aborted
from controller.pilot import Pilot
from controller.sweeps.trials import Trial, TrialFailed
from go2_wbc.config import Config
from go2_wbc.legs import JOINT_NAMES
from go2_wbc.planning.command import VelocityCommand
from go2_wbc.plant import MujocoPlant
from go2_wbc.plant.mujoco.model import JointDynamics, build_spec, finish
from go2_wbc.reference import Reference
from go2_wbc.robot.description import BASE_LINK, RobotDescription, find_description
from go2_wbc.robot.model import RobotModel
from go2_wbc.robot.state import Snapshot
from go2_wbc.wbc.controller import WbcSolution, WholeBodyController
from motions import compile_timeline, load_motion

STATES = 200  #: Random states of a trial on which the two models are compared
ORACLE_PERIOD = 10  #: Ticks between those that the other back ends solve as well
PLACO = "placo"  # It has a robot of its own, which carries nothing
DRIVERS = ("condensed", PLACO)  #: Back ends that drive a whole run each, every solution audited
BACKENDS = ("condensed", "full", PLACO)  # Back ends that are compared with the driving one
# Blocks of a generalised vector by unit: base linear, base angular, joints.
_BLOCKS = (slice(0, 3), slice(3, 6), slice(6, 18))
_BASE_SPEED = 2.0  # m/s and rad/s, standard deviation; the fastest the Go2 trots
_JOINT_SPEED = 10.0  # rad/s, standard deviation; a third of the hip's limit
_BASE_ACCELERATION = 20.0  # m/s^2 and rad/s^2; about two gravities
_JOINT_ACCELERATION = 100.0  # rad/s^2
_TORQUE = 10.0  # N m and N; half the hip's limit

QUANTITIES = {
    "mass": "mass",
    "com": "centre of mass",
    "composite_inertia": "inertia",
    "mass_matrix": "mass matrix",
    "inverse_dynamics": "inverse dynamics",
    "forward_dynamics": "forward dynamics",
}
SOLUTION_ROWS = (
    *((f"motion_{name}", f"motion, {name}", "<= 1e-8 SI") for name in BACKENDS),
    ("torque", "torque between back ends", "<= 1e-5 N m"),
    ("failures", "QP failures", "<= 0"),
)


def measure_agreement(trial: Trial, found: TrialResult) -> None:
    """Largest relative error of each quantity over ``STATES`` random states."""
    found.values = model_agreement(STATES, trial.seed)


class AuditedController(WholeBodyController):
    """Checks every solution, and solves some ticks with the other back ends as well."""

    def __init__(self, model: RobotModel, backend: str, found: TrialResult) -> None:
        """Solve with ``backend``; the largest errors go to ``found``."""
        super().__init__(model, backend)
        others = [name for name in BACKENDS if name != backend]
        self._others = {name: WholeBodyController(model, name) for name in others}
        self._ticks = 0
        self._found = found

    def solve(
        self, snapshot: Snapshot, reference: Reference, *, relax: bool = False
    ) -> WbcSolution:
        """Solve one tick and audit the solution."""
        solution = super().solve(snapshot, reference, relax=relax)
        self._audit(snapshot, solution)
        if self._ticks % ORACLE_PERIOD == 0:
            for name, controller in self._others.items():
                if PLACO in (name, solution.backend) and snapshot.payload.any():
                    continue
                other = controller.solve(snapshot, reference)
                self._audit(snapshot, other)
                self._found.worsen("torque", float(np.abs(solution.tau - other.tau).max()))
        self._ticks += 1
        return solution

    def _audit(self, snapshot: Snapshot, solution: WbcSolution) -> None:
        error = motion_error(self.model, snapshot, solution)
        self._found.worsen(f"motion_{solution.backend}", error)


def motion_error(model: RobotModel, snapshot: Snapshot, solution: WbcSolution) -> float:
    """Largest entry [N, N m] of M qdd + h - S' tau - J' f, by recursive Newton-Euler.

    A payload that the snapshot carries is a point mass of the base.
    """
    generalised: Float[np.ndarray, "18"] = np.concatenate([np.zeros(6), solution.tau])
    for J, force in zip(snapshot.J_contacts, solution.forces, strict=True):
        generalised += J.T @ force
    state = snapshot.state
    needed = model.inverse_dynamics(state.q, state.v, solution.qdd)
    if snapshot.payload.any() and solution.backend != PLACO:
        needed[:6] += payload_wrench(model, snapshot, solution.qdd)
    return float(np.abs(needed - generalised).max())


def payload_wrench(
    model: RobotModel, snapshot: Snapshot, qdd: Float[np.ndarray, "18"]
) -> Float[np.ndarray, "6"]:
    """Force and moment [N, N m], base frame, that a snapshot's payload takes: m (a_p + g), p x.

    The CoM is ``com_shift`` = m / (M + m) (p - c) from that of the robot alone, c.
    """
    (m, _), state = snapshot.payload, snapshot.state
    R = snapshot.R_world_base
    p_world = snapshot.p_world_com + snapshot.com_shift * model.mass / m
    p, v, w = R.T @ (p_world - state.q[:3]), state.v[:3], state.v[3:6]
    a = qdd[:3] + np.cross(w, v) + np.cross(qdd[3:6], p) + np.cross(w, np.cross(w, p))
    force = m * (a + R.T @ np.array([0.0, 0.0, model.gravity]))
    return np.concatenate([force, np.cross(p, force)])


def measure_solutions(trial: Trial, found: TrialResult) -> None:
    """Stand up, trot with a push, give a high five, sit; once with each of ``DRIVERS``.

    - motion: |M qdd + h - S' tau - sum J_i' f_i|, largest entry, of every solution that drives the
      robot, and of every tenth for the back ends that do not. Evaluated by Pinocchio's recursive
      Newton-Euler algorithm, not with the mass matrix and bias that the QP was made from;
    - torque between back ends: largest difference of any joint's torque for the same snapshot and
      reference, on every tenth tick.
    """
    found.values["failures"] = 0.0
    for driver in DRIVERS:
        with closing(trial.plant()) as plant, closing(build_pilot(plant, Config())) as robot:
            loop = robot.runner.loop
            loop.wbc = AuditedController(loop.model, driver, found)
            try:
                _exercise(robot, plant)
            except Aborted as aborted:
                raise TrialFailed(f"driven by {driver}: {aborted}") from aborted
            found.values["failures"] += loop.telemetry.qp_failures


def _exercise(pilot: Pilot, plant: MujocoPlant) -> None:
    pilot.stand()
    pilot.walk("trot")
    pilot.set_command(VelocityCommand(0.6, 0.2, 0.5))
    pilot.wait(2.0)
    plant.push(np.array([0.0, 120.0, 0.0]), 0.1)
    pilot.wait(2.0)
    pilot.rest()
    pilot.stand()
    plan = compile_timeline(load_motion("high_five", hold=1.0), RobotModel())
    pilot.play(plan)
    pilot.sit()


# --- MuJoCo against Pinocchio ---------------------------------------------------------------------


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


def model_agreement(n: int, seed: int) -> dict[str, float]:
    """Largest relative error of each quantity of ``Dynamics`` over ``n`` random states."""
    description = find_description()
    pinocchio_model = pin.buildModelFromUrdf(str(description.urdf_path), pin.JointModelFreeFlyer())
    mujoco_model = ideal_mujoco_model(description)
    rng = np.random.default_rng(seed)
    worst: dict[str, float] = {}
    for _ in range(n):
        sample = random_sample(pinocchio_model, rng)
        expected = pinocchio_dynamics(pinocchio_model, sample)
        errors = relative_errors(mujoco_dynamics(mujoco_model, sample), expected)
        worst = {name: max(error, worst.get(name, 0.0)) for name, error in errors.items()}
    return worst


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


AGREEMENT = Study(
    "model",
    {
        "Pinocchio against MuJoCo, relative": [
            (name, quantity, "<= 1e-12") for name, quantity in QUANTITIES.items()
        ]
    },
    measure_agreement,
    sensors=None,
)
SOLUTIONS = Study(
    "solutions", {"whole-body solutions": SOLUTION_ROWS}, measure_solutions, "wbc", sensors=None
)
