"""Checks of forces: can the feet carry the motion, and can the motors?

The equations of motion, M a + h = S' tau + J' f (Wieber, Tedrake & Kuindersma 2016), split into
six rows of the base, in which no motor acts, and twelve of the joints:

    w = M_b a + h_b = J_b' f               the wrench that the trunk needs (Newton-Euler)
    tau = M_j a + h_j - J_j' f             what is left for the motors

M and h are Pinocchio's, with rotor inertia, v and a as in ``Trajectory`` (the base's in its own
frame, so w too), f the forces of the ground on the rolling contact points in the frame of the
motion. Of the f that give the trunk its wrench within the friction pyramid, the one that deviates
least from an even share of the weight is taken, and along the ground from none, the less the less a
foot bears, as the whole-body controller does it; see
``wbc.trajectory_loads``.

The ground gives no force at once: MuJoCo's contacts need 20 ms (their ``solref``), as rubber and a
leg's gears do. M a + h is therefore averaged over ``SPREAD`` samples before it is shared. Where a
plan jumps from one sample to the next, the force of one is taken back by the other.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Bool, Float, Int

from go2_wbc.feasibility_limits import FeasibilityLimits
from go2_wbc.geometry import support_margins
from go2_wbc.records import packed
from go2_wbc.robot.leg_kinematics import leg_table
from go2_wbc.robot.model import RobotModel
from go2_wbc.robot.state import RobotState
from go2_wbc.wbc.config import WbcConfig
from go2_wbc.wbc.constraints import friction_pyramid
from go2_wbc.wbc.trajectory_loads import LoadNumbers, lag, share_loads
from go2_wbc.world import World
from motions.batch_kinematics import attitudes, turned, zero_moment_points
from motions.feasibility.kinematic import FEET, JOINTS
from motions.feasibility.report import Series
from motions.plan.trajectory import Trajectory
from motions.postures import NORMAL_FORCE_MAX

SPREAD = 3
"""Samples, 30 ms, over which forces are averaged: with it torques and slips of jolts came out as in
MuJoCo (motions drawn for that alone), where single samples gave three times as much."""
ARM = 0.2
"""Length [m] that makes moments comparable to forces: half the distance of front and rear feet."""
EVENNESS = 1e-4
"""Weight of an even share of the load, against 1 of the wrench: decides only between forces that
give the same wrench, and takes less than 0.01 N off that."""
PYRAMID = WbcConfig().friction
"""Friction coefficient of the whole-body controller's pyramid: it would ask for no other forces."""
DRY, VISCOUS, CREEP = 0.2, 0.1, 0.1
"""Friction of a joint: N m, N m s/rad, and the speed [rad/s] below which the dry part is less. As
the simulated robot has it (``plant.mujoco.model.JointDynamics``)."""
LOADED = 0.999
"""Share of its load from which on a foot counts as standing fully: 1, less rounding."""
PRESSED = 10.0
"""Normal force [N] from which on the friction of a foot matters; below, the quotient is noise and
a slip moves nothing (own choice, 6 % of the weight)."""
STILL = 1e-6
"""Joint speed [rad/s] below which a motor drives nothing: more than rounding, 1e-15."""
NO_SUPPORT = 1.0
"""How far outside [m] of their support CoM and zero-moment point count when no foot stands."""
_FEW = (2, 3)
TIGHT_TORQUE, TIGHT_LOAD, TIGHT_FRICTION, TIGHT_SUPPORT = 0.1, 10.0, 0.05, 0.01
"""Margins below which a warning is due: share of the smallest torque limit, N, 1 and m; own choice,
about what separates a plan from its run in simulation."""


@dataclass(frozen=True, slots=True)
class Forces:
    """What the ground and the motors must give.

    Attributes:
        contact: (n, 4, 3) forces on the feet in the frame of the motion [N].
        tau: (n, 12) joint torques [N m].
        missing: (n, 2) part of the force [N] and of the moment [N m] that the feet cannot give.
        zmp: (n, 2) zero-moment point on the ground [m].
        wrench: (n, 6) what the trunk needs, in its frame [N, N m].
        v_motors: (n, 12) joint speeds [rad/s] at which the torques are given; those of the path
            unless said.
    """

    contact: Float[np.ndarray, "n 4 3"]
    tau: Float[np.ndarray, "n 12"]
    missing: Float[np.ndarray, "n 2"]
    zmp: Float[np.ndarray, "n 2"]
    wrench: Float[np.ndarray, "n 6"]
    v_motors: Float[np.ndarray, "n 12"] | None = None


def forces_of(motion: Trajectory, model: RobotModel) -> Forces:
    """Contact forces and torques along ``motion``."""
    rows = zip(motion.q, motion.v, motion.a, strict=True)
    needed = _spread(np.array([model.inverse_dynamics(*row) for row in rows]), motion)
    contact, tau = np.zeros((len(needed), 4, 3)), needed[:, 6:].copy()
    missing = np.empty((len(needed), 2))
    joints, load_share = (np.array(a, order="C") for a in (motion.q[:, 7:], motion.load_share))
    given = (joints, attitudes(motion.rpy), needed[:, :6].copy(), load_share)
    scale = weights_of(motion, model)
    tables = (leg_table(model), friction_pyramid(PYRAMID), scale, numbers_of(model))
    share_loads(*given, *tables, contact, tau, missing)
    wrench = given[2]
    return Forces(contact, tau, missing, zero_moment_points(motion.q, motion.rpy, wrench), wrench)


def _spread(needed: Float[np.ndarray, "n 18"], motion: Trajectory) -> Float[np.ndarray, "n 18"]:
    """Means over ``SPREAD`` samples; solved parts, judged by their own forces, are left out."""
    half = SPREAD // 2
    counts = np.pad(1.0 * ~motion.is_dynamic, half, mode="edge")
    weighted = np.pad(needed * ~motion.is_dynamic[:, None], ((half, half), (0, 0)), mode="edge")
    total, count = (
        sum(rows[k : len(rows) - 2 * half + k] for k in range(SPREAD))
        for rows in (weighted, counts[:, None])
    )
    return np.where(motion.is_dynamic[:, None], needed, total / np.maximum(count, 1.0))


def numbers_of(model: RobotModel) -> LoadNumbers:
    """What the shares of the load depend on."""
    weight = model.mass * model.gravity
    return packed(LoadNumbers(EVENNESS, weight, NORMAL_FORCE_MAX, model.foot_radius))


def weights_of(motion: Trajectory, model: RobotModel) -> Float[np.ndarray, "6"]:
    """What a missing wrench costs, over a missing force: as in the whole-body controller.

    That weighs accelerations, so moments count by the mass over the moments of inertia, and by the
    weight of the attitude: where the ground cannot give both, the trunk stays level and lags.
    """
    config, inertia = WbcConfig(), _inertia(motion, model)
    turning = np.sqrt(config.orientation_weight / config.position_weight)
    return np.concatenate([np.ones(3), turning * model.mass / inertia[3:]])


def _inertia(motion: Trajectory, model: RobotModel) -> Float[np.ndarray, "6"]:
    """Mass [kg] and moments of inertia [kg m^2] of the robot as it stands at first."""
    return np.diag(model.snapshot(state_at(motion, 0)).mass_matrix)[:6]


def scale_of_wrench() -> Float[np.ndarray, "6"]:
    """By what forces and moments are multiplied to be compared."""
    return np.repeat([1.0, 1.0 / ARM], 3)


def resisted(forces: Forces, motion: Trajectory, world: World) -> Forces:
    """``forces`` with what the motors need besides for the friction of their joints."""
    friction = joint_friction(motion.v[:, 6:], world)
    return replace(forces, tau=forces.tau + np.where(motion.is_dynamic[:, None], 0.0, friction))


def joint_friction(v: Float[np.ndarray, "n 12"], world: World) -> Float[np.ndarray, "n 12"]:
    """What the friction of the joints takes [N m] at the speeds ``v`` [rad/s]."""
    return world.joint_friction * (DRY * np.tanh(v / CREEP) + VISCOUS * v)


def torque(
    motion: Trajectory, forces: Forces, model: RobotModel, limits: FeasibilityLimits
) -> tuple[Series, Series]:
    """Torques against the motors' peak, and against what ``model.motor`` gives at that speed.

    Only a driving motor, tau v > 0, meets the line of torque and speed; rounding moves none. A plan
    that begins at speed is followed late: what its first ``SPREAD`` samples need is not asked for.
    """
    begun = ((np.arange(len(motion.times)) >= SPREAD) | motion.is_dynamic)[:, None]
    share = np.where(motion.is_dynamic, limits.solved_torque_share, limits.torque_share)
    asked, most = np.abs(forces.tau), share[:, None] * model.torque_limits
    v = motion.v[:, 6:] if forces.v_motors is None else forces.v_motors
    lower, upper = model.motor.limits(v)
    at_speed = np.where(forces.tau < 0.0, -lower, upper)
    drives = forces.tau * v > STILL * asked
    tight = TIGHT_TORQUE * float(model.torque_limits.min())
    what = ("N m", JOINTS, motion.times, asked)
    return (
        Series.against("torque", *what, most, where=begun, tight=tight),
        Series.against("torque at speed", *what, at_speed, where=drives & begun, tight=tight),
    )


def contacts(
    motion: Trajectory, forces: Forces, limits: FeasibilityLimits
) -> tuple[Series, Series]:
    """What the feet cannot give, and the least load of three standing ones."""
    times, normal = motion.times, forces.contact[:, :, 2]
    written = ~motion.is_dynamic[:, None]
    is_needed = written & ~motion.stance.all(axis=1, keepdims=True)  # of four one may be unloaded
    stands = (motion.load_share > LOADED) & is_needed
    wrench = ("contact wrench", "N", ("force", "moment"), times, forces.missing)
    load = ("foot load", "N", FEET, times, normal)
    return (
        Series.against(*wrench, np.array([limits.wrench, limits.wrench * ARM]), where=written),
        Series.against(*load, limits.foot_load, is_floor=True, where=stands, tight=TIGHT_LOAD),
    )


def lagging(
    motion: Trajectory, forces: Forces, model: RobotModel, limits: FeasibilityLimits
) -> Series:
    """How far the trunk is off its plan, since the ground cannot give what it needs: m, rad.

    The controller pulls it back, with the gains that it has, so that the error obeys
    e'' + kd e' + kp e = w / m, with the missing force over the mass and the missing moment over the
    moments of inertia of the robot as it stands at first. A moment without them moves little.
    """
    errors = errors_of(motion, lost(motion, forces, model))
    values = np.column_stack([np.linalg.norm(e, axis=1) for e in (errors[:, :3], errors[:, 3:])])
    bounds, subjects = np.array([limits.lag, limits.lag_angle]), ("trunk", "trunk turning")
    return Series.against("lag", "m, rad", subjects, motion.times, values, bounds)


def errors_of(
    motion: Trajectory,
    pushes: Float[np.ndarray, "n 6"],
    damping: Float[np.ndarray, "6"] | float = 0.0,
) -> Float[np.ndarray, "n 6"]:
    """How far trunk and attitude [m, rad] are off for accelerations that are taken from them.

    Solved parts, in which they are followed otherwise, take none. ``damping`` [1/s] is what damps
    the errors besides the gains.
    """
    config = WbcConfig()
    gains = (config.body_position.arrays, config.body_orientation.arrays)
    kp, kd = (np.concatenate(pair) for pair in zip(*gains, strict=True))
    taken = np.where(motion.is_dynamic[:, None], 0.0, pushes)
    errors, dt = np.zeros(taken.shape), float(np.mean(np.diff(motion.times)))
    lag(taken, kp, kd + damping, dt, errors)
    return errors


def lost(motion: Trajectory, forces: Forces, model: RobotModel) -> Float[np.ndarray, "n 6"]:
    """The acceleration [m/s^2, rad/s^2] that the feet do not give, along world axes."""
    return _left(motion, forces, model) / _inertia(motion, model)


def _left(motion: Trajectory, forces: Forces, model: RobotModel) -> Float[np.ndarray, "n 6"]:
    """Force [N] and moment [N m] about the base that the feet do not give, along world axes."""
    R, p = attitudes(motion.rpy), motion.q[:, :3]
    arms = motion.p_feet - [0.0, 0.0, model.foot_radius] - p[:, None]
    force = turned(R, forces.wrench[:, :3]) - forces.contact.sum(axis=1)
    moment = turned(R, forces.wrench[:, 3:]) - np.cross(arms, forces.contact).sum(axis=1)
    return np.hstack([force, moment])


def support(motion: Trajectory, forces: Forces, limits: FeasibilityLimits) -> tuple[Series, Series]:
    """Distance of the CoM and of the zero-moment point to the edges of the support polygon.

    At rest the CoM must lie above it (McGhee & Frank 1968); in motion the zero-moment point must
    lie in it, or the feet would have to pull (Vukobratovic & Borovac 2004). Negative outside; less
    than three feet have no inside, none at all count as 1 m outside.

    Two feet hold a trunk that passes over the line between them, as a trot does: if they stand for
    a short time only, the zero-moment point must be near that line, and the CoM need not. Over
    three, while a foot is lifted shortly without a shift of the trunk, both may be as far outside.
    """
    values = np.full((len(motion.times), 2), -NO_SUPPORT)
    for rows in _same_support(motion):
        stands = motion.stance[rows[0]]
        feet = motion.p_feet[rows[0], stands, :2]
        for column, points in enumerate((motion.p_com[:, :2], forces.zmp)):
            values[rows, column] = support_margins(feet, points[rows])
    passes, pair = passes_over_few(motion, limits), motion.stance.sum(axis=1) == _FEW[0]
    com = ("support", "m", ("CoM",), motion.times, values[:, :1])
    zmp = ("support of ZMP", "m", ("ZMP",), motion.times, values[:, 1:])
    least = np.where(passes, -limits.off_line, limits.zero_moment)[:, None]
    written, tight = ~motion.is_dynamic, TIGHT_SUPPORT
    where, both = (written & ~(passes & pair))[:, None], written[:, None]
    inside = np.where(passes, -limits.off_line, limits.support)[:, None]
    return (
        Series.against(*com, inside, is_floor=True, where=where, tight=tight),
        Series.against(*zmp, least, is_floor=True, where=both, tight=tight),
    )


def passes_over_few(motion: Trajectory, limits: FeasibilityLimits) -> Bool[np.ndarray, " n"]:
    """Samples in which the same two or three feet stand, for no longer than they may."""
    few = np.isin(motion.stance.sum(axis=1), _FEW)
    changes = (motion.stance[1:] != motion.stance[:-1]).any(axis=1)
    for rows in np.split(np.arange(len(few)), np.flatnonzero(changes) + 1):
        lasts = motion.times[rows[-1]] - motion.times[rows[0]]
        few[rows] &= lasts <= limits.pair_time
    return few


def _same_support(motion: Trajectory) -> list[Int[np.ndarray, " k"]]:
    """Samples in which the same feet, at least one, stand in the same places."""
    places = np.where(motion.stance[:, :, None], motion.p_feet[:, :, :2], np.nan)
    keys = np.nan_to_num(np.round(places.reshape(-1, 8), 6), nan=np.inf)
    _, group = np.unique(keys, axis=0, return_inverse=True)
    ordered = np.argsort(group, kind="stable")
    groups = np.split(ordered, np.flatnonzero(np.diff(group[ordered])) + 1)
    return [rows for rows in groups if motion.stance[rows[0]].any()]


def state_at(motion: Trajectory, row: int) -> RobotState:
    """The state of the robot at a sample, in the frame of the motion."""
    return RobotState(
        time=float(motion.times[row]),
        q=motion.q[row],
        v=motion.v[row],
        tau=np.zeros(12),
        foot_forces=np.zeros(4),
        feet_in_contact=motion.stance[row],
    )
