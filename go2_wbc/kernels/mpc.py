"""The convex MPC of the trunk as a kernel: the forces of the feet over a horizon of nodes.

``planning.mpc`` is the readable form: there the nodes' states are stacked and everything is a
matrix. Turning and moving are double integrators, x'' = B f with one B (6, 3) for each foot of each
node, and the cost is diagonal; so the Hessian's block of foot a at node k and foot b at node l is

    B_a' diag(s_kl) B_b,   s_kl = sum_{j > max(k, l)} Qv dt^2 + Qp dt^4 (j - k - 1/2)(j - l - 1/2)

with one s for each of the six axes, and no matrix of the horizon is ever built.
"""

from __future__ import annotations

import numpy as np

from go2_wbc.algebra.active_set import SINGULAR, constrain, factorise, solve_factorised
from go2_wbc.algebra.linear import solve_linear
from go2_wbc.kernels.compilation import kernel, subroutine
from go2_wbc.kernels.layout import MPC, MPC_NODES

_C = MPC.start
_STEP, _MASS, _GRAVITY, _FORCE = (_C[n] for n in ("step", "mass", "gravity", "force_weight"))
_POSE, _RATE = _C["pose_weights"], _C["rate_weights"]
_FRICTION, _MOST, _LEAST_SHARE = (_C[n] for n in ("friction", "force_max", "least_share"))


@subroutine("void(f8[::1], f8[:,:,::1])")
def couplings(c, s):
    """Fill s_kl (N, N, 6) of the six axes: of the turn first, then of the way."""
    dt = c[_STEP]
    for axis in range(6):
        for k in range(MPC_NODES):
            for m in range(k + 1):
                value = 0.0
                for j in range(k + 1, MPC_NODES + 1):
                    value += c[_RATE + axis] * dt**2
                    value += c[_POSE + axis] * dt**4 * (j - k - 0.5) * (j - m - 0.5)
                s[k, m, axis] = s[m, k, axis] = value


@subroutine("void(f8[::1], f8[::1], f8[:,::1], f8[:,::1])")
def pulls(c, state, goals, pull):
    """Fill the cost's slope (N, 6) by an acceleration at each node, when no foot presses.

    ``state`` (12,) holds pose and rate now, ``goals`` (N, 12) those wanted at the end of each node.
    """
    dt = c[_STEP]
    pull[:] = 0.0
    for j in range(1, MPC_NODES + 1):
        t = j * dt
        for axis in range(6):
            fall = -c[_GRAVITY] if axis == 5 else 0.0
            rate = state[6 + axis] + fall * t
            pose = state[axis] + state[6 + axis] * t + fall * t * t / 2
            off = c[_POSE + axis] * (pose - goals[j - 1, axis])
            fast = c[_RATE + axis] * (rate - goals[j - 1, 6 + axis])
            for k in range(j):
                pull[k, axis] += off * dt**2 * (j - k - 0.5) + fast * dt


@subroutine("i8(f8[::1], f8[:,::1], i8[:,::1])")
def count_unknowns(c, share, feet):
    """List node and leg (count, 2) of every foot that presses; returns how many."""
    count = 0
    for k in range(MPC_NODES):
        for leg in range(4):
            if share[k, leg] >= c[_LEAST_SHARE]:
                feet[count, 0], feet[count, 1] = k, leg
                count += 1
    return count


@subroutine("void(f8[:,::1], f8[:,:,::1], i8[:,::1], f8[:,:,::1])")
def turning(inverse, arms, feet, T):
    """Fill T (count, 3, 3) = I^-1 [r x] of every foot that presses."""
    for n in range(len(feet)):
        r = arms[feet[n, 0], feet[n, 1]]
        for i in range(3):
            x, y, z = inverse[i, 0], inverse[i, 1], inverse[i, 2]
            T[n, i, 0] = y * r[2] - z * r[1]
            T[n, i, 1] = z * r[0] - x * r[2]
            T[n, i, 2] = x * r[1] - y * r[0]


@subroutine("void(f8[::1], f8[:,:,::1], f8[:,::1], f8[:,::1], i8[:,::1], f8[:,::1], f8[::1])")
def assemble(c, T, pull, share, feet, H, g):
    """Fill the lower triangle of H, and g."""
    s, mass = np.empty((MPC_NODES, MPC_NODES, 6)), c[_MASS]
    couplings(c, s)
    stood = 0.0
    for k in range(MPC_NODES):
        for leg in range(4):
            stood += share[k, leg]
    usual = mass * c[_GRAVITY] * MPC_NODES / max(stood, 1.0)
    for a in range(len(feet)):
        k, leg = feet[a]
        for i in range(3):
            value = pull[k, 3 + i] / mass
            for axis in range(3):
                value += T[a, axis, i] * pull[k, axis]
            g[3 * a + i] = value
        g[3 * a + 2] -= c[_FORCE] * usual * share[k, leg]
        for b in range(a + 1):
            w = s[k, feet[b, 0]]
            for i in range(3):
                x, y, z = T[a, 0, i] * w[0], T[a, 1, i] * w[1], T[a, 2, i] * w[2]
                for m in range(3):
                    H[3 * a + i, 3 * b + m] = x * T[b, 0, m] + y * T[b, 1, m] + z * T[b, 2, m]
                H[3 * a + i, 3 * b + i] += w[3 + i] / mass**2
        for i in range(3):
            H[3 * a + i, 3 * a + i] += c[_FORCE]


@subroutine("void(f8[::1], f8[:,::1], i8[:,::1], f8[:,::1], f8[::1], f8[::1])")
def bound(c, share, feet, C, lower, upper):
    """Rows of the friction pyramid and of the normal force: five for every foot that presses."""
    for a in range(len(feet)):
        for n in range(5):
            row = 5 * a + n
            C[row] = 0.0
            lower[row], upper[row] = -np.inf, 0.0
            C[row, 3 * a + 2] = -c[_FRICTION]
            if n < 4:
                C[row, 3 * a + n // 2] = 1.0 - 2.0 * (n % 2)
        C[5 * a + 4, 3 * a + 2] = 1.0
        lower[5 * a + 4] = 0.0
        upper[5 * a + 4] = c[_MOST] * share[feet[a, 0], feet[a, 1]]


@kernel("i8(f8[::1], f8[::1], f8[:,::1], f8[:,::1], f8[:,:,::1], f8[:,::1], f8[:,:,::1])")
def solve_mpc(c, state, goals, share, arms, inertia, forces):
    """Fill the mean forces (N, 4, 3) [N] of the feet over each node; returns the outcome.

    ``c`` are the numbers (``layout.MPC``), ``state`` (12,) pose and rate, ``goals`` (N, 12) the
    same at the end of each node, ``share`` (N, 4) of each node that a foot presses, ``arms``
    (N, 4, 3) from the CoM to the feet, ``inertia`` (3, 3) about the CoM in the world.
    """
    system, places = np.zeros((3, 6)), np.empty((4 * MPC_NODES, 2), dtype=np.int64)
    forces[:] = 0.0
    for i in range(3):
        system[i, :3] = inertia[i]
        system[i, 3 + i] = 1.0
    if not solve_linear(system, 3):
        return SINGULAR
    inverse = system[:, 3:].copy()
    feet = places[: count_unknowns(c, share, places)]
    n, rows = 3 * len(feet), 5 * len(feet)
    T, pull = np.empty((len(feet), 3, 3)), np.empty((MPC_NODES, 6))
    H, g, L, x = np.empty((n, n)), np.empty(n), np.empty((n, n)), np.empty(n)
    turning(inverse, arms, feet, T)
    pulls(c, state, goals, pull)
    assemble(c, T, pull, share, feet, H, g)
    if not factorise(H, L):
        return SINGULAR
    solve_factorised(L, g, x)
    C, lower, upper = np.empty((rows, n)), np.empty(rows), np.empty(rows)
    bound(c, share, feet, C, lower, upper)
    outcome = constrain(L, np.empty((0, n)), np.empty(0), C, lower, upper, x, np.empty(rows))
    for a in range(len(feet)):
        for i in range(3):
            forces[feet[a, 0], feet[a, 1], i] = x[3 * a + i]
    return outcome
