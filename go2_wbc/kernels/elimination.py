"""The equalities of the whole-body QP solved for all but three unknowns a leg, as kernels.

Equation numbers are those of ``wbc.backends``. Unknown are the forces of a stance foot and the
joint accelerations of any other leg, u (12,). ``base`` (6, 13) gives the base's acceleration,
a_b = base (u, 1), and ``legs_map`` (12, 7) those of a stance leg's joints, a_l = legs_map (a_b, 1).
"""

from __future__ import annotations

import numpy as np

from go2_wbc.kernels.compilation import subroutine
from go2_wbc.kernels.layout import PROGRAM, REFERENCE, SNAPSHOT

STANCE, SWING, JOINTS = 0, 1, 2
"""The values of ``reference.LegTask``."""

_S, _P = SNAPSHOT.start, PROGRAM.start
_M, _H, _J_CONTACTS = _S["mass_matrix"], _S["bias"], _S["J_contacts"]
_DRIFT_CONTACTS, _V_CONTACTS = _S["drift_contacts"], _S["v_world_contacts"]
_LEGS = REFERENCE.start["legs"]
_DAMPING, _SINGULAR = _P["stance_damping"], _P["singular_determinant"]


@subroutine("b1(f8[::1], f8[::1], i8, f8[:,::1])")
def stance_leg(snapshot, program, leg, legs_map):
    """(3): fill rows 3 leg to 3 leg + 2 of ``legs_map``; False if the leg is singular."""
    J = snapshot[_J_CONTACTS + 54 * leg : _J_CONTACTS + 54 * leg + 54].reshape(3, 18)
    c, first = 6 + 3 * leg, 3 * leg
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
    wanted = np.empty(3)
    for n in range(3):
        k = first + n
        wanted[n] = -snapshot[_DRIFT_CONTACTS + k]
        wanted[n] -= program[_DAMPING] * snapshot[_V_CONTACTS + k]
    for i in range(3):
        a, b = inverse[i, 0] / determinant, inverse[i, 1] / determinant
        c = inverse[i, 2] / determinant
        for k in range(6):
            legs_map[first + i, k] = -(a * J[0, k] + b * J[1, k] + c * J[2, k])
        legs_map[first + i, 6] = a * wanted[0] + b * wanted[1] + c * wanted[2]
    return True


@subroutine("b1(f8[:,::1], i8)")
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
        if pivot != j:
            for k in range(j, columns):
                A[j, k], A[pivot, k] = A[pivot, k], A[j, k]
        inverse = 1.0 / A[j, j]
        for k in range(j + 1, columns):
            A[j, k] *= inverse
        for i in range(n):
            if i == j:
                continue
            factor = A[i, j]
            for k in range(j + 1, columns):
                A[i, k] -= factor * A[j, k]
    return True


@subroutine("b1(f8[::1], f8[::1], f8[::1], f8[:,::1], f8[:,::1])")
def eliminate(snapshot, target, program, legs_map, base):
    """(3) and (4): fill ``legs_map`` and ``base``; False if a leg is singular."""
    M = snapshot[_M : _M + 324].reshape(18, 18)
    system = np.zeros((6, 19))  # a_b, u, 1
    for i in range(6):
        system[i, 18] = -snapshot[_H + i]
        for k in range(6):
            system[i, k] = M[i, k]
    for leg in range(4):
        c = 3 * leg
        if target[_LEGS + leg] != STANCE:
            for i in range(6):
                for k in range(3):
                    system[i, 6 + c + k] = -M[i, 6 + c + k]
            continue
        if not stance_leg(snapshot, program, leg, legs_map):
            return False
        J = snapshot[_J_CONTACTS + 54 * leg : _J_CONTACTS + 54 * leg + 54].reshape(3, 18)
        for i in range(6):
            for k in range(3):
                system[i, 6 + c + k] = J[k, i]
            for n in range(3):
                share = M[i, 6 + c + n]
                for k in range(6):
                    system[i, k] += share * legs_map[c + n, k]
                system[i, 18] -= share * legs_map[c + n, 6]
    if not solve_linear(system, 6):
        return False
    for i in range(6):
        for k in range(13):
            base[i, k] = system[i, 6 + k]
    return True


@subroutine("void(f8[::1], f8[:,::1], f8[:,::1], f8[:,::1])")
def expand(target, legs_map, base, affine):
    """Fill z = affine (u, 1), affine (30, 13), for the decision z that meets every equality."""
    affine[:] = 0.0
    for i in range(6):
        for k in range(13):
            affine[i, k] = base[i, k]
    for leg in range(4):
        is_stance = target[_LEGS + leg] == STANCE
        for i in range(3 * leg, 3 * leg + 3):
            if not is_stance:
                affine[6 + i, i] = 1.0
                continue
            affine[18 + i, i] = 1.0
            affine[6 + i, 12] = legs_map[i, 6]
            for n in range(6):
                value = legs_map[i, n]
                for k in range(13):
                    affine[6 + i, k] += value * base[n, k]


@subroutine("void(f8[::1], f8[:,::1], f8[:,::1], f8[::1], f8[::1])")
def decide(target, legs_map, base, u, z):
    """Fill the decision z (30,) that the unknowns u lead to."""
    for i in range(6):
        value = base[i, 12]
        for k in range(12):
            value += base[i, k] * u[k]
        z[i] = value
    for leg in range(4):
        is_stance = target[_LEGS + leg] == STANCE
        for i in range(3 * leg, 3 * leg + 3):
            if not is_stance:
                z[6 + i], z[18 + i] = u[i], 0.0
                continue
            value = legs_map[i, 6]
            for n in range(6):
                value += legs_map[i, n] * z[n]
            z[6 + i], z[18 + i] = value, u[i]
