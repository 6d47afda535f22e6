"""How far the trunk is off its plan: by joint friction, by missing contact forces, by tipping over.

The controller feeds forward a part of the friction of the joints (``robot.joint_friction``). With
the feet fixed, the twist t of the trunk moves the joints of the stance legs by T t, so the
remaining friction r acts on the trunk as the force T' r, against the inertia of trunk and legs
together (virtual power; Featherstone, *Rigid Body Dynamics Algorithms*, 2008, sec. 3.4):

    [1 T']  M  [1]  a  =  - T' r,        T = - J_legs^-1 J_base
              [T]

The controller pulls the trunk back with its gains. The trunk is so light, compared with the
friction of four hips, that a roll lags by degrees where all other values are small: 9 at 190 deg/s.

On three feet nothing pulls back a trunk whose zero-moment point is at the edge of their triangle.
The foot with the least load lifts off, and the trunk tips over the line between the others. With
the force F of the feet, the height z of the CoM and the distance d of the plan's zero-moment point
from the edge, negative outside, this is a pendulum (Kajita et al., *The 3D linear inverted pendulum
mode*, IROS 2001):

    e'' = max(- kp e - kd e',  F / (m z) (e - d)),    e >= 0
"""

from __future__ import annotations

import numpy as np
from jaxtyping import Bool, Float, Int

from go2_wbc.legs import LEGS
from go2_wbc.robot.model import RobotModel
from go2_wbc.wbc.config import WbcConfig
from motions.feasibility import forces
from motions.feasibility.report import Series
from motions.memory import Rows, by_rows
from motions.plan.trajectory import Trajectory

TRIPOD = 3  #: Standing feet, with one raised
LOWEST, FALLEN = 0.1, 0.3
"""Least height [m] of a CoM, and a distance [m] from which on it has fallen."""
EVERY = 5  #: Samples between those at which the inertia is computed; it changes slowly
RCOND = 0.05  #: Of a leg's Jacobian: a leg that is nearly stretched turns no faster than this says


def tracking(case: forces.Case, pushes: Float[np.ndarray, "n 6"]) -> Series:
    """How far the trunk is off its plan in all: m, rad; solved parts, played otherwise, count 0.

    In MuJoCo it was off by 1.05 to 1.3 times as much for friction (motions drawn for that alone).
    ``pushes``: what is ``forces.lost``.
    """
    taken, damping = resistance(case)
    errors = forces.errors_of(case.path, pushes + taken, damping)
    most = np.array([case.limits.off, case.limits.off_angle])
    return case.series("tracking", "m, rad", forces.TRUNK, errors, most)


def resistance(case: forces.Case) -> tuple[Float[np.ndarray, "n 6"], Float[np.ndarray, "6"]]:
    """What the joints' friction takes of the trunk's acceleration [m/s^2, rad/s^2], and damps.

    Of the place along the axes of the motion, of the turning along those of the trunk. It is that
    at the speeds of the plan; a trunk that falls behind turns the joints less, so the viscous part
    damps its errors [1/s], on average over the motion.
    """
    motion, world, count = case.path, case.world, len(case.path.times)
    rows = np.array([*range(0, count - 1, EVERY), count - 1])
    v, a = motion.v[rows, 6:], motion.a[rows, 6:]
    rest = forces.joint_friction(v, world) - WbcConfig().joint_friction.torque(v, a)
    asked = np.hstack([motion.q[rows, 3:], motion.stance[rows], rest])

    def work(new: Rows) -> Float[np.ndarray, "k 12"]:
        return np.hstack(_taken(motion, rows[new], rest[new], case.heavy))

    both = by_rows(case.memory, "resistance", asked, work)
    taken, damped = both[:, :6], both[:, 6:]
    columns = [np.interp(motion.times, motion.times[rows], column) for column in taken.T]
    return np.column_stack(columns), world.joint_friction * forces.VISCOUS * damped.mean(axis=0)


def _taken(
    motion: Trajectory,
    rows: Int[np.ndarray, " m"],
    rest: Float[np.ndarray, "m 12"],
    model: RobotModel,
) -> tuple[Float[np.ndarray, "m 6"], Float[np.ndarray, "m 6"]]:
    """The acceleration, and by which damping a unit of viscous friction damps, at these samples."""
    snapshots = [model.snapshot(forces.state_at(motion, row)) for row in rows.tolist()]
    J = np.array([one.J_contacts for one in snapshots])
    follow = np.zeros((len(rows), 18, 6))
    follow[:, :6] = np.eye(6)
    for leg in LEGS:
        stands, own = motion.stance[rows, leg], slice(6 + 3 * leg, 9 + 3 * leg)
        turns = np.linalg.pinv(J[stands, leg][:, :, own], rcond=RCOND)
        follow[stands, own] = -turns @ J[stands, leg][:, :, :6]
    ahead, turned = follow.transpose(0, 2, 1), follow[:, 6:]
    inertia = ahead @ np.array([one.mass_matrix for one in snapshots]) @ follow
    push = ahead[:, :, 6:] @ rest[:, :, None]
    a = -np.linalg.solve(inertia, push)[:, :, 0]
    damping = np.linalg.solve(inertia, ahead[:, :, 6:] @ turned)
    R = np.array([one.R_world_base for one in snapshots])
    forth = np.hstack([(R @ a[:, :3, None])[:, :, 0], a[:, 3:]])
    return forth, np.diagonal(damping, axis1=1, axis2=2)


def tipping(case: forces.Case, zmp: Float[np.ndarray, " n"]) -> Series:
    """How far the trunk falls over the edge of three feet [m], where they stand for long.

    Of motions that bounce and sway on three feet, drawn for that alone, 39 up to 5.1 mm did not
    fall; of 6 above 7.4 mm, 5 fell, and the other one came 50 mm off. ``zmp``: how far inside of
    the support the zero-moment point is [m].
    """
    motion = case.path
    is_asked = (motion.stance.sum(axis=1) == TRIPOD) & ~motion.is_dynamic
    is_asked &= ~forces.passes_over_few(motion, case.limits)
    values = np.zeros((len(zmp), 1))
    if (zmp[is_asked] < 0.0).any():
        normal = np.maximum(case.forces.contact[:, :, 2].sum(axis=1), 0.0)
        rates = normal / (case.heavy.mass * np.maximum(motion.p_com[:, 2], LOWEST))
        values[:, 0] = _falls(rates, zmp, is_asked, float(np.mean(np.diff(motion.times))))
    what = ("tipping", "m", ("trunk",), values, case.limits.tipping)
    return case.series(*what, where=is_asked[:, None])


def _falls(
    rates: Float[np.ndarray, " n"],
    inside: Float[np.ndarray, " n"],
    is_asked: Bool[np.ndarray, " n"],
    dt: float,
) -> Float[np.ndarray, " n"]:
    gains = WbcConfig().body_position
    kp, kd = gains.arrays[0][0], gains.arrays[1][0]
    e = speed = 0.0
    found = np.zeros(len(rates))
    for row in np.flatnonzero(is_asked).tolist():
        a = max(-kp * e - kd * speed, rates[row] * (e - inside[row]))
        speed += dt * a
        e += dt * speed
        if e < 0.0:
            e, speed = 0.0, max(speed, 0.0)
        e = min(e, FALLEN)
        found[row] = e
    return found
