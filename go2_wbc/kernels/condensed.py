"""The whole-body QP of one tick, assembled, condensed and solved in one kernel.

``wbc.tasks`` and ``wbc.constraints`` say which rows there are, ``wbc.backends`` how the equalities
are eliminated; the equation numbers below are its. Everything is affine in the three unknowns a
leg, u (12,): ``affine`` (30, 13) gives z = affine (u, 1), and a row of a task or a bound becomes a
row of 13 numbers, the last of which goes to its right side.
"""

from __future__ import annotations

import numpy as np

from go2_wbc.kernels.active_set import solve_qp
from go2_wbc.kernels.compilation import kernel
from go2_wbc.kernels.layout import PROGRAM, REFERENCE, SNAPSHOT
from go2_wbc.kernels.validity import are_valid

STANCE, SWING, JOINTS = 0, 1, 2
"""The values of ``reference.LegTask``."""
LARGEST_ERROR = 3.0
"""Orientation error [rad] beyond which this logarithm of a rotation is not accurate."""
UNSUITED = 10
"""Outcome, beside those of ``active_set``: a singular leg or a rotation by pi, which are for the
full QP, or numbers that are not finite."""

_S, _T, _P = SNAPSHOT.start, REFERENCE.start, PROGRAM.start
_R, _M, _H = _S["R_world_base"], _S["mass_matrix"], _S["bias"]
_P_COM, _V_COM, _J_COM, _DRIFT_COM = (
    _S[n] for n in ("p_world_com", "v_world_com", "J_com", "drift_com")
)
_P_FEET, _V_FEET, _J_FEET, _DRIFT_FEET = (
    _S[n] for n in ("p_world_feet", "v_world_feet", "J_feet", "drift_feet")
)
_J_CONTACTS, _DRIFT_CONTACTS, _V_CONTACTS = (
    _S[n] for n in ("J_contacts", "drift_contacts", "v_world_contacts")
)
_IS_COM, _BODY_P, _BODY_V, _BODY_A = (_T[n] for n in ("is_com", "p_world", "v_world", "a_world"))
_BODY_R, _BODY_W, _BODY_DW, _LEGS = (_T[n] for n in ("R_world_base", "w_world", "dw_world", "legs"))
_F_MIN, _F_MAX = _T["normal_force_min"], _T["normal_force_max"]
_FOOT_P, _FOOT_V, _FOOT_A = (_T[n] for n in ("p_world_feet", "v_world_feet", "a_world_feet"))
_JOINT_Q, _JOINT_V, _JOINT_A = (_T[n] for n in ("q_joints", "v_joints", "a_joints"))
_POSITION, _ORIENTATION, _SWING, _POSTURE = (
    _P[n] for n in ("position_kp", "orientation_kp", "swing_kp", "posture_kp")
)
_FORCE_WEIGHT, _WEIGHT_OF_ROBOT = _P["force_weight"], _P["weight_of_robot"]
_DAMPING, _FRICTION, _TORQUE = _P["stance_damping"], _P["friction"], _P["torque_limits"]
_Q_LOWER, _Q_UPPER, _SPEED = _P["q_lower"], _P["q_upper"], _P["speed"]
_BRAKING, _HORIZON, _SINGULAR = _P["braking"], _P["horizon"], _P["singular_determinant"]


@kernel("b1(f8[::1], f8[::1], f8[::1], i8, f8[:,::1])")
def stance_leg(snapshot, target, program, leg, legs_map):
    """(3): fill a_l = legs_map (a_b, 1), rows 3 leg to 3 leg + 2; False if the leg is singular."""
    J = snapshot[_J_CONTACTS + 54 * leg : _J_CONTACTS + 54 * leg + 54].reshape(3, 18)
    c = 6 + 3 * leg
    inverse = np.empty((3, 3))
    for i in range(3):
        for k in range(3):
            a, b = (k + 1) % 3, (k + 2) % 3
            d, e = c + (i + 1) % 3, c + (i + 2) % 3
            inverse[i, k] = J[a, d] * J[b, e] - J[a, e] * J[b, d]
    determinant = (
        J[0, c] * inverse[0, 0] + J[0, c + 1] * inverse[1, 0] + J[0, c + 2] * inverse[2, 0]
    )
    if not abs(determinant) >= program[_SINGULAR]:  # a nan counts as singular
        return False
    for i in range(3):
        for k in range(7):
            value = 0.0
            for n in range(3):
                if k < 6:
                    right = -J[n, k]
                else:
                    right = (
                        -snapshot[_DRIFT_CONTACTS + 3 * leg + n]
                        - program[_DAMPING] * snapshot[_V_CONTACTS + 3 * leg + n]
                    )
                value += inverse[i, n] * right
            legs_map[3 * leg + i, k] = value / determinant
    return True


@kernel("b1(f8[:,::1], i8)")
def solve_linear(A, n):
    """Gauss-Jordan with pivoting: the columns from n on become (A[:, :n])^-1 A[:, n:]."""
    columns = A.shape[1]
    for j in range(n):
        pivot = j
        for i in range(j + 1, n):
            if abs(A[i, j]) > abs(A[pivot, j]):
                pivot = i
        if not abs(A[pivot, j]) > 0.0:
            return False
        for k in range(j, columns):
            A[j, k], A[pivot, k] = A[pivot, k], A[j, k]
        for k in range(columns - 1, j - 1, -1):
            A[j, k] /= A[j, j]
        for i in range(n):
            factor = A[i, j]
            if i == j or factor == 0.0:
                continue
            for k in range(j, columns):
                A[i, k] -= factor * A[j, k]
    return True


@kernel("b1(f8[::1], f8[::1], f8[::1], f8[:,::1])")
def eliminate(snapshot, target, program, affine):
    """(3) and (4): fill z = affine (u, 1), which meets every equality; False if singular."""
    M = snapshot[_M : _M + 324].reshape(18, 18)
    legs_map = np.empty((12, 7))
    base = np.zeros((6, 19))
    affine[:] = 0.0
    for i in range(6):
        base[i, 18] = -snapshot[_H + i]
        for k in range(6):
            base[i, k] = M[i, k]
    for leg in range(4):
        c = 3 * leg
        if target[_LEGS + leg] != STANCE:
            for i in range(3):
                affine[6 + c + i, c + i] = 1.0
            for i in range(6):
                for k in range(3):
                    base[i, 6 + c + k] = -M[i, 6 + c + k]
            continue
        if not stance_leg(snapshot, target, program, leg, legs_map):
            return False
        J = snapshot[_J_CONTACTS + 54 * leg : _J_CONTACTS + 54 * leg + 54].reshape(3, 18)
        for i in range(3):
            affine[18 + c + i, c + i] = 1.0
        for i in range(6):
            for k in range(3):
                base[i, 6 + c + k] = J[k, i]
            for n in range(3):
                share = M[i, 6 + c + n]
                for k in range(6):
                    base[i, k] += share * legs_map[c + n, k]
                base[i, 18] -= share * legs_map[c + n, 6]
    if not solve_linear(base, 6):
        return False
    for i in range(6):
        for k in range(13):
            affine[i, k] = base[i, 6 + k]
    for leg in range(4):
        if target[_LEGS + leg] == STANCE:
            for i in range(3 * leg, 3 * leg + 3):
                for k in range(13):
                    value = legs_map[i, 6] if k == 12 else 0.0
                    for n in range(6):
                        value += legs_map[i, n] * base[n, 6 + k]
                    affine[6 + i, k] = value
    return True


@kernel("void(f8[:,::1], f8[::1], f8[::1], f8, f8)")
def add_goal(H, g, row, b, weight):
    """Add weight |row (u, 1) - b|^2 / 2 to u'Hu/2 + g'u; fills the lower triangle of H only."""
    rest = weight * (row[12] - b)
    for i in range(12):
        if row[i] == 0.0:
            continue
        g[i] += rest * row[i]
        scaled = weight * row[i]
        for k in range(i + 1):
            H[i, k] += scaled * row[k]


@kernel("void(f8[::1], f8[:,::1], i8, f8[::1])")
def times_affine(J, affine, leg, row):
    """row = J affine[:18], for a J (18,) of which only the base's and one leg's columns count."""
    row[:] = 0.0
    for n in range(9):
        k = n if n < 6 else 3 * leg + n
        value = J[k]
        for i in range(13):
            row[i] += value * affine[k, i]


@kernel("b1(f8[::1], f8[::1], f8[::1])")
def orientation_error(snapshot, target, error):
    """Fill log(R' R_des); False if the angle is too near pi."""
    R = snapshot[_R : _R + 9].reshape(3, 3)
    R_des = target[_BODY_R : _BODY_R + 9].reshape(3, 3)
    E = np.empty((3, 3))
    for i in range(3):
        for k in range(3):
            E[i, k] = R[0, i] * R_des[0, k] + R[1, i] * R_des[1, k] + R[2, i] * R_des[2, k]
    error[0] = (E[2, 1] - E[1, 2]) / 2
    error[1] = (E[0, 2] - E[2, 0]) / 2
    error[2] = (E[1, 0] - E[0, 1]) / 2
    sine = np.sqrt(error[0] ** 2 + error[1] ** 2 + error[2] ** 2)
    cosine = (E[0, 0] + E[1, 1] + E[2, 2] - 1) / 2
    angle = np.arctan2(sine, cosine)
    if not angle < LARGEST_ERROR:
        return False
    # x / sin x = 1 + x^2 / 6 + ...
    factor = angle / sine if sine > 1e-6 else 1.0 + angle * angle / 6
    error *= factor
    return True


@kernel("b1(f8[::1], f8[::1], f8[::1], f8[::1], f8[::1], f8[:,::1], f8[:,::1], f8[::1])")
def add_body_goals(q, v, snapshot, target, program, affine, H, g):
    """Rows of ``BodyPosition`` and ``BodyOrientation``."""
    R = snapshot[_R : _R + 9].reshape(3, 3)
    is_com = target[_IS_COM] != 0.0
    row, error, drift = np.empty(13), np.empty(3), np.empty(3)
    drift[0] = v[4] * v[2] - v[5] * v[1]
    drift[1] = v[5] * v[0] - v[3] * v[2]
    drift[2] = v[3] * v[1] - v[4] * v[0]
    weight = program[_POSITION + 6]
    for i in range(3):
        row[:] = 0.0
        if is_com:
            position, velocity = snapshot[_P_COM + i], snapshot[_V_COM + i]
            rest = snapshot[_DRIFT_COM + i]
            for n in range(18):
                value = snapshot[_J_COM + 18 * i + n]
                for k in range(13):
                    row[k] += value * affine[n, k]
        else:
            position = q[i]
            velocity = R[i, 0] * v[0] + R[i, 1] * v[1] + R[i, 2] * v[2]
            rest = R[i, 0] * drift[0] + R[i, 1] * drift[1] + R[i, 2] * drift[2]
            for n in range(3):
                for k in range(13):
                    row[k] += R[i, n] * affine[n, k]
        kp, kd = program[_POSITION + i], program[_POSITION + 3 + i]
        desired = target[_BODY_A + i] + kd * (target[_BODY_V + i] - velocity)
        desired += kp * (target[_BODY_P + i] - position)
        add_goal(H, g, row, desired - rest, weight)
    if not orientation_error(snapshot, target, error):
        return False
    weight = program[_ORIENTATION + 6]
    for i in range(3):
        rate, desired = -v[3 + i], 0.0
        for n in range(3):
            rate += R[n, i] * target[_BODY_W + n]
            desired += R[n, i] * target[_BODY_DW + n]
        desired += program[_ORIENTATION + 3 + i] * rate + program[_ORIENTATION + i] * error[i]
        add_goal(H, g, affine[3 + i], desired, weight)
    return True


@kernel("void(f8[::1], f8[::1], f8[::1], f8[::1], f8[::1], f8[:,::1], f8[:,::1], f8[::1])")
def add_leg_goals(q, v, snapshot, target, program, affine, H, g):
    """Rows of ``SwingFoot``, ``LegPosture`` and ``ForceRegularisation``."""
    row = np.empty(13)
    feet = 0
    for leg in range(4):
        feet += target[_LEGS + leg] == STANCE
    for leg in range(4):
        task = target[_LEGS + leg]
        for i in range(3):
            n = 3 * leg + i
            if task == SWING:
                J = snapshot[_J_FEET + 18 * n : _J_FEET + 18 * n + 18]
                times_affine(J, affine, leg, row)
                desired = target[_FOOT_A + n] - snapshot[_DRIFT_FEET + n]
                desired += program[_SWING + 3 + i] * (target[_FOOT_V + n] - snapshot[_V_FEET + n])
                desired += program[_SWING + i] * (target[_FOOT_P + n] - snapshot[_P_FEET + n])
                add_goal(H, g, row, desired, program[_SWING + 6])
            elif task == JOINTS:
                desired = target[_JOINT_A + n]
                desired += program[_POSTURE + 3 + i] * (target[_JOINT_V + n] - v[6 + n])
                desired += program[_POSTURE + i] * (target[_JOINT_Q + n] - q[7 + n])
                add_goal(H, g, affine[6 + n], desired, program[_POSTURE + 6])
            else:
                share = program[_WEIGHT_OF_ROBOT] / feet if i == 2 else 0.0
                add_goal(H, g, affine[18 + n], share, program[_FORCE_WEIGHT])


@kernel("i8(f8[::1], f8[::1], f8[:,::1], f8[::1], f8[::1])")
def bound_forces(target, program, C, lower, upper):
    """Rows of ``FrictionPyramid``; returns how many."""
    mu = program[_FRICTION]
    count = 0
    for leg in range(4):
        if target[_LEGS + leg] != STANCE:
            continue
        for n in range(5):
            row = count + n
            C[row] = 0.0
            lower[row], upper[row] = -np.inf, 0.0
            C[row, 3 * leg + 2] = -mu
            if n < 4:
                C[row, 3 * leg + n // 2] = 1.0 - 2.0 * (n % 2)
        C[count + 4, 3 * leg + 2] = 1.0
        lower[count + 4], upper[count + 4] = target[_F_MIN + leg], target[_F_MAX + leg]
        count += 5
    return count


@kernel("f8(f8, f8, f8, f8)")
def viable_speed(distance, speed, braking, horizon):
    """v' of (1) in ``JointLimits``."""
    half = braking * horizon / 2
    radicand = half * half - 2 * half * speed + 2 * braking * distance
    return np.sqrt(max(radicand, 0.0)) - half


@kernel("void(f8[::1], f8[::1], f8[::1], f8[::1], f8[:,::1], i8, f8[:,::1], f8[::1], f8[::1])")
def bound_joints(q, v, snapshot, program, affine, count, C, lower, upper):
    """Rows of ``TorqueLimits`` and ``JointLimits``, from row ``count`` on."""
    row = np.empty(13)
    braking, horizon = program[_BRAKING], program[_HORIZON]
    for n in range(12):
        leg = n // 3
        M = snapshot[_M + 18 * (6 + n) : _M + 18 * (7 + n)]
        times_affine(M, affine, leg, row)  # no joint of another leg is coupled but by the base
        for i in range(3):
            J = snapshot[_J_CONTACTS + 54 * leg + 18 * i + 6 + n]
            for k in range(13):
                row[k] -= J * affine[18 + 3 * leg + i, k]
        limit, offset = program[_TORQUE + n], snapshot[_H + 6 + n] + row[12]
        C[count + n] = row[:12]
        lower[count + n], upper[count + n] = -limit - offset, limit - offset
        last = count + 12 + n
        speed, most = v[6 + n], program[_SPEED + n]
        fast = viable_speed(program[_Q_UPPER + n] - q[7 + n], speed, braking, horizon)
        slow = viable_speed(q[7 + n] - program[_Q_LOWER + n], -speed, braking, horizon)
        offset = affine[6 + n, 12]
        C[last] = affine[6 + n, :12]
        upper[last] = max((min(most, fast) - speed) / horizon, -braking) - offset
        lower[last] = min((-min(most, slow) - speed) / horizon, braking) - offset


@kernel("void(f8[::1], f8[:,::1], f8[::1], f8[::1])")
def torques(snapshot, affine, z, tau):
    """Joint rows of M a + h - J'f."""
    for n in range(12):
        leg = n // 3
        value = snapshot[_H + 6 + n]
        for k in range(18):
            value += snapshot[_M + 18 * (6 + n) + k] * z[k]
        for i in range(3):
            value -= snapshot[_J_CONTACTS + 54 * leg + 18 * i + 6 + n] * z[18 + 3 * leg + i]
        tau[n] = value


@kernel("i8(f8[::1], f8[::1], f8[::1], f8[:,::1], f8[::1], f8[::1], f8[::1], f8[::1])")
def solve_condensed(snapshot, target, program, A_extra, b_extra, w_extra, z, tau):
    """Fill the decision z (30,) and the torques (12,); returns the outcome.

    ``A_extra`` (k, 30), ``b_extra`` (k,) and ``w_extra`` (k,) are rows of a user's own tasks.
    """
    q, v = snapshot[:19], snapshot[19:37]
    affine = np.empty((30, 13))
    if not are_valid(snapshot, target):
        return UNSUITED
    if not eliminate(snapshot, target, program, affine):
        return UNSUITED
    H, g = np.zeros((12, 12)), np.zeros(12)
    if not add_body_goals(q, v, snapshot, target, program, affine, H, g):
        return UNSUITED
    add_leg_goals(q, v, snapshot, target, program, affine, H, g)
    row = np.empty(13)
    for n in range(len(b_extra)):
        row[:] = 0.0
        for i in range(30):
            for k in range(13):
                row[k] += A_extra[n, i] * affine[i, k]
        add_goal(H, g, row, b_extra[n], w_extra[n])
    for i in range(12):
        for k in range(i):
            H[k, i] = H[i, k]
    C, lower, upper = np.empty((44, 12)), np.empty(44), np.empty(44)
    count = bound_forces(target, program, C, lower, upper)
    bound_joints(q, v, snapshot, program, affine, count, C, lower, upper)
    count += 24
    u, multipliers = np.empty(12), np.empty(count)
    none, nothing = np.empty((0, 12)), np.empty(0)
    outcome = solve_qp(
        H, g, none, nothing, C[:count], lower[:count], upper[:count], u, multipliers
    )  # fmt: skip
    for i in range(30):
        value = affine[i, 12]
        for k in range(12):
            value += affine[i, k] * u[k]
        z[i] = value
    torques(snapshot, affine, z, tau)
    return outcome
