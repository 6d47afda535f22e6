"""Checks of forces: can the feet carry the motion, and can the motors?

At every instant the contact forces are those of least deviation from an even share of the weight
that give the trunk the wrench it needs (Newton-Euler; Pinocchio's mass matrix and bias), within the
friction pyramid of the whole-body controller. Torques follow from the joint rows of the equations
of motion: tau = M a + h - J' f.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from go2_wbc.errors import QpInfeasible
from go2_wbc.geometry import support_margins
from go2_wbc.legs import LEGS
from go2_wbc.robot.model import RobotModel
from go2_wbc.robot.snapshot import Snapshot
from go2_wbc.robot.state import RobotState
from go2_wbc.wbc.solvers import DenseQp, solve_dense_qp
from motions.feasibility.kinematic import FEET, JOINTS
from motions.feasibility.limits import FeasibilityLimits
from motions.feasibility.report import Series
from motions.trajectory import Trajectory

ARM = 0.2
"""Length [m] by which moments are made comparable to forces: half the robot's track."""
EVENNESS = 1e-4
"""Weight of an even share of the load, against the wrench that the trunk needs."""
PYRAMID = 0.6
"""Friction coefficient of the whole-body controller's pyramid."""
GREATEST_FORCE = 400.0
"""Greatest normal force [N] of a fully loaded foot; see ``motions.plan``."""
LOADED = 0.999
"""Share of its load from which on a foot counts as standing fully."""
PRESSED = 10.0
"""Normal force [N] from which on the friction of a foot matters."""


@dataclass(frozen=True, slots=True)
class Forces:
    """What the ground and the motors must give.

    Attributes:
        contact: (n, 4, 3) forces on the feet in the frame of the motion [N].
        tau: (n, 12) joint torques [N m].
        missing: (n, 2) part of the force [N] and of the moment [N m] that the feet cannot give.
        zmp: (n, 2) zero-moment point on the ground [m].
    """

    contact: Float[np.ndarray, "n 4 3"]
    tau: Float[np.ndarray, "n 12"]
    missing: Float[np.ndarray, "n 2"]
    zmp: Float[np.ndarray, "n 2"]


def forces_of(motion: Trajectory, model: RobotModel) -> Forces:
    """Contact forces and torques along ``motion``."""
    count = len(motion.times)
    contact, tau = np.zeros((count, 4, 3)), np.zeros((count, 12))
    missing, zmp = np.zeros((count, 2)), np.zeros((count, 2))
    for row in range(count):
        snapshot = model.snapshot(_state(motion, row))
        needed = snapshot.mass_matrix @ motion.a[row] + snapshot.bias
        contact[row], missing[row] = _share(snapshot, needed[:6], motion.load_share[row], model)
        J = snapshot.J_contacts.reshape(12, 18)
        tau[row] = needed[6:] - J[:, 6:].T @ contact[row].ravel()
        zmp[row] = _zero_moment_point(snapshot, needed[:6])
    return Forces(contact, tau, missing, zmp)


def torque(
    motion: Trajectory, forces: Forces, model: RobotModel, limits: FeasibilityLimits
) -> tuple[Series, Series]:
    """Torques against the motors' limits, and against what they give at that speed."""
    asked = np.abs(forces.tau)
    bounds = np.tile(limits.torque_share * model.torque_limits, (len(asked), 1))
    share = np.abs(motion.v[:, 6:]) / model.speed_limits
    fade = np.clip((1.0 - share) / (1.0 - limits.knee_speed_share), 0.0, 1.0)
    at_speed = fade * model.torque_limits
    drives = forces.tau * motion.v[:, 6:] > 0.0
    left = np.where(drives, at_speed - asked, np.nan)
    tight = 0.1 * float(model.torque_limits.min())
    return (
        Series("torque", "N m", JOINTS, motion.times, asked, bounds, bounds - asked, tight),
        Series("torque at speed", "N m", JOINTS, motion.times, asked, at_speed, left, tight),
    )


def contacts(
    motion: Trajectory, forces: Forces, limits: FeasibilityLimits
) -> tuple[Series, Series, Series]:
    """What the feet cannot give, the least load of three standing ones, and the friction needed."""
    bounds = np.tile([limits.wrench, limits.wrench * ARM], (len(motion.times), 1))
    short = Series(
        "contact wrench",
        "N",
        ("force", "moment"),
        motion.times,
        forces.missing,
        bounds,
        bounds - forces.missing,
    )
    normal = forces.contact[:, :, 2]
    is_needed = ~motion.stance.all(axis=1, keepdims=True)  # on four feet one may be unloaded
    stands = (motion.load_share > LOADED) & is_needed
    load = np.where(stands, normal - limits.foot_load, np.nan)
    floor = np.full_like(normal, limits.foot_load)
    sideways = np.abs(forces.contact[:, :, :2]).max(axis=2)
    is_pressed = normal > PRESSED
    needed = np.where(is_pressed, sideways / np.where(is_pressed, normal, 1.0), 0.0)
    grip = np.full_like(needed, limits.friction)
    left = np.where(is_pressed, grip - needed, np.nan)
    return (
        short,
        Series("foot load", "N", FEET, motion.times, normal, floor, load, tight=10.0),
        Series("friction", "", FEET, motion.times, needed, grip, left, tight=0.05),
    )


def support(motion: Trajectory, forces: Forces, limits: FeasibilityLimits) -> tuple[Series, Series]:
    """Distance of the CoM and of the zero-moment point to the edges of the support polygon."""
    values = np.full((len(motion.times), 2), -1.0)
    for stands in np.unique(motion.stance, axis=0):
        if not stands.any():
            continue
        rows = (motion.stance == stands).all(axis=1)
        feet = motion.p_feet[stands, :2]
        for column, points in enumerate((motion.p_com[:, :2], forces.zmp)):
            values[rows, column] = support_margins(feet, points[rows])
    series = []
    for column, (check, subject, least) in enumerate(
        (("support", "CoM", limits.support), ("support of ZMP", "ZMP", limits.zero_moment))
    ):
        value = values[:, column : column + 1]
        bound = np.full_like(value, least)
        series.append(
            Series(check, "m", (subject,), motion.times, value, bound, value - bound, tight=0.01)
        )
    return series[0], series[1]


def _state(motion: Trajectory, row: int) -> RobotState:
    return RobotState(
        time=float(motion.times[row]),
        q=motion.q[row],
        v=motion.v[row],
        tau=np.zeros(12),
        foot_forces=np.zeros(4),
        feet_in_contact=motion.stance[row],
    )


def _share(
    snapshot: Snapshot,
    wrench: Float[np.ndarray, "6"],
    load_share: Float[np.ndarray, "4"],
    model: RobotModel,
) -> tuple[Float[np.ndarray, "4 3"], Float[np.ndarray, "2"]]:
    """Contact forces (4, 3) [N], and what force [N] and moment [N m] they leave over."""
    forces = np.zeros((4, 3))
    legs = [leg for leg in LEGS if load_share[leg] > 0.0]
    scale = np.repeat([1.0, 1.0 / ARM], 3)
    if legs:
        A = snapshot.J_contacts[legs, :, :6].reshape(-1, 6).T
        even = np.zeros((len(legs), 3))
        shares = load_share[legs]
        even[:, 2] = model.mass * model.gravity * shares / shares.sum()
        weighted = scale[:, None] * A
        H = weighted.T @ weighted + EVENNESS * np.eye(3 * len(legs))
        g = -weighted.T @ (scale * wrench) - EVENNESS * even.ravel()
        C = _PYRAMIDS[len(legs) - 1]
        lower = np.tile([-np.inf] * 4 + [0.0], len(legs))
        upper = np.zeros((len(legs), 5))
        upper[:, 4] = GREATEST_FORCE * shares
        try:
            x = solve_dense_qp(DenseQp(H, g, C, lower, upper.ravel()), "daqp").x
        except QpInfeasible:
            x = np.zeros(3 * len(legs))
        forces[legs] = x.reshape(-1, 3)
        wrench = wrench - A @ x
    return forces, np.array([np.linalg.norm(wrench[:3]), np.linalg.norm(wrench[3:])])


def _zero_moment_point(
    snapshot: Snapshot, wrench: Float[np.ndarray, "6"]
) -> Float[np.ndarray, "2"]:
    """Where the ground's forces act together (Vukobratovic & Borovac 2004, eq. 3)."""
    R, base = snapshot.R_world_base, snapshot.state.q[:3]
    force = R @ wrench[:3]
    moment = R @ wrench[3:] + np.cross(base, force)
    vertical = max(float(force[2]), 1.0)
    return np.array([-moment[1] / vertical, moment[0] / vertical])


_PYRAMID_ROWS = np.array(
    [
        [1.0, 0.0, -PYRAMID],
        [-1.0, 0.0, -PYRAMID],
        [0.0, 1.0, -PYRAMID],
        [0.0, -1.0, -PYRAMID],
        [0.0, 0.0, 1.0],
    ]
)
_PYRAMIDS = tuple(np.kron(np.eye(feet), _PYRAMID_ROWS) for feet in (1, 2, 3, 4))
