"""Contact forces of a trajectory from snapshots, and by a QP of its own for each instant."""

from __future__ import annotations

import numpy as np
from jaxtyping import Float

from go2_wbc.errors import QpInfeasible
from go2_wbc.kernels.layout import LEAST_PRESSURE
from go2_wbc.legs import LEGS, Leg
from go2_wbc.robot.model import RobotModel
from go2_wbc.robot.snapshot import Snapshot
from go2_wbc.wbc.constraints import friction_pyramid
from go2_wbc.wbc.loads import relative_loads
from go2_wbc.wbc.solvers import DenseQp, solve_dense_qp
from motions.feasibility.dynamic import EVENNESS, PYRAMID, Forces, _spread, state_at, weights_of
from motions.plan import NORMAL_FORCE_MAX
from motions.trajectory import Trajectory, zero_moment_points


def forces_one_by_one(motion: Trajectory, model: RobotModel) -> Forces:
    """What ``forces_of`` must give, one snapshot and one QP after the other."""
    count = len(motion.times)
    contact, tau = np.zeros((count, 4, 3)), np.zeros((count, 12))
    missing, needed = np.zeros((count, 2)), np.zeros((count, 18))
    for row in range(count):
        snapshot = model.snapshot(state_at(motion, row))
        needed[row] = snapshot.mass_matrix @ motion.a[row] + snapshot.bias
    needed = _spread(needed, motion)
    wrench, scale = needed[:, :6], weights_of(motion, model)
    for row in range(count):
        snapshot = model.snapshot(state_at(motion, row))
        shares = motion.load_share[row]
        contact[row], missing[row] = _share(snapshot, wrench[row], shares, scale, model)
        J = snapshot.J_contacts.reshape(12, 18)
        tau[row] = needed[row, 6:] - J[:, 6:].T @ contact[row].ravel()
    return Forces(contact, tau, missing, zero_moment_points(motion.q, motion.rpy, wrench), wrench)


def _share(
    snapshot: Snapshot,
    wrench: Float[np.ndarray, "6"],
    load_share: Float[np.ndarray, "4"],
    scale: Float[np.ndarray, "6"],
    model: RobotModel,
) -> tuple[Float[np.ndarray, "4 3"], Float[np.ndarray, "2"]]:
    """Contact forces (4, 3) [N], and what force [N] and moment [N m] they leave over.

    Minimises |S (A f - w)|^2 + e |D (f - f_even)|^2 over the forces f of the loaded feet, with A
    the base columns of their Jacobians, transposed, S = diag(``scale``), D^2 = 1
    for the normal forces and the mean load over the foot's for those along the ground, subject to
    |f_x|, |f_y| <= mu f_z and 0 <= f_z <= f_max s, where s is a foot's share of its load. As a QP,
    1/2 f' H f + g' f, with H = (S A)' (S A) + e D^2 and g = -(S A)' S w - e f_even.
    """
    forces = np.zeros((4, 3))
    legs = [leg for leg in LEGS if load_share[leg] > 0.0]
    if legs:
        A = snapshot.J_contacts[legs, :, :6].reshape(-1, 6).T
        even = np.zeros((len(legs), 3))
        shares = load_share[legs]
        even[:, 2] = model.mass * model.gravity * shares / shares.sum()
        weighted = scale[:, None] * A
        along = 1.0 / _loads(snapshot, wrench, legs, shares, model)
        D2 = np.column_stack([along, along, np.ones(len(legs))])
        H = weighted.T @ weighted + EVENNESS * np.diag(D2.ravel())
        g = -weighted.T @ (scale * wrench) - EVENNESS * even.ravel()
        C = _PYRAMIDS[len(legs) - 1]
        lower = np.tile([-np.inf] * 4 + [0.0], len(legs))
        upper = np.zeros((len(legs), 5))
        upper[:, 4] = NORMAL_FORCE_MAX * shares
        try:
            x = solve_dense_qp(DenseQp(H, g, C, lower, upper.ravel()), "daqp").x
        except QpInfeasible:
            x = np.zeros(3 * len(legs))
        forces[legs] = x.reshape(-1, 3)
        wrench = wrench - A @ x
    return forces, np.array([np.linalg.norm(wrench[:3]), np.linalg.norm(wrench[3:])])


def _loads(
    snapshot: Snapshot,
    wrench: Float[np.ndarray, "6"],
    legs: list[Leg],
    shares: Float[np.ndarray, " k"],
    model: RobotModel,
) -> Float[np.ndarray, " k"]:
    """The expected loads of ``legs``, over their mean: see ``wbc.loads.relative_loads``."""
    R = snapshot.R_world_base
    force, moment = R @ wrench[:3], R @ wrench[3:]
    pressure = max(force[2], LEAST_PRESSURE * model.mass * model.gravity)
    places = snapshot.p_world_feet[legs] - snapshot.state.p_world_base
    depth = model.foot_radius - places[:, 2].mean()
    along = [-(moment[1] + depth * force[0]), moment[0] - depth * force[1]]
    most = NORMAL_FORCE_MAX * shares * len(legs) / pressure
    return relative_loads(places[:, :2], np.array(along) / pressure, most)


_PYRAMIDS = tuple(np.kron(np.eye(feet), friction_pyramid(PYRAMID)) for feet in (1, 2, 3, 4))
"""Rows of one to four feet."""
