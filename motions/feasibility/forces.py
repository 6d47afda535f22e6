"""Checks of forces: can the feet carry the motion, do they slide, and can the motors do it?

The equations of motion, M a + h = S' tau + J' f (Wieber, Tedrake & Kuindersma 2016), split into six
rows of the base, in which no motor acts, and twelve of the joints:

    w = M_b a + h_b = J_b' f               the wrench that the motion needs (Newton-Euler)
    tau = M_j a + h_j - J_j' f             the torques of the motors

M and h are Pinocchio's, with rotor inertia, v and a as in ``Trajectory`` (the base's in its own
frame, so w too), f the forces of the ground on the rolling contact points in the frame of the
motion. Of all f within the friction pyramid that give this wrench, the one is taken that deviates
least from equal vertical and zero tangential forces, with a larger weight on the tangential force
of a foot with less load, as in the whole-body controller; see ``wbc.trajectory_loads``.

Contact forces need time to build up: 20 ms in MuJoCo (its ``solref``), similar to rubber and a
leg's gears. M a + h is therefore averaged over ``SPREAD`` samples before the forces are computed.
Where a plan jumps from one sample to the next, the force of one sample is cancelled by the next.

Friction is a cone, |f_t| <= mu f_z, here a pyramid of ``FACETS`` facets inside of it (2 % less).
Two questions are answered:

- With which minimum coefficient can the feet give the wrench, for any distribution of the load?
  With less, no controller can track the plan.
- How far do the feet slide with the whole-body controller's distribution of the load? It asks each
  foot for nearly the same tangential force, so one with little load may slide though the others
  could hold; and a short slip moves little. Each foot is a sliding block (Newmark 1965, *Effects of
  earthquakes on dams and embankments*): the force in excess of friction accelerates it, and
  friction stops it. The mass of the block, and the force by which the joints hold it, were fitted
  to motions in MuJoCo (``FOOT_MASS``, ``HELD``).

Where a leg turns fast, a foot also creeps, on any friction. A contact constraint of MuJoCo asks for
J a = -b J v (Todorov, *Convex and analytically-invertible dynamics with contacts and constraints*,
ICRA 2014) and leaves out the derivative of J. The missing term moves the foot at the speed dJ/dt v
/ b, and as the plan's feet rest, dJ/dt v = -J a. Fast rocking makes 13 mm of it.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Bool, Float

from go2_wbc.brief import brief
from go2_wbc.feasibility_limits import FeasibilityLimits
from go2_wbc.geometry import support_margins
from go2_wbc.legs import JOINT_NAMES, LEGS
from go2_wbc.records import packed
from go2_wbc.robot.leg_kinematics import leg_table
from go2_wbc.robot.model import RobotModel
from go2_wbc.robot.state import RobotState
from go2_wbc.wbc.config import WbcConfig
from go2_wbc.wbc.constraints import friction_pyramid
from go2_wbc.wbc.trajectory_loads import (
    LoadNumbers,
    accelerate,
    lag,
    least_friction,
    share_loads,
    slide,
)
from go2_wbc.world import World
from motions.batch_kinematics import attitudes, foot_centres, turned, zero_moment_points
from motions.feasibility.report import Series
from motions.memory import Memory, Rows, by_rows
from motions.plan.trajectory import Trajectory
from motions.postures import NORMAL_FORCE_MAX

JOINTS = tuple(name.removesuffix("_joint") for name in JOINT_NAMES)
FEET = tuple(leg.name for leg in LEGS)


@dataclass(frozen=True, slots=True)
class Forces:
    """What the ground and the motors must give."""

    contact: Float[np.ndarray, "n 4 3"]
    """(n, 4, 3) forces on the feet in the frame of the motion [N]."""
    tau: Float[np.ndarray, "n 12"]  #: (n, 12) joint torques [N m]
    missing: Float[np.ndarray, "n 2"]
    """(n, 2) part of the force [N] and of the moment [N m] that the feet cannot give."""
    zmp: Float[np.ndarray, "n 2"]  #: (n, 2) zero-moment point on the ground [m]
    wrench: Float[np.ndarray, "n 6"]  #: (n, 6) what the trunk needs, in its frame [N, N m]
    v_motors: Float[np.ndarray, "n 12"] | None = None
    """(n, 12) joint speeds [rad/s] at which the torques are given; those of the path unless
    said."""

    __repr__ = brief


@dataclass(frozen=True, slots=True)
class Case:
    """A movement that is judged."""

    path: Trajectory  #: the movement
    forces: Forces  #: what it takes
    places: Float[np.ndarray, "n 4 3"]  #: (n, 4, 3) where the feet's centres are [m]; ``places_of``
    model: RobotModel  #: the robot that it was planned for
    heavy: RobotModel  #: the robot that does it, with the load of the world
    world: World = World()  #: with the worst of what is uncertain
    limits: FeasibilityLimits = FeasibilityLimits()  #: what must be kept
    memory: Memory | None = None  #: of movements that are like it

    def series(
        self,
        check: str,
        unit: str,
        subjects: tuple[str, ...],
        values: Float[np.ndarray, "n k"],
        limits: Float[np.ndarray, "*some"] | float,
        *,
        is_floor: bool = False,
        where: Bool[np.ndarray, "#n #k"] | bool = True,
        tight: float = 0.0,
        times: Float[np.ndarray, " n"] | None = None,
    ) -> Series:
        """Of values that may not exceed ``limits``, or fall below them; checked only ``where``.

        They are those at ``times`` [s], by default at every sample of the path.
        """
        bounds = np.broadcast_to(limits, values.shape)
        margins = np.where(where, values - bounds if is_floor else bounds - values, np.nan)
        when = self.path.times if times is None else times
        return Series(check, unit, subjects, when, values, bounds, margins, tight)


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
LOADED = 0.999  #: Share of its load from which on a foot counts as standing fully: 1, less rounding
PRESSED = 10.0
"""Normal force [N] from which on the friction of a foot matters; below, the quotient is noise and
a slip moves nothing (own choice, 6 % of the weight)."""
STILL = 1e-3
"""Joint speed [rad/s] below which a motor drives nothing. A spline rings for some samples before a
joint moves, and up to 1e-5 rad/s of that differ with how a motion was put together."""
NO_SUPPORT = 1.0
"""How far outside [m] of their support CoM and zero-moment point count when no foot stands."""
FAR = 1e3  #: Where feet in the air count as being [m], of those that tell supports apart
_FEW = (2, 3)
TRUNK = ("trunk", "trunk turning")
TIGHT_TORQUE, TIGHT_LOAD, TIGHT_FRICTION = 0.1, 10.0, 0.05
"""Margins below which a warning is due: share of the smallest torque limit, N and 1; own choice,
about what separates a plan from its run in simulation."""
TIGHT_SUPPORT, TIGHT_SLIP = 0.01, 0.003  #: The same [m]
FACETS = 16  #: Of the cone
NEAR_LIMIT = 0.8
"""Share of the limit up to which the controller's own share of the load is looked at, no better."""
MOST_FRICTION = 1.5
"""Friction coefficient above which none is looked for: rubber on dry concrete has 1."""
FOOT_MASS, HELD = 1.0, 0.5
"""Mass [kg] of the block that a sliding foot is, and the force [N] along the ground by which the
dry friction of its joints holds it, 0.2 N m on an arm of 0.3 m or so: with them 10 mm of slip in
1,400 generated motions (seeds that judge nothing) are told best. A leg weighs 2.2 kg."""
CONTACT_RATE = 145.0
"""Rate b [1/s] at which a contact of MuJoCo stops a foot: 105 by its numbers (2 / 0.95 / 0.02 s);
more, as trunks lag their plan. Own choice, seen on motions that judge nothing."""
SETTLED = 0.1
"""Time [s] after a touchdown, and before a lift-off, in which a foot without load may skid."""
NEARBY = np.array([-2.0, 2.0]) * SETTLED  #: Times that hold all of these


def places_of(motion: Trajectory, model: RobotModel) -> Float[np.ndarray, "n 4 3"]:
    """Where the feet's centres are [m], in the frame of the motion."""
    q = motion.q
    return foot_centres(q[:, :3], attitudes(motion.rpy), q[:, 7:], model)


def forces_of(
    motion: Trajectory,
    model: RobotModel,
    memory: Memory | None = None,
    inertia: Float[np.ndarray, "6"] | None = None,
) -> Forces:
    """Contact forces and torques along ``motion``.

    Args:
        motion, model: what moves.
        memory: of motions that are like it.
        inertia: see ``inertia_of``; of a part of a motion, that of the whole.
    """

    def dynamics(rows: Rows) -> Float[np.ndarray, "k 18"]:
        states = zip(motion.q[rows], motion.v[rows], motion.a[rows], strict=True)
        return np.array([model.inverse_dynamics(*state) for state in states])

    given = np.hstack([motion.q[:, 3:], motion.v, motion.a])  # it is the same everywhere
    needed = _spread(by_rows(memory, "dynamics", given, dynamics), motion)
    scale = weights_of(inertia_of(motion, model) if inertia is None else inertia, model)
    R = attitudes(motion.rpy)
    tables = (leg_table(model), friction_pyramid(PYRAMID), scale, numbers_of(model))

    def loads(rows: Rows) -> Float[np.ndarray, "k 26"]:
        contact, missing = np.zeros((len(rows), 4, 3)), np.empty((len(rows), 2))
        joints, load_share, tau = motion.q[rows, 7:], motion.load_share[rows], needed[rows, 6:]
        own = (joints, R[rows], needed[rows, :6], load_share)
        share_loads(*own, *tables, contact, tau, missing)
        return np.hstack([contact.reshape(-1, 12), tau, missing])

    given = np.hstack([motion.q[:, 7:], motion.rpy, needed, motion.load_share])
    shared = by_rows(memory, ("loads", *np.round(scale, 9)), given, loads)
    contact, wrench = shared[:, :12].reshape(-1, 4, 3), needed[:, :6].copy()
    zmp = zero_moment_points(motion.q, motion.rpy, wrench)
    return Forces(contact, shared[:, 12:24], shared[:, 24:], zmp, wrench)


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


def weights_of(inertia: Float[np.ndarray, "6"], model: RobotModel) -> Float[np.ndarray, "6"]:
    """What a missing wrench costs, over a missing force: as in the whole-body controller.

    That weighs accelerations, so moments count by the mass over the moments of inertia, and by the
    weight of the attitude: where the ground cannot give both, the trunk stays level and lags.
    """
    config = WbcConfig()
    turning = np.sqrt(config.orientation_weight / config.position_weight)
    return np.concatenate([np.ones(3), turning * model.mass / inertia[3:]])


def inertia_of(motion: Trajectory, model: RobotModel) -> Float[np.ndarray, "6"]:
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


def torque(case: Case) -> tuple[Series, Series]:
    """Torques against the motors' peak, and against what ``model.motor`` gives at that speed.

    Only a driving motor, tau v > 0, meets the line of torque and speed; rounding moves none. A plan
    that begins at speed is followed late: what its first ``SPREAD`` samples need is not asked for.
    """
    motion, forces, model, limits = case.path, case.forces, case.model, case.limits
    begun = ((np.arange(len(motion.times)) >= SPREAD) | motion.is_dynamic)[:, None]
    share = np.where(motion.is_dynamic, limits.solved_torque_share, limits.torque_share)
    asked, most = np.abs(forces.tau), share[:, None] * model.torque_limits
    v = motion.v[:, 6:] if forces.v_motors is None else forces.v_motors
    lower, upper = model.motor.limits(v)
    at_speed = np.where(forces.tau < 0.0, -lower, upper)
    drives = forces.tau * v > STILL * asked
    tight = TIGHT_TORQUE * float(model.torque_limits.min())
    what = ("N m", JOINTS, asked)
    return (
        case.series("torque", *what, most, where=begun, tight=tight),
        case.series("torque at speed", *what, at_speed, where=drives & begun, tight=tight),
    )


def contacts(case: Case) -> tuple[Series, Series]:
    """What the feet cannot give, and the least load of three standing ones."""
    motion, forces, limits = case.path, case.forces, case.limits
    written = ~motion.is_dynamic[:, None]
    is_needed = written & ~motion.stance.all(axis=1, keepdims=True)  # of four one may be unloaded
    stands = (motion.load_share > LOADED) & is_needed
    wrench = ("contact wrench", "N", ("force", "moment"), forces.missing)
    load = ("foot load", "N", FEET, forces.contact[:, :, 2], limits.foot_load)
    return (
        case.series(*wrench, np.array([limits.wrench, limits.wrench * ARM]), where=written),
        case.series(*load, is_floor=True, where=stands, tight=TIGHT_LOAD),
    )


def lagging(case: Case, pushes: Float[np.ndarray, "n 6"]) -> Series:
    """How far the trunk is off its plan, since the ground cannot give what it needs: m, rad.

    The controller pulls it back, with the gains that it has, so that the error obeys
    e'' + kd e' + kp e = w / m, with the missing force over the mass and the missing moment over the
    moments of inertia of the robot as it stands at first. A moment without them moves little.
    ``pushes``: what is ``lost``.
    """
    most = np.array([case.limits.lag, case.limits.lag_angle])
    return case.series("lag", "m, rad", TRUNK, errors_of(case.path, pushes), most)


def errors_of(
    motion: Trajectory,
    pushes: Float[np.ndarray, "n 6"],
    damping: Float[np.ndarray, "6"] | float = 0.0,
) -> Float[np.ndarray, "n 2"]:
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
    return np.sqrt(np.einsum("nij,nij->ni", *2 * [errors.reshape(-1, 2, 3)]))


def lost(case: Case, inertia: Float[np.ndarray, "6"]) -> Float[np.ndarray, "n 6"]:
    """The acceleration [m/s^2, rad/s^2] that the feet do not give, along world axes.

    ``inertia``: of the motion, see ``inertia_of``.
    """
    motion, forces = case.path, case.forces
    R, p = attitudes(motion.rpy), motion.q[:, :3]
    arms = motion.p_feet - [0.0, 0.0, case.heavy.foot_radius] - p[:, None]
    force = turned(R, forces.wrench[:, :3]) - np.einsum("nij->nj", forces.contact)
    moments = np.einsum("nij->nj", np.cross(arms, forces.contact))
    moment = turned(R, forces.wrench[:, 3:]) - moments
    return np.hstack([force, moment]) / inertia


def support(case: Case) -> tuple[Series, Series]:
    """Distance of the CoM and of the zero-moment point to the edges of the support polygon.

    At rest the CoM must lie above it (McGhee & Frank 1968); in motion the zero-moment point must
    lie in it, or the feet would have to pull (Vukobratovic & Borovac 2004). Negative outside; less
    than three feet have no inside, none at all count as 1 m outside.

    Two feet hold a trunk that passes over the line between them, as a trot does: if they stand for
    a short time only, the zero-moment point must be near that line, and the CoM need not. Over
    three, while a foot is lifted shortly without a shift of the trunk, both may be as far outside.
    """
    motion, limits = case.path, case.limits
    places = np.where(motion.stance[:, :, None], motion.p_feet[:, :, :2], FAR).reshape(-1, 8)
    both = np.hstack([motion.p_com[:, :2], case.forces.zmp])

    def work(rows: Rows) -> Float[np.ndarray, "k 2"]:
        found = np.full((len(rows), 2), -NO_SUPPORT)
        keys = np.round(places[rows], 6)
        changes = np.flatnonzero((keys[1:] != keys[:-1]).any(axis=1)) + 1
        for own in np.split(np.arange(len(keys)), changes):  # where the same feet stand
            stands = motion.stance[rows[own[0]]]
            feet, asked = motion.p_feet[rows[own[0]], stands, :2], both[rows[own]]
            if stands.any():
                margins = support_margins(feet, asked.reshape(-1, 2))
                found[own] = margins.reshape(-1, 2)
        return found

    values = by_rows(case.memory, "support", np.hstack([places, both]), work)
    passes, pair = passes_over_few(motion, limits), motion.stance.sum(axis=1) == _FEW[0]
    written, tight = ~motion.is_dynamic, TIGHT_SUPPORT
    where, both = (written & ~(passes & pair))[:, None], written[:, None]
    inside, least = (
        np.where(passes, -limits.off_line, limit)[:, None]
        for limit in (limits.support, limits.zero_moment)
    )
    com = ("support", "m", ("CoM",), values[:, :1], inside)
    zmp = ("support of ZMP", "m", ("ZMP",), values[:, 1:], least)
    return (
        case.series(*com, is_floor=True, where=where, tight=tight),
        case.series(*zmp, is_floor=True, where=both, tight=tight),
    )


def passes_over_few(motion: Trajectory, limits: FeasibilityLimits) -> Bool[np.ndarray, " n"]:
    """Samples in which the same two or three feet stand, for no longer than they may."""
    few = np.isin(motion.stance.sum(axis=1), _FEW)
    changes = np.flatnonzero((motion.stance[1:] != motion.stance[:-1]).any(axis=1))
    first, last = np.append(0, changes + 1), np.append(changes, len(few) - 1)
    lasts = motion.times[last] - motion.times[first]
    return few & np.repeat(lasts <= limits.pair_time, last - first + 1)


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


def friction(case: Case) -> Series:
    """The least friction coefficient with which the feet can give what the trunk needs.

    Below ``NEAR_LIMIT`` of the floor's the value is that of the controller's share of the load,
    which is no less.
    """
    values, floor = _least_friction(case)[:, None], case.world.friction
    written = (~case.path.is_dynamic & case.path.stance.any(axis=1))[:, None]
    what = ("friction", "", ("feet",), values, floor)
    return case.series(*what, where=written, tight=TIGHT_FRICTION)


def slip(case: Case, creeps: Float[np.ndarray, "n 4 2"], stands: Bool[np.ndarray, "n 4"]) -> Series:
    """How far each foot slides and creeps [m] while it ``stands``; see ``creep``, ``settled``."""
    motion, floor = case.path, case.world.friction
    counts = stands & ~motion.is_dynamic[:, None]
    dt = float(motion.times[-1] - motion.times[0]) / max(len(motion.times) - 1, 1)
    ways = np.zeros(counts.shape)
    held = case.forces.contact + [0.0, 0.0, HELD / floor]  # as a load of that size would
    slide(held, creeps, counts, floor, FOOT_MASS, dt, ways)
    return case.series("slip", "m", FEET, ways, case.limits.slip, where=counts, tight=TIGHT_SLIP)


def creep(motion: Trajectory, model: RobotModel) -> Float[np.ndarray, "n 4 2"]:
    """Speed [m/s] along the ground at which standing feet creep, by the rows of MuJoCo's contacts.

    That is -J a / ``CONTACT_RATE`` of the contact points.
    """
    J_a = np.empty((len(motion.times), 4, 2))
    joints, a = np.array(motion.q[:, 7:], order="C"), np.array(motion.a, order="C")
    accelerate(joints, attitudes(motion.rpy), a, leg_table(model), model.foot_radius, J_a)
    return -J_a / CONTACT_RATE


def cone(facets: int = FACETS) -> Float[np.ndarray, "k 3"]:
    """Rows of a pyramid inside the cone of coefficient 1 (at most 0), and of the normal force."""
    angles = 2.0 * np.pi * np.arange(facets) / facets
    inside = np.full(facets, -np.cos(np.pi / facets))
    sides = np.column_stack([np.cos(angles), np.sin(angles), inside])
    return np.vstack([sides, [0.0, 0.0, 1.0]])


def _least_friction(case: Case) -> Float[np.ndarray, " n"]:
    motion, forces, model = case.path, case.forces, case.heavy
    normal = forces.contact[:, :, 2]
    along = np.linalg.norm(forces.contact[:, :, :2], axis=2)
    values = np.where(normal > PRESSED, along / np.maximum(normal, PRESSED), 0.0).max(axis=1)
    missing = np.hypot(forces.missing[:, 0], forces.missing[:, 1] / ARM)
    highest = np.where(missing <= case.limits.wrench, values, MOST_FRICTION)
    is_far = highest < NEAR_LIMIT * case.world.friction
    highest[is_far | motion.is_dynamic] = 0.0
    R, tables = attitudes(motion.rpy), (leg_table(model), cone(), scale_of_wrench())

    def least(rows: Rows) -> Float[np.ndarray, "k 1"]:
        found, most, limit = values[rows], highest[rows], case.limits.wrench
        own = (motion.q[rows, 7:], R[rows], forces.wrench[rows], motion.load_share[rows])
        least_friction(*own, *tables, numbers_of(model), most, limit, found)
        return found[:, None]

    asked = np.column_stack([values, highest])
    given = [motion.q[:, 7:], motion.rpy, forces.wrench, motion.load_share, asked]
    return by_rows(case.memory, "least friction", np.hstack(given), least)[:, 0]


def settled(motion: Trajectory) -> Bool[np.ndarray, "n 4"]:
    """Where feet stand, and have stood and will stand for ``SETTLED``; the motion's ends count."""
    stands, times = motion.stance.copy(), motion.times
    for edge, leg in np.argwhere(motion.stance[1:] != motion.stance[:-1]):
        near = slice(*np.searchsorted(times, times[edge] + NEARBY).tolist())
        stands[near, leg] &= np.abs(times[near] - times[edge]) >= SETTLED
    return stands
