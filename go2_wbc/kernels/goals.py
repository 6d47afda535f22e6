"""The cost of the whole-body QP in its unknowns, u'Hu/2 + g'u, as kernels.

``wbc.tasks`` says which rows each task has; ``elimination`` what ``base`` is. A row of a task
becomes 13 numbers, the last of which goes to its right side. Only the lower half of H is filled.
"""

from __future__ import annotations

import numpy as np

from go2_wbc.kernels.compilation import subroutine
from go2_wbc.kernels.elimination import JOINTS, STANCE, SWING
from go2_wbc.kernels.layout import PROGRAM, REFERENCE, SNAPSHOT
from go2_wbc.kernels.standing import planned_loads

LARGEST_ERROR = 3.0
"""Orientation error [rad] beyond which this logarithm of a rotation is not accurate."""

_S, _T, _P = SNAPSHOT.start, REFERENCE.start, PROGRAM.start
_R, _M, _P_COM, _V_COM = (
    _S[n] for n in ("R_world_base", "mass_matrix", "p_world_com", "v_world_com")
)
_P_FEET, _V_FEET, _J_FEET, _DRIFT_FEET = (
    _S[n] for n in ("p_world_feet", "v_world_feet", "J_feet", "drift_feet")
)
_IS_COM, _BODY_P, _BODY_V, _BODY_A = (_T[n] for n in ("is_com", "p_world", "v_world", "a_world"))
_BODY_R, _BODY_W, _BODY_DW, _LEGS = (_T[n] for n in ("R_world_base", "w_world", "dw_world", "legs"))
_FOOT_P, _FOOT_V, _FOOT_A = (_T[n] for n in ("p_world_feet", "v_world_feet", "a_world_feet"))
_JOINT_Q, _JOINT_V, _JOINT_A = (_T[n] for n in ("q_joints", "v_joints", "a_joints"))
_POSITION, _ORIENTATION, _SWING, _POSTURE = (
    _P[n] for n in ("position_kp", "orientation_kp", "swing_kp", "posture_kp")
)
_FORCE_WEIGHT, _WEIGHT_OF_ROBOT = _P["force_weight"], _P["weight_of_robot"]
_FLIGHT_WEIGHT = _P["flight_weight"]
_CARRIED = _S["payload"] + 1
"""Weight of the payload [N]."""
_FORCES, _PRIOR_WEIGHT = _T["f_world_feet"], _T["force_weight"]
_DISCOUNT = _T["orientation_discount"]


@subroutine("void(f8[:,::1], f8[::1], f8[::1], f8, f8)")
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


@subroutine("void(f8[:,::1], f8[::1], i8, f8, f8)")
def add_unknown_goal(H, g, n, b, weight):
    """Add weight (u_n - b)^2 / 2."""
    H[n, n] += weight
    g[n] -= weight * b


@subroutine("b1(f8[::1], f8[::1], f8[::1])")
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


@subroutine("b1(f8[::1], f8[::1], f8[::1], f8[:,::1], f8[:,::1], f8[::1])")
def add_body_goals(snapshot, target, program, base, H, g):
    """Rows of ``BodyPosition`` and ``BodyOrientation``; False for an attitude too far away.

    The CoM's acceleration needs no Jacobian: it is the sum of the contact forces, by the mass, and
    gravity, which is what the base's first rows of M a + h = J'f say.
    """
    q, v = snapshot[:19], snapshot[19:37]
    R = snapshot[_R : _R + 9].reshape(3, 3)
    is_com = target[_IS_COM] != 0.0
    row, error, drift = np.empty(13), np.empty(3), np.empty(3)
    drift[0] = v[4] * v[2] - v[5] * v[1]
    drift[1] = v[5] * v[0] - v[3] * v[2]
    drift[2] = v[3] * v[1] - v[4] * v[0]
    mass, weight = snapshot[_M], program[_POSITION + 6]
    for i in range(3):
        row[:] = 0.0
        if is_com:
            position, velocity, rest = snapshot[_P_COM + i], snapshot[_V_COM + i], 0.0
            for leg in range(4):
                if target[_LEGS + leg] == STANCE:
                    row[3 * leg + i] = 1.0 / mass
            if i == 2:
                row[12] = -(program[_WEIGHT_OF_ROBOT] + snapshot[_CARRIED]) / mass
        else:
            position = q[i]
            velocity = R[i, 0] * v[0] + R[i, 1] * v[1] + R[i, 2] * v[2]
            rest = R[i, 0] * drift[0] + R[i, 1] * drift[1] + R[i, 2] * drift[2]
            for n in range(3):
                for k in range(13):
                    row[k] += R[i, n] * base[n, k]
        kp, kd = program[_POSITION + i], program[_POSITION + 3 + i]
        desired = target[_BODY_A + i] + kd * (target[_BODY_V + i] - velocity)
        desired += kp * (target[_BODY_P + i] - position)
        add_goal(H, g, row, desired - rest, weight)
    if not orientation_error(snapshot, target, error):
        return False
    stands = False
    for leg in range(4):
        stands |= target[_LEGS + leg] == STANCE
    weight = program[_ORIENTATION + 6] / (1.0 + target[_DISCOUNT])
    if not stands:
        weight = min(weight, program[_FLIGHT_WEIGHT])
    for i in range(3):
        rate, desired = -v[3 + i], 0.0
        for n in range(3):
            rate += R[n, i] * target[_BODY_W + n]
            desired += R[n, i] * target[_BODY_DW + n]
        desired += program[_ORIENTATION + 3 + i] * rate + program[_ORIENTATION + i] * error[i]
        add_goal(H, g, base[3 + i], desired, weight)
    return True


@subroutine("void(f8[::1], f8[::1], f8[::1], f8[:,::1], f8[:,::1], f8[::1])")
def add_leg_goals(snapshot, target, program, base, H, g):
    """Rows of ``SwingFoot``, ``LegPosture`` and ``ForceRegularisation``."""
    q, v = snapshot[:19], snapshot[19:37]
    row = np.empty(13)
    stance, loads = np.empty(4, dtype=np.int64), np.ones(4)
    feet = 0
    for leg in range(4):
        if target[_LEGS + leg] == STANCE:
            stance[feet] = leg
            feet += 1
    if feet > 0:
        planned_loads(snapshot, target, program[_WEIGHT_OF_ROBOT], stance[:feet], loads[:feet])
    foot, weight = 0, program[_WEIGHT_OF_ROBOT] + snapshot[_CARRIED]
    for leg in range(4):
        task = target[_LEGS + leg]
        for i in range(3):
            n = 3 * leg + i
            if task == SWING:
                row[:] = 0.0
                for m in range(6):
                    value = snapshot[_J_FEET + 18 * n + m]
                    for k in range(13):
                        row[k] += value * base[m, k]
                for m in range(3):
                    row[3 * leg + m] += snapshot[_J_FEET + 18 * n + 6 + 3 * leg + m]
                desired = target[_FOOT_A + n] - snapshot[_DRIFT_FEET + n]
                desired += program[_SWING + 3 + i] * (target[_FOOT_V + n] - snapshot[_V_FEET + n])
                desired += program[_SWING + i] * (target[_FOOT_P + n] - snapshot[_P_FEET + n])
                add_goal(H, g, row, desired, program[_SWING + 6])
            elif task == JOINTS:
                desired = target[_JOINT_A + n]
                desired += program[_POSTURE + 3 + i] * (target[_JOINT_V + n] - v[6 + n])
                desired += program[_POSTURE + i] * (target[_JOINT_Q + n] - q[7 + n])
                add_unknown_goal(H, g, n, desired, program[_POSTURE + 6])
            elif target[_PRIOR_WEIGHT] > 0.0:
                add_unknown_goal(H, g, n, target[_FORCES + n], target[_PRIOR_WEIGHT])
            else:
                share = weight / feet if i == 2 else 0.0
                load = 1.0 if i == 2 else loads[foot]
                add_unknown_goal(H, g, n, share, program[_FORCE_WEIGHT] / load)
        foot += task == STANCE
