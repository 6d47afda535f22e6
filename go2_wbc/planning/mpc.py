"""Convex model predictive control of the trunk: the forces of the feet over the next strides.

The robot is one rigid body (Di Carlo et al., Dynamic Locomotion in the MIT Cheetah 3 Through
Convex Model-Predictive Control, IROS 2018). With the turn phi, the CoM p, both in the world,

    p'' = sum f / m - g,    phi'' = I^-1 sum r x f    (without w x I w)

is linear in the forces f once the places of the feet are planned. Over ``NODES`` nodes the forces
are constant, and

    minimise    sum_j |x_j - x_j,ref|^2_Q / 2 + rho |f - f_0|^2 / 2
    subject to  |f_x|, |f_y| <= mu f_z,   0 <= f_z <= share f_max

where ``share`` is the part of a node that a foot stands. A force is the mean over its node, so f_0
is the share of the weight that a foot bears in the mean over the horizon.

Turning and moving are double integrators, x'' = B f with one B (6, 3) for each foot of each node,
and the cost is diagonal; so the Hessian's block of foot a at node k and foot b at node l is

    B_a' diag(s_kl) B_b,   s_kl = sum_{j > max(k, l)} Qv dt^2 + Qp dt^4 (j - k - 1/2)(j - l - 1/2)

with one s for each of the six axes, and no matrix of the horizon is ever built.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float, Int

from go2_wbc.algebra.active_set import SINGULAR, constrain
from go2_wbc.algebra.linear import factorise, solve_factorised, solve_linear
from go2_wbc.arguments import typed
from go2_wbc.brief import brief
from go2_wbc.compilation import subroutine
from go2_wbc.records import Record
from go2_wbc.validation import NOT_NEGATIVE, POSITIVE, SHARE, Retired, ranged, retires

NODES = 12  #: Nodes of the horizon
STEP = 0.03  #: Length [s] of a node
INTERVAL = 0.01  #: Time [s] from one solution to the next


@typed()
@dataclass(frozen=True, slots=True)
@retires(
    enabled=Retired(True, "the forces of every gait are planned ahead"),
    step=STEP,
    interval=INTERVAL,
)
@ranged(
    POSITIVE,
    angle_weights=NOT_NEGATIVE,
    position_weights=NOT_NEGATIVE,
    angular_weights=NOT_NEGATIVE,
    linear_weights=NOT_NEGATIVE,
    least_share=SHARE,
)
class MpcConfig:
    """Numbers of the MPC, from a search on this robot in simulation.

    Attributes:
        angle_weights, position_weights: of the rotation [1/rad^2] and the CoM's position [1/m^2].
        angular_weights, linear_weights: of their rates [s^2/rad^2], [s^2/m^2].
        force_weight: of a force [1/N^2]; above 0, or the forces are not unique.
        friction: mu of the friction pyramid.
        force_max: greatest normal force [N] of a stance foot.
        least_share: part of a node below which a foot counts as in the air.
        prior_weight: weight with which the whole-body QP tracks the planned forces.
        load_ramp: time [s] over which a foot takes up its force after touchdown and gives it up
            before lift-off.
        throw_time: time constant [s] with which a robot that a push has made too fast is assumed to
            slow down.
        throw_speed: excess speed [m/s] of such a robot, beyond ``LocomotionConfig.stride_margin``,
            at which the weight of the trunk's attitude in the whole-body QP is halved. With the
            full weight and the feet far from below the CoM, the legs in the air are swung to turn
            the trunk: feet that should have landed were 0.16 m high, and the robot fell onto them.
    """

    angle_weights: tuple[float, float, float] = (20.0, 20.0, 20.0)
    position_weights: tuple[float, float, float] = (5.0, 5.0, 80.0)
    angular_weights: tuple[float, float, float] = (0.3, 0.3, 0.5)
    linear_weights: tuple[float, float, float] = (3.0, 3.0, 2.0)
    force_weight: float = 2e-5
    friction: float = 0.6
    force_max: float = 250.0
    least_share: float = 0.02
    prior_weight: float = 3e-3
    load_ramp: float = 0.01
    throw_time: float = 0.4
    throw_speed: float = 0.05

    __repr__ = brief


class Horizon(Record):
    """What the MPC looks at, and the forces that it finds; the first axis of all is the node.

    Pose is the turn [rad] and the CoM [m], rate are w [rad/s] and v [m/s], both in this order.
    """

    mass: float  #: of the rigid body [kg]
    gravity: float  #: [m/s^2]
    inertia: Float[np.ndarray, "3 3"]  #: about its CoM, world axes [kg m^2]
    friction: float  #: mu of the friction pyramid
    state: Float[np.ndarray, "12"]  #: pose and rate now
    goals: Float[np.ndarray, "12 12"]  #: pose and rate wanted at the end of each node
    share: Float[np.ndarray, "12 4"]  #: of each node that each foot stands
    landings: Float[np.ndarray, "12 4"]
    """In how many strides each foot will have landed; at most 0 while it stands as now."""
    arms: Float[np.ndarray, "12 4 3"]  #: from the CoM to the feet's contact points [m]
    forces: Float[np.ndarray, "12 4 3"]  #: mean forces [N] of the feet over each node


@subroutine
def weights_of(c: MpcConfig, axis: int) -> tuple[float, float]:
    """Of an axis, those of the turn before those of the way: its pose's weight and its rate's."""
    if axis < 3:
        return c.angle_weights[axis], c.angular_weights[axis]
    return c.position_weights[axis - 3], c.linear_weights[axis - 3]


@subroutine
def couplings(c: MpcConfig, s: Float[np.ndarray, "nodes nodes 6"]) -> None:
    """Fill s_kl of the six axes: of the turn first, then of the way."""
    dt = STEP
    for axis in range(6):
        of_pose, of_rate = weights_of(c, axis)
        for k in range(NODES):
            for m in range(k + 1):
                value = 0.0
                for j in range(k + 1, NODES + 1):
                    value += of_rate * dt**2
                    value += of_pose * dt**4 * (j - k - 0.5) * (j - m - 0.5)
                s[k, m, axis] = s[m, k, axis] = value


@subroutine
def pulls(c: MpcConfig, h: Horizon, pull: Float[np.ndarray, "nodes 6"]) -> None:
    """Fill the cost's slope by an acceleration at each node, when no foot presses."""
    dt, state, goals = STEP, h.state, h.goals
    pull[:] = 0.0
    for j in range(1, NODES + 1):
        t = j * dt
        for axis in range(6):
            of_pose, of_rate = weights_of(c, axis)
            fall = -h.gravity if axis == 5 else 0.0
            rate = state[6 + axis] + fall * t
            pose = state[axis] + state[6 + axis] * t + fall * t * t / 2
            off = of_pose * (pose - goals[j - 1, axis])
            fast = of_rate * (rate - goals[j - 1, 6 + axis])
            for k in range(j):
                pull[k, axis] += off * dt**2 * (j - k - 0.5) + fast * dt


@subroutine
def count_unknowns(
    least_share: float, share: Float[np.ndarray, "nodes 4"], feet: Int[np.ndarray, "count 2"]
) -> int:
    """List node and leg of every foot that presses; returns how many."""
    count = 0
    for k in range(NODES):
        for leg in range(4):
            if share[k, leg] >= least_share:
                feet[count, 0], feet[count, 1] = k, leg
                count += 1
    return count


@subroutine
def turning(
    inverse: Float[np.ndarray, "3 3"],
    arms: Float[np.ndarray, "nodes 4 3"],
    feet: Int[np.ndarray, "count 2"],
    T: Float[np.ndarray, "count 3 3"],
) -> None:
    """Fill T = I^-1 [r x] of every foot that presses."""
    for n in range(len(feet)):
        r = arms[feet[n, 0], feet[n, 1]]
        for i in range(3):
            x, y, z = inverse[i, 0], inverse[i, 1], inverse[i, 2]
            T[n, i, 0] = y * r[2] - z * r[1]
            T[n, i, 1] = z * r[0] - x * r[2]
            T[n, i, 2] = x * r[1] - y * r[0]


@subroutine
def assemble(
    c: MpcConfig,
    h: Horizon,
    T: Float[np.ndarray, "count 3 3"],
    pull: Float[np.ndarray, "nodes 6"],
    feet: Int[np.ndarray, "count 2"],
    H: Float[np.ndarray, "n n"],
    g: Float[np.ndarray, " n"],
) -> None:
    """Fill the lower triangle of H, and g."""
    s, mass, share = np.empty((NODES, NODES, 6)), h.mass, h.share
    couplings(c, s)
    stood = 0.0
    for k in range(NODES):
        for leg in range(4):
            stood += share[k, leg]
    usual = mass * h.gravity * NODES / max(stood, 1.0)
    for a in range(len(feet)):
        k, leg = feet[a, 0], feet[a, 1]
        for i in range(3):
            value = pull[k, 3 + i] / mass
            for axis in range(3):
                value += T[a, axis, i] * pull[k, axis]
            g[3 * a + i] = value
        g[3 * a + 2] -= c.force_weight * usual * share[k, leg]
        for b in range(a + 1):
            w = s[k, feet[b, 0]]
            for i in range(3):
                x, y, z = T[a, 0, i] * w[0], T[a, 1, i] * w[1], T[a, 2, i] * w[2]
                for m in range(3):
                    H[3 * a + i, 3 * b + m] = x * T[b, 0, m] + y * T[b, 1, m] + z * T[b, 2, m]
                H[3 * a + i, 3 * b + i] += w[3 + i] / mass**2
        for i in range(3):
            H[3 * a + i, 3 * a + i] += c.force_weight


@subroutine
def bound(
    force_max: float,
    h: Horizon,
    feet: Int[np.ndarray, "count 2"],
    C: Float[np.ndarray, "m n"],
    lower: Float[np.ndarray, " m"],
    upper: Float[np.ndarray, " m"],
) -> None:
    """Rows of the friction pyramid and of the normal force: five for every foot that presses."""
    for a in range(len(feet)):
        for n in range(5):
            row = 5 * a + n
            C[row] = 0.0
            lower[row], upper[row] = -np.inf, 0.0
            C[row, 3 * a + 2] = -h.friction
            if n < 4:
                C[row, 3 * a + n // 2] = 1.0 - 2.0 * (n % 2)
        C[5 * a + 4, 3 * a + 2] = 1.0
        lower[5 * a + 4] = 0.0
        upper[5 * a + 4] = force_max * h.share[feet[a, 0], feet[a, 1]]


@subroutine
def solve_mpc(c: MpcConfig, h: Horizon) -> int:
    """Fill the forces of the horizon; returns the outcome."""
    system, places = np.zeros((3, 6)), np.empty((4 * NODES, 2), dtype=np.int64)
    h.forces[:] = 0.0
    for i in range(3):
        system[i, :3] = h.inertia[i]
        system[i, 3 + i] = 1.0
    if not solve_linear(system, 3):
        return SINGULAR
    inverse = system[:, 3:].copy()
    feet = places[: count_unknowns(c.least_share, h.share, places)]
    n, rows = 3 * len(feet), 5 * len(feet)
    T, pull = np.empty((len(feet), 3, 3)), np.empty((NODES, 6))
    H, g, L, x = np.empty((n, n)), np.empty(n), np.empty((n, n)), np.empty(n)
    turning(inverse, h.arms, feet, T)
    pulls(c, h, pull)
    assemble(c, h, T, pull, feet, H, g)
    if not factorise(H, L):
        return SINGULAR
    solve_factorised(L, g, x)
    C, lower, upper = np.empty((rows, n)), np.empty(rows), np.empty(rows)
    bound(c.force_max, h, feet, C, lower, upper)
    outcome = constrain(L, np.empty((0, n)), np.empty(0), C, lower, upper, x, np.empty(0))
    for a in range(len(feet)):
        for i in range(3):
            h.forces[feet[a, 0], feet[a, 1], i] = x[3 * a + i]
    return outcome
