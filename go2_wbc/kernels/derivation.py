"""What a snapshot derives from Pinocchio's two calls of a tick, as one kernel.

``robot.snapshot`` says what each quantity is; ``RobotModel.readable_snapshot`` computes the same
with Pinocchio's own functions. Foot centres are points of the calves: with a calf's spatial
velocity (v, w) and acceleration (a, dw) in its own frame, and p from its origin to the foot,

    v_foot = v + w x p,    a_foot = a + dw x p + w x v_foot

(Featherstone, *Rigid Body Dynamics Algorithms*, 2008, sec. 2.8 and 2.11).
"""

from __future__ import annotations

import numpy as np

from go2_wbc.kernels.compilation import kernel, subroutine
from go2_wbc.kernels.layout import SNAPSHOT

_R, _M, _H = (SNAPSHOT.start[n] for n in ("R_world_base", "mass_matrix", "bias"))
_P_COM, _V_COM, _J_COM, _DRIFT_COM = (
    SNAPSHOT.start[n] for n in ("p_world_com", "v_world_com", "J_com", "drift_com")
)
_P_FEET, _V_FEET, _J_FEET, _DRIFT_FEET = (
    SNAPSHOT.start[n] for n in ("p_world_feet", "v_world_feet", "J_feet", "drift_feet")
)
_J_CONTACTS, _DRIFT_CONTACTS, _V_CONTACTS = (
    SNAPSHOT.start[n] for n in ("J_contacts", "drift_contacts", "v_world_contacts")
)


@subroutine("void(f8, f8, f8, f8, f8[:,::1])")
def rotation_of(x, y, z, w, R):
    """Fill the rotation matrix of a unit quaternion."""
    R[0, 0], R[0, 1], R[0, 2] = 1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)
    R[1, 0], R[1, 1], R[1, 2] = 2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)
    R[2, 0], R[2, 1], R[2, 2] = 2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)


@subroutine("void(f8[:,::1], f8[:,::1], f8[::1], f8[::1], f8[::1], f8[::1])")
def derive_com(R, M, h, v, constants, row):
    """Fill the CoM's terms: the first rows of M and h are the robot's linear momentum."""
    mass, gravity = constants[0], constants[1]
    for i in range(3):
        velocity = 0.0
        for k in range(18):
            value = (R[i, 0] * M[0, k] + R[i, 1] * M[1, k] + R[i, 2] * M[2, k]) / mass
            row[_J_COM + 18 * i + k] = value
            velocity += value * v[k]
        row[_V_COM + i] = velocity
        row[_DRIFT_COM + i] = (R[i, 0] * h[0] + R[i, 1] * h[1] + R[i, 2] * h[2]) / mass
    row[_DRIFT_COM + 2] -= gravity


@subroutine("void(i8, f8[::1], f8[::1,:], f8[:,:], f8[:], f8[:], f8[:], f8[::1], f8[::1], f8[::1])")
def derive_foot(leg, v, J_pin, R, p_calf, v_calf, a_calf, p_calf_foot, constants, row):
    """Fill one foot's place, velocity, Jacobians and drifts, of its centre and its contact."""
    gravity, radius = constants[1], constants[2]
    p0, p1, p2 = p_calf_foot[0], p_calf_foot[1], p_calf_foot[2]
    w0, w1, w2 = v_calf[3], v_calf[4], v_calf[5]
    s0 = v_calf[0] + w1 * p2 - w2 * p1
    s1 = v_calf[1] + w2 * p0 - w0 * p2
    s2 = v_calf[2] + w0 * p1 - w1 * p0
    d0, d1, d2 = a_calf[3], a_calf[4], a_calf[5]
    a0 = a_calf[0] + d1 * p2 - d2 * p1 + w1 * s2 - w2 * s1
    a1 = a_calf[1] + d2 * p0 - d0 * p2 + w2 * s0 - w0 * s2
    a2 = a_calf[2] + d0 * p1 - d1 * p0 + w0 * s1 - w1 * s0
    turn = np.empty(3)
    for i in range(3):
        row[_P_FEET + 3 * leg + i] = p_calf[i] + R[i, 0] * p0 + R[i, 1] * p1 + R[i, 2] * p2
        row[_DRIFT_FEET + 3 * leg + i] = R[i, 0] * a0 + R[i, 1] * a1 + R[i, 2] * a2
        turn[i] = R[i, 0] * d0 + R[i, 1] * d1 + R[i, 2] * d2
    row[_DRIFT_FEET + 3 * leg + 2] -= gravity  # Pinocchio's a_gf counts gravity as acceleration
    x, y, z = row[_P_FEET + 3 * leg], row[_P_FEET + 3 * leg + 1], row[_P_FEET + 3 * leg + 2]
    foot = row[_J_FEET + 54 * leg : _J_FEET + 54 * leg + 54].reshape(3, 18)
    contact = row[_J_CONTACTS + 54 * leg : _J_CONTACTS + 54 * leg + 54].reshape(3, 18)
    foot[:], contact[:] = 0.0, 0.0
    for n in range(9):
        k = n if n < 6 else 3 * leg + n
        wx, wy, wz = J_pin[3, k], J_pin[4, k], J_pin[5, k]
        foot[0, k] = J_pin[0, k] + wy * z - wz * y  # v of the origin + w x p
        foot[1, k] = J_pin[1, k] + wz * x - wx * z
        foot[2, k] = J_pin[2, k] + wx * y - wy * x
        contact[0, k] = foot[0, k] - radius * wy
        contact[1, k] = foot[1, k] + radius * wx
        contact[2, k] = foot[2, k]
    for i in range(3):
        centre, material = 0.0, 0.0
        for n in range(9):
            k = n if n < 6 else 3 * leg + n
            centre += foot[i, k] * v[k]
            material += contact[i, k] * v[k]
        row[_V_FEET + 3 * leg + i] = centre
        row[_V_CONTACTS + 3 * leg + i] = material
        row[_DRIFT_CONTACTS + 3 * leg + i] = row[_DRIFT_FEET + 3 * leg + i]
    row[_DRIFT_CONTACTS + 3 * leg] -= radius * turn[1]
    row[_DRIFT_CONTACTS + 3 * leg + 1] += radius * turn[0]


_MEASURED = "Array(f8, 1, 'A', readonly=True)"


@kernel(
    f"void({_MEASURED}, {_MEASURED}, f8[::1,:], f8[::1], f8[::1,:], f8[:,:,:], f8[:,:], f8[:,:], "
    "f8[:,:], f8[:,::1], f8[::1], f8[::1])"
)
def derive(
    q_measured, v_measured, M_pin, h_pin, J_pin, R_calves, p_calves, v_calves, a_calves,
    p_calf_feet, constants, row,
):  # fmt: skip
    """Fill the row of a snapshot, which begins with the measured q and v.

    ``R_calves`` (4, 3, 3), ``p_calves`` (4, 3), ``v_calves``, ``a_calves`` (4, 6) and ``J_pin`` are
    Pinocchio's; ``constants``: mass [kg], gravity [m/s^2], foot radius [m].
    """
    q, v = row[:19], row[19:37]
    for i in range(19):
        q[i] = q_measured[i]
    for i in range(18):
        v[i] = v_measured[i]
    R = row[_R : _R + 9].reshape(3, 3)
    rotation_of(q[3], q[4], q[5], q[6], R)
    M, h = row[_M : _M + 324].reshape(18, 18), row[_H : _H + 18]
    for i in range(18):
        h[i] = h_pin[i]
        for k in range(18):
            M[i, k] = M_pin[i, k]
    derive_com(R, M, h, v, constants, row)
    # M[:3, 3:6] = -m [p_base_com]x
    mass = constants[0]
    c0, c1, c2 = M[2, 4] / -mass, M[0, 5] / -mass, M[1, 3] / -mass
    for i in range(3):
        row[_P_COM + i] = q[i] + R[i, 0] * c0 + R[i, 1] * c1 + R[i, 2] * c2
    for leg in range(4):
        derive_foot(
            leg, v, J_pin, R_calves[leg], p_calves[leg], v_calves[leg], a_calves[leg],
            p_calf_feet[leg], constants, row,
        )  # fmt: skip
