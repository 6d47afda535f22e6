"""Random states, references, trajectories and mirror images that the engine's tests share."""

from collections.abc import Iterable, Iterator
from dataclasses import replace

import numpy as np
import pinocchio as pin

from go2_wbc.errors import QpInfeasible
from go2_wbc.legs import LEGS
from go2_wbc.reference import BodyTarget, LegTask, Reference, TrackedPoint
from go2_wbc.robot.estimator import SensorReading
from go2_wbc.robot.model import RobotModel
from go2_wbc.robot.rotations import rotation_from_rpy
from go2_wbc.robot.state import RobotState, Snapshot
from go2_wbc.wbc.controller import WbcSolution, WholeBodyController

Legs = tuple[LegTask, ...]
ST, SW, JO = LegTask.STANCE, LegTask.SWING, LegTask.JOINTS
FOUR_FEET: Legs = (ST, ST, ST, ST)
THREE_FEET: tuple[Legs, ...] = tuple(
    tuple(kind if leg is up else ST for leg in LEGS) for kind in (SW, JO) for up in LEGS
)
TWO_FEET: tuple[Legs, ...] = (
    (ST, SW, SW, ST),
    (SW, ST, ST, SW),
    (JO, ST, ST, SW),
    (ST, SW, ST, SW),
)
MODES: tuple[Legs, ...] = (FOUR_FEET, *THREE_FEET, *TWO_FEET, (SW, SW, ST, SW), (SW, SW, SW, SW))
EFFORTS = (0.0, 2.0, 15.0)
"""Scale [m/s^2] of the accelerations asked for: at rest, lively, too much."""

STAND_JOINTS = np.tile([0.0, 0.85, -1.7], 4)
MIRRORED_LEGS = [leg.mirror for leg in LEGS]
POLAR = np.array([1.0, -1.0, 1.0])
"""What the mirror y -> -y does to positions, velocities and forces."""
AXIAL = -POLAR  #: What it does to angular velocities and moments


def state_of(q: np.ndarray, v: np.ndarray | None = None, time: float = 0.0) -> RobotState:
    v = np.zeros(18) if v is None else v
    return RobotState(time, q, v, np.zeros(12), np.zeros(4), np.zeros(4, dtype=bool))


def standing_q(height: float = 0.3) -> np.ndarray:
    return np.concatenate([[0.0, 0.0, height, 0.0, 0.0, 0.0, 1.0], STAND_JOINTS])


def random_state(rng: np.random.Generator, tilt: float = 0.1) -> RobotState:
    """Near standing, tilted by about ``tilt`` rad, and moving briskly."""
    roll, pitch = rng.normal(scale=tilt, size=2)
    R = rotation_from_rpy(roll, pitch, rng.uniform(-np.pi, np.pi))
    joints = STAND_JOINTS + rng.normal(scale=0.15, size=12)
    q = np.concatenate([rng.normal(scale=0.3, size=3), pin.Quaternion(R).coeffs(), joints])
    v = np.concatenate([rng.normal(scale=0.5, size=6), rng.normal(scale=1.0, size=12)])
    return state_of(q, v)


def random_reference(
    snapshot: Snapshot, legs: Legs, effort: float, rng: np.random.Generator
) -> Reference:
    point = TrackedPoint.COM if rng.random() < 0.5 else TrackedPoint.BASE
    p = snapshot.p_world_com if point is TrackedPoint.COM else snapshot.state.p_world_base
    turn = rotation_from_rpy(*rng.normal(scale=0.1, size=3))
    body = BodyTarget(
        point=point,
        p_world=p + rng.normal(scale=0.02, size=3),
        v_world=rng.normal(scale=0.2, size=3),
        a_world=effort * rng.normal(size=3),
        R_world_base=snapshot.R_world_base @ turn,
        w_world=rng.normal(scale=0.3, size=3),
        dw_world=effort * rng.normal(size=3),
    )
    return Reference(
        body=body,
        legs=legs,
        normal_force_min=rng.choice([0.0, 5.0, 15.0], size=4),
        normal_force_max=rng.choice([40.0, 90.0, 250.0], size=4),
        p_world_feet=snapshot.p_world_feet + rng.normal(scale=0.03, size=(4, 3)),
        v_world_feet=rng.normal(scale=0.3, size=(4, 3)),
        a_world_feet=effort * rng.normal(size=(4, 3)),
        q_joints=snapshot.state.joint_positions + rng.normal(scale=0.1, size=12),
        v_joints=rng.normal(scale=0.5, size=12),
        a_joints=3.0 * effort * rng.normal(size=12),
    )


def with_planned_forces(reference: Reference, rng: np.random.Generator) -> Reference:
    """The same with forces to be kept near, as a gait has that plans them, thrown or not."""
    forces = rng.normal(loc=[0.0, 0.0, 80.0], scale=[20.0, 20.0, 40.0], size=(4, 3))
    return replace(
        reference,
        f_world_feet=forces,
        force_weight=float(rng.choice([3e-3, 1e-1])),
        orientation_discount=float(rng.choice([0.0, 3.0])),
    )


def holding_reference(snapshot: Snapshot, legs: Legs = FOUR_FEET) -> Reference:
    """Stay exactly as measured, at rest."""
    zero, zeros = np.zeros(3), np.zeros((4, 3))
    body = BodyTarget(
        point=TrackedPoint.COM,
        p_world=snapshot.p_world_com,
        v_world=zero,
        a_world=zero,
        R_world_base=snapshot.R_world_base,
        w_world=zero,
        dw_world=zero,
    )
    return Reference(
        body=body,
        legs=legs,
        normal_force_min=np.full(4, 5.0),
        normal_force_max=np.full(4, 250.0),
        p_world_feet=snapshot.p_world_feet,
        v_world_feet=zeros,
        a_world_feet=zeros,
        q_joints=snapshot.state.joint_positions,
        v_joints=np.zeros(12),
        a_joints=np.zeros(12),
    )


def cases(model: RobotModel, count: int, seed: int) -> Iterator[tuple[Snapshot, Reference]]:
    """``count`` random problems that go through every contact mode and every effort."""
    rng = np.random.default_rng(seed)
    for index in range(count):
        snapshot = model.snapshot(random_state(rng))
        legs = MODES[index % len(MODES)]
        effort = EFFORTS[(index // len(MODES) + index) % len(EFFORTS)]
        yield snapshot, random_reference(snapshot, legs, effort, rng)


def fast_cases(model: RobotModel, count: int, seed: int) -> Iterator[tuple[Snapshot, Reference]]:
    """Problems whose joints turn so fast that the motors' line counts.

    The trunk rises and turns fast over standing feet that do not move, and is asked for more of it;
    raised legs turn at up to 0.8 of their speed.
    """
    rng = np.random.default_rng(seed)
    for index in range(count):
        legs = MODES[index % len(MODES)]
        state = random_state(rng)
        v = np.concatenate([rng.normal(scale=0.3, size=6), state.v[6:]])
        v[2] = rng.uniform(-1.0, 2.5)
        J = model.snapshot(state).J_contacts
        for leg, task in enumerate(legs):
            joints = slice(6 + 3 * leg, 9 + 3 * leg)
            fast = rng.uniform(-0.8, 0.8, size=3) * model.speed_limits[:3]
            still = np.linalg.solve(J[leg][:, joints], -J[leg][:, :6] @ v[:6])
            v[joints] = still if task is LegTask.STANCE else fast
        snapshot = model.snapshot(replace(state, v=v))
        reference = random_reference(snapshot, legs, 15.0, rng)
        body = replace(reference.body, v_world=snapshot.R_world_base @ v[:3])
        body = replace(body, a_world=np.array([0.0, 0.0, rng.uniform(0.0, 60.0)]))
        force = np.full(4, 400.0)
        yield snapshot, replace(reference, body=body, normal_force_max=force)


def standing(model: RobotModel, legs: Legs = FOUR_FEET) -> tuple[Snapshot, Reference]:
    """At rest on its feet, and asked to go on."""
    snapshot = model.snapshot(state_of(standing_q()))
    return snapshot, holding_reference(snapshot, legs)


def solved_alike(
    ours: WholeBodyController,
    theirs: WholeBodyController,
    problems: Iterable[tuple[Snapshot, Reference]],
    tolerance: float,
) -> Iterator[tuple[Snapshot, Reference, WbcSolution, WbcSolution]]:
    """What two controllers find: the same torques [N m], or no solution, both."""
    for snapshot, reference in problems:
        found = ours.solve_compiled(snapshot, reference)
        try:
            other = theirs.solve(snapshot, reference)
        except QpInfeasible:
            other = None
        assert (found is None) == (other is None)
        if found is not None and other is not None:
            np.testing.assert_allclose(found.tau, other.tau, atol=tolerance, rtol=0)
            yield snapshot, reference, found, other


def standing_reading(time: float = 0.0, **changes: np.ndarray) -> SensorReading:
    """What the sensors of a robot read that stands at rest, but for the ``changes``."""
    up, zeros = np.array([0.0, 0.0, 9.81]), np.zeros(12)
    reading = SensorReading(time, np.zeros(3), up, STAND_JOINTS, zeros, zeros, np.full(4, 40.0))
    return replace(reading, **changes)


def moved(model: RobotModel, state: RobotState, a: np.ndarray, dt: float) -> RobotState:
    """The state ``dt`` later under the constant generalised acceleration ``a``, to second order."""
    q = pin.integrate(model.pin_model, state.q, state.v * dt + a * dt * dt / 2)
    return state_of(q, state.v + a * dt, state.time + dt)


def motion_error(snapshot: Snapshot, solution: WbcSolution) -> float:
    """Largest entry of M qdd + h - S' tau - J' f [N, N m]."""
    generalised = np.concatenate([np.zeros(6), solution.tau])
    for J, force in zip(snapshot.J_contacts, solution.forces, strict=True):
        generalised += J.T @ force
    M, h = snapshot.mass_matrix, snapshot.bias
    return float(np.abs(M @ solution.qdd + h - generalised).max())


def mirrored_joints(values: np.ndarray) -> np.ndarray:
    """Legs change sides; the abduction joint (first of a leg) changes its sign."""
    return (values.reshape(4, 3)[MIRRORED_LEGS] * [-1.0, 1.0, 1.0]).ravel()


def mirrored_feet(values: np.ndarray) -> np.ndarray:
    return values[MIRRORED_LEGS] * POLAR


def mirrored_rotation(R: np.ndarray) -> np.ndarray:
    return POLAR[:, None] * R * POLAR


def mirrored_state(state: RobotState) -> RobotState:
    x, y, z, w = state.q[3:7]
    quaternion = [-x, y, -z, w]
    q = np.concatenate([state.q[:3] * POLAR, quaternion, mirrored_joints(state.joint_positions)])
    base = [state.v[:3] * POLAR, state.v[3:6] * AXIAL]
    return state_of(q, np.concatenate([*base, mirrored_joints(state.joint_velocities)]), state.time)


def mirrored_reference(reference: Reference) -> Reference:
    body, (fl, fr, rl, rr) = reference.body, reference.legs
    polar, axial = ("p_world", "v_world", "a_world"), ("w_world", "dw_world")
    feet, joints = ("p_world_feet", "v_world_feet", "a_world_feet"), ("q", "v", "a")
    forces = ("normal_force_min", "normal_force_max")
    return replace(
        reference,
        body=replace(
            body,
            R_world_base=mirrored_rotation(body.R_world_base),
            **{name: getattr(body, name) * POLAR for name in polar},
            **{name: getattr(body, name) * AXIAL for name in axial},
        ),
        legs=(fr, fl, rr, rl),
        **{name: getattr(reference, name)[MIRRORED_LEGS] for name in forces},
        **{name: mirrored_feet(getattr(reference, name)) for name in feet},
        **{f"{x}_joints": mirrored_joints(getattr(reference, f"{x}_joints")) for x in joints},
    )


def symmetric_model() -> RobotModel:
    """The robot with a trunk whose inertia is symmetric; the URDF's legs already are."""
    model = RobotModel()
    trunk = model.pin_model.inertias[1]
    inertia = (trunk.inertia + mirrored_rotation(trunk.inertia)) / 2
    lever = trunk.lever * [1.0, 0.0, 1.0]
    model.pin_model.inertias[1] = pin.Inertia(trunk.mass, lever, inertia)
    return model


def angular_velocity_from_rpy(
    rpy: np.ndarray, rate: np.ndarray, acceleration: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """World-frame w and dw of roll, pitch, yaw rates, by Pinocchio."""
    E = pin.rpy.computeRpyJacobian(rpy, pin.LOCAL_WORLD_ALIGNED)
    dE = pin.rpy.computeRpyJacobianTimeDerivative(rpy, rate, pin.LOCAL_WORLD_ALIGNED)
    return E @ rate, E @ acceleration + dE @ rate
