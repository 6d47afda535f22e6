"""The equalities of the whole-body QP solved for all but three unknowns a leg.

The equalities are the base's rows of the equations of motion (6), and for each stance leg l that
its contact point rolls (3); see ``constraints``. With the blocks of M, h and J by base b and leg,

    base         M_b a_b + sum_l M_bl a_l - sum_stance J_bl' f_l = -h_b             (1)
    stance leg   J_bl a_b + J_l a_l = c_l                                           (2)

where a_b (6,) is the base's acceleration in the base frame, a_l (3,) that of leg l's joints, f_l
(3,) its contact force in the world frame. J_l is square, so (2) can be solved for a_l and put into
(1): elimination of variables (Nocedal & Wright, *Numerical Optimization*, 2006, sec. 15.3).

    stance leg   a_l = J_l^-1 (c_l - J_bl a_b)                                      (3)
    base         (M_b - sum_stance M_bl J_l^-1 J_bl) a_b
                   = sum_stance J_bl' f_l - sum_swing M_bl a_l - h_b - sum_stance M_bl J_l^-1 c_l
                                                                                    (4)

Three unknowns a leg are left: u (12,) holds f_l of a stance leg and a_l of another. (4) and (3)
make z = Z u + z0, and the QP in u has no equalities, 12 unknowns instead of up to 30, and the same
optimum. A stance leg near a singularity (straight, or with the foot under the hip's axis) has no
J_l^-1; the full QP in (a, f) takes over for that tick.
"""

from __future__ import annotations

import numpy as np
from jaxtyping import Float

from go2_wbc.algebra.linear import solve_linear
from go2_wbc.algebra.vectors import along, cross, triple
from go2_wbc.compilation import kernel, subroutine
from go2_wbc.records import Array12, Array30, Record
from go2_wbc.reference import STANCE, Target
from go2_wbc.robot.snapshot import Snapshot
from go2_wbc.wbc.constraints import BaseRows, StanceFeetStill, fill_base_dynamics, left_over

SINGULAR_DETERMINANT = 2e-4
"""|det J_l| [m^3] below which a leg counts as singular; 1.5e-2 in standing (own measurement).

For a point foot it is thigh * calf * |sin(knee)| * depth of the foot below the hip's axis.
"""


class Reduction(Record):
    """What follows from the unknowns u.

    Attributes:
        legs: (3): the joints' accelerations of the stance legs, legs (a_b, 1).
        dynamics: (1): the base's rows.
        base: (4): that of the base, a_b = base (u, 1).
        affine: the decision, z = affine (u, 1).
    """

    dynamics: BaseRows
    legs: Float[np.ndarray, "12 7"]
    base: Float[np.ndarray, "6 13"]
    affine: Float[np.ndarray, "30 13"]


@subroutine
def reduce_leg(now: Snapshot, still: StanceFeetStill, leg: int, r: Reduction) -> bool:
    """(3): fill the rows of a leg; False if it is singular."""
    first, J = 3 * leg, now.J_contacts[leg]
    x, y, z = (
        triple(J[0, 6 + first : 9 + first]),
        triple(J[1, 6 + first : 9 + first]),
        triple(J[2, 6 + first : 9 + first]),
    )
    columns = cross(y, z), cross(z, x), cross(x, y)  # of the inverse, times the determinant
    determinant = x[0] * columns[0][0] + x[1] * columns[0][1] + x[2] * columns[0][2]
    if not abs(determinant) >= SINGULAR_DETERMINANT:  # a nan counts as singular
        return False
    wanted = along(columns, left_over(now, still, leg))
    for k in range(6):
        moved = along(columns, (J[0, k], J[1, k], J[2, k]))
        for i in range(3):
            r.legs[first + i, k] = -moved[i] / determinant
    for i in range(3):
        r.legs[first + i, 6] = -wanted[i] / determinant
    return True


@subroutine
def press(leg: int, r: Reduction, system: Float[np.ndarray, "6 19"]) -> None:
    """What a leg that stands adds to (4)."""
    A, c = r.dynamics.A, 3 * leg
    for i in range(6):
        for k in range(3):
            system[i, 6 + c + k] = -A[i, 18 + c + k]
        for n in range(3):
            share = A[i, 6 + c + n]
            for k in range(6):
                system[i, k] += share * r.legs[c + n, k]
            system[i, 18] -= share * r.legs[c + n, 6]


@subroutine
def eliminate(now: Snapshot, target: Target, still: StanceFeetStill, r: Reduction) -> bool:
    """(3) and (4): fill ``legs`` and ``base``; False if a leg is singular."""
    fill_base_dynamics(now, r.dynamics)
    A, b = r.dynamics.A, r.dynamics.b
    system = np.zeros((6, 19))  # a_b, u, 1
    for i in range(6):
        system[i, 18] = b[i]
        for k in range(6):
            system[i, k] = A[i, k]
    for leg in range(4):
        c = 3 * leg
        if target.legs[leg] != STANCE:
            for i in range(6):
                for k in range(3):
                    system[i, 6 + c + k] = -A[i, 6 + c + k]
        elif reduce_leg(now, still, leg, r):
            press(leg, r, system)
        else:
            return False
    if not solve_linear(system, 6):
        return False
    for i in range(6):
        for k in range(13):
            r.base[i, k] = system[i, 6 + k]
    return True


@subroutine
def expand(target: Target, r: Reduction) -> None:
    """Fill ``affine`` from the other two."""
    r.affine[:] = 0.0
    for i in range(6):
        for k in range(13):
            r.affine[i, k] = r.base[i, k]
    for leg in range(4):
        is_stance = target.legs[leg] == STANCE
        for i in range(3 * leg, 3 * leg + 3):
            if not is_stance:
                r.affine[6 + i, i] = 1.0
                continue
            r.affine[18 + i, i] = 1.0
            r.affine[6 + i, 12] = r.legs[i, 6]
            for n in range(6):
                value = r.legs[i, n]
                for k in range(13):
                    r.affine[6 + i, k] += value * r.base[n, k]


@subroutine
def decide(target: Target, r: Reduction, u: Array12, z: Array30) -> None:
    """Fill the decision z that the unknowns lead to."""
    for i in range(6):
        value = r.base[i, 12]
        for k in range(12):
            value += r.base[i, k] * u[k]
        z[i] = value
    for leg in range(4):
        is_stance = target.legs[leg] == STANCE
        for i in range(3 * leg, 3 * leg + 3):
            if not is_stance:
                z[6 + i], z[18 + i] = u[i], 0.0
                continue
            value = r.legs[i, 6]
            for n in range(6):
                value += r.legs[i, n] * z[n]
            z[6 + i], z[18 + i] = value, u[i]


@kernel
def reduce_equalities(now: Snapshot, target: Target, still: StanceFeetStill, r: Reduction) -> bool:
    """Fill the reduction; False if a leg is singular."""
    if not eliminate(now, target, still, r):
        return False
    expand(target, r)
    return True
