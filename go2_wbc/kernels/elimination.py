"""The equalities of the whole-body QP solved for all but three unknowns a leg, as kernels.

Equation numbers are those of ``wbc.backends``. Unknown are the forces of a stance foot and the
joint accelerations of any other leg, u (12,). ``base`` (6, 13) gives the base's acceleration,
a_b = base (u, 1), and ``legs_map`` (12, 7) those of a stance leg's joints, a_l = legs_map (a_b, 1).
"""

from __future__ import annotations

import numpy as np

from go2_wbc.algebra.linear import solve_linear
from go2_wbc.algebra.vectors import along, cross, plus_scaled
from go2_wbc.kernels.compilation import subroutine
from go2_wbc.kernels.layout import PROGRAM, REFERENCE, SNAPSHOT
from go2_wbc.kernels.vectors import vector

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
    first, J = 3 * leg, _J_CONTACTS + 54 * leg
    x, y, z = (
        vector(snapshot, J + 6 + first),
        vector(snapshot, J + 24 + first),
        vector(snapshot, J + 42 + first),
    )
    columns = cross(y, z), cross(z, x), cross(x, y)  # of the inverse, times the determinant
    determinant = x[0] * columns[0][0] + x[1] * columns[0][1] + x[2] * columns[0][2]
    if not abs(determinant) >= program[_SINGULAR]:  # a nan counts as singular
        return False
    drift, velocity = (
        vector(snapshot, _DRIFT_CONTACTS + first),
        vector(snapshot, _V_CONTACTS + first),
    )
    wanted = along(columns, plus_scaled(drift, program[_DAMPING], velocity))
    for k in range(6):
        column = snapshot[J + k], snapshot[J + 18 + k], snapshot[J + 36 + k]
        moved = along(columns, column)
        for i in range(3):
            legs_map[first + i, k] = -moved[i] / determinant
    for i in range(3):
        legs_map[first + i, 6] = -wanted[i] / determinant
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
