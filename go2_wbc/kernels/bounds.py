"""The inequalities of the whole-body QP, as kernels: forces, torques, joints.

``wbc.constraints`` says what they are. ``are_met`` looks at a decision z, ``bound_forces`` and
``bound_joints`` make rows of the unknowns u (``elimination``) for the active-set method.
"""

from __future__ import annotations

import numpy as np

from go2_wbc.algebra.active_set import VIOLATION
from go2_wbc.kernels.compilation import subroutine
from go2_wbc.kernels.elimination import STANCE
from go2_wbc.kernels.layout import PROGRAM, REFERENCE, SNAPSHOT
from go2_wbc.kernels.motor import available

MOST_ROWS = 44
"""Five for each of four feet, two for each of twelve joints."""

_S, _T, _P = SNAPSHOT.start, REFERENCE.start, PROGRAM.start
_M, _H, _J_CONTACTS = _S["mass_matrix"], _S["bias"], _S["J_contacts"]
_LEGS, _F_MIN, _F_MAX = (_T[n] for n in ("legs", "normal_force_min", "normal_force_max"))
_LESS, _PLANNED, _PRIOR = (_T[n] for n in ("friction", "f_world_feet", "force_weight"))
_KEEPS_CONE = _P["keeps_cone"]
_FRICTION, _PEAK, _KNEE = _P["friction"], _P["peak_torque"], _P["knee_speed"]
_NO_LOAD, _Q_LOWER, _Q_UPPER = _P["no_load_speed"], _P["q_lower"], _P["q_upper"]
_SPEED, _BRAKING, _HORIZON = _P["speed"], _P["braking"], _P["horizon"]


@subroutine("b1(f8, f8, f8)")
def is_within(value, lower, upper):
    """Whether a bound is met as ``active_set`` wants it; not if it is no bound (nan, crossed)."""
    return (
        lower <= upper
        and lower - value <= VIOLATION * (1.0 + abs(lower))
        and value - upper <= VIOLATION * (1.0 + abs(upper))
    )


@subroutine("f8(f8[::1], f8[::1])")
def friction_for(target, program):
    """What the feet may count on: ``FrictionPyramid``."""
    own, less = program[_FRICTION], target[_LESS]
    return min(own, less) if less > 0.0 else own


@subroutine("Tuple((f8, f8, f8))(f8[::1], f8[::1], i8, f8)")
def pyramid_of(target, program, leg, mu):
    """Friction and cosine and sine of the turn of a foot's pyramid: ``pyramid_in_cone``."""
    if program[_KEEPS_CONE] == 0.0 or target[_PRIOR] == 0.0:
        return mu, 1.0, 0.0
    x, y = target[_PLANNED + 3 * leg], target[_PLANNED + 3 * leg + 1]
    turn = np.arctan2(y, x) - np.pi / 4
    return mu / np.sqrt(2.0), np.cos(turn), np.sin(turn)


@subroutine("Tuple((f8, f8))(f8[::1], i8, f8)")
def torque_range(program, n, speed):
    """Least and greatest torque of joint n: ``TorqueLimits``."""
    peak, knee, no_load = program[_PEAK + n], program[_KNEE + n], program[_NO_LOAD + n]
    return -available(-speed, peak, knee, no_load), available(speed, peak, knee, no_load)


@subroutine("f8(f8, f8, f8, f8)")
def viable_speed(distance, speed, braking, horizon):
    """v' of (1) in ``JointLimits``."""
    half = braking * horizon / 2
    radicand = half * half - 2 * half * speed + 2 * braking * distance
    return np.sqrt(max(radicand, 0.0)) - half


@subroutine("Tuple((f8, f8))(f8[::1], i8, f8, f8)")
def acceleration_range(program, n, q, speed):
    """Least and greatest acceleration of joint n: ``JointLimits``."""
    braking, horizon, most = program[_BRAKING], program[_HORIZON], program[_SPEED + n]
    fast = viable_speed(program[_Q_UPPER + n] - q, speed, braking, horizon)
    slow = viable_speed(q - program[_Q_LOWER + n], -speed, braking, horizon)
    upper = max((min(most, fast) - speed) / horizon, -braking)
    lower = min((-min(most, slow) - speed) / horizon, braking)
    return lower, upper


@subroutine("b1(f8[::1], f8[::1], f8[::1], f8[::1], f8[::1])")
def are_met(snapshot, target, program, z, tau):
    """Whether a decision and its torques keep every bound; not if a number is not finite."""
    mu = friction_for(target, program)
    for leg in range(4):
        if target[_LEGS + leg] != STANCE:
            continue
        f = z[18 + 3 * leg : 21 + 3 * leg]
        if not is_within(f[2], target[_F_MIN + leg], target[_F_MAX + leg]):
            return False
        share, c, s = pyramid_of(target, program, leg, mu)
        first, second = abs(c * f[0] + s * f[1]), abs(c * f[1] - s * f[0])
        if not (first - share * f[2] <= VIOLATION and second - share * f[2] <= VIOLATION):
            return False
    for n in range(12):
        q, speed = snapshot[7 + n], snapshot[25 + n]
        lower, upper = torque_range(program, n, speed)
        if not is_within(tau[n], lower, upper):
            return False
        lower, upper = acceleration_range(program, n, q, speed)
        if not is_within(z[6 + n], lower, upper):
            return False
    return True


@subroutine("i8(f8[::1], f8[::1], f8[:,::1], f8[::1], f8[::1])")
def bound_forces(target, program, C, lower, upper):
    """Rows of ``FrictionPyramid``; returns how many."""
    mu = friction_for(target, program)
    count = 0
    for leg in range(4):
        if target[_LEGS + leg] != STANCE:
            continue
        share, c, s = pyramid_of(target, program, leg, mu)
        for n in range(5):
            row = count + n
            C[row] = 0.0
            lower[row], upper[row] = -np.inf, 0.0
            C[row, 3 * leg + 2] = -share
            if n < 4:
                side = 1.0 - 2.0 * (n % 2)
                C[row, 3 * leg] = side * (c if n < 2 else -s)
                C[row, 3 * leg + 1] = side * (s if n < 2 else c)
        C[count + 4, 3 * leg + 2] = 1.0
        lower[count + 4], upper[count + 4] = target[_F_MIN + leg], target[_F_MAX + leg]
        count += 5
    return count


@subroutine("void(f8[::1], f8[::1], f8[:,::1], i8, f8[:,::1], f8[::1], f8[::1])")
def bound_joints(snapshot, program, affine, count, C, lower, upper):
    """Rows of ``TorqueLimits`` and ``JointLimits``, from row ``count`` on."""
    row = np.empty(13)
    for n in range(12):
        leg = n // 3
        M = snapshot[_M + 18 * (6 + n) : _M + 18 * (7 + n)]
        row[:] = 0.0
        for m in range(9):  # no joint of another leg is coupled but by the base
            column = m if m < 6 else 3 * leg + m
            for k in range(13):
                row[k] += M[column] * affine[column, k]
        for i in range(3):
            J = snapshot[_J_CONTACTS + 54 * leg + 18 * i + 6 + n]
            for k in range(13):
                row[k] -= J * affine[18 + 3 * leg + i, k]
        q, speed = snapshot[7 + n], snapshot[25 + n]
        least, most = torque_range(program, n, speed)
        offset = snapshot[_H + 6 + n] + row[12]
        C[count + n] = row[:12]
        lower[count + n], upper[count + n] = least - offset, most - offset
        last = count + 12 + n
        least, most = acceleration_range(program, n, q, speed)
        offset = affine[6 + n, 12]
        C[last] = affine[6 + n, :12]
        lower[last], upper[last] = least - offset, most - offset
