"""What a payload takes of the standing feet, as a kernel.

``robot.payload_estimation`` is the readable form, and says which equations these are.
"""

from __future__ import annotations

import numpy as np

from go2_wbc.algebra.linear import solve_linear
from go2_wbc.algebra.vectors import cross, plus, plus_scaled
from go2_wbc.kernels.compilation import kernel, subroutine
from go2_wbc.kernels.layout import FEELING, FELT, FRICTION, SNAPSHOT
from go2_wbc.kernels.vectors import V3, put, vector

_S, _F, _C = SNAPSHOT.start, FRICTION.start, FEELING.start
_Q, _V, _R, _M, _H = (_S[n] for n in ("q", "v", "R_world_base", "mass_matrix", "bias"))
_J, _V_COM, _P_FEET = (_S[n] for n in ("J_contacts", "v_world_com", "p_world_feet"))
_CARRIED = _S["payload"]
_DRY, _VISCOUS, _TRANSITION = (_F[name] for name in ("dry", "viscous", "transition"))
_GRAVITY, _MEMORY = _C["gravity"], _C["memory"]
_LOW, _RISE, _SPEED = (_C[n] for n in ("least_height", "most_rise", "most_speed"))
_MOMENT, _WEIGHT = FELT.start["moment"], FELT.start["gravity"]
_MEASURED = "Array(f8, 1, 'A', readonly=True)"


@subroutine("b1(f8[::1], f8[::1], f8[::1])")
def can_feel(snapshot, contact, c):
    """Whether the feet alone carry the robot, and friction of the joints does not mask the load."""
    lowest, touches = np.inf, False
    for leg in range(4):
        lowest = min(lowest, snapshot[_P_FEET + 3 * leg + 2])
        touches |= contact[leg] != 0.0
    if not touches or snapshot[_Q + 2] - lowest < c[_LOW]:
        return False
    is_slow = abs(snapshot[_V]) <= c[_SPEED] and abs(snapshot[_V + 1]) <= c[_SPEED + 1]
    return is_slow and abs(snapshot[_V_COM + 2]) <= c[_RISE]


@subroutine("void(f8[::1], f8[::1], f8[::1])")
def forces_needed(snapshot, a, needed):
    """Fill M a + h (18,)."""
    for i in range(18):
        needed[i] = snapshot[_H + i]
        for k in range(18):
            needed[i] += snapshot[_M + 18 * i + k] * a[k]


@subroutine(f"b1(f8[::1], i8, {_MEASURED}, f8[::1], f8[::1], f8[::1])")
def add_foot(snapshot, leg, tau, friction, needed, felt):
    """Add the wrench on the base of a foot's force to ``felt``; False if the leg is singular."""
    J = snapshot[_J + 54 * leg : _J + 54 * leg + 54].reshape(3, 18)
    system = np.empty((3, 4))
    for i in range(3):
        n = 3 * leg + i
        v = snapshot[_V + 6 + n]
        taken = friction[_DRY + n] * np.tanh(v / friction[_TRANSITION]) + friction[_VISCOUS + n] * v
        system[i, 3] = needed[6 + n] - tau[n] + taken
        for k in range(3):
            system[i, k] = J[k, 6 + n]
    if not solve_linear(system, 3):
        return False
    for i in range(6):
        for k in range(3):
            felt[i] += J[k, i] * system[k, 3]
    return True


@subroutine(f"{V3}(f8[::1], f8[::1], f8)")
def weight_of_mass(snapshot, a, gravity):
    """Acceleration of the base, with gravity, in its own frame: what a unit of mass weighs."""
    v, w = vector(snapshot, _V), vector(snapshot, _V + 3)
    moved = plus((a[0], a[1], a[2]), cross(w, v))
    return plus_scaled(moved, gravity, vector(snapshot, _R + 6))


@kernel(f"void(f8[::1], {_MEASURED}, {_MEASURED}, f8[::1], f8, f8[::1], f8[::1], f8[::1], f8[::1])")
def feel(snapshot, v_before, tau, contact, dt, place, c, friction, felt):
    """Let the means ``felt`` (``layout.FELT``) take up this tick.

    ``tau`` (12,) acted over the ``dt`` seconds since ``v_before`` (18,); ``contact`` is not 0 for
    the feet in contact; ``place`` (3,) is that of the payload which the snapshot already has; ``c``
    are numbers (``layout.FEELING``).
    """
    if not can_feel(snapshot, contact, c):
        return
    a, needed, now = np.empty(18), np.empty(18), np.empty(9)
    for i in range(18):
        a[i] = (snapshot[_V + i] - v_before[i]) / dt
    forces_needed(snapshot, a, needed)
    for i in range(6):
        now[i] = -needed[i]
    for leg in range(4):
        if contact[leg] != 0.0 and not add_foot(snapshot, leg, tau, friction, needed, now):
            return
    weight = weight_of_mass(snapshot, a, c[_GRAVITY])
    put(now, _WEIGHT, weight)
    force = plus_scaled((0.0, 0.0, 0.0), snapshot[_CARRIED], weight)
    moment = cross(vector(place, 0), force)
    put(now, 0, plus(vector(now, 0), force))
    put(now, _MOMENT, plus(vector(now, _MOMENT), moment))
    share = min(dt / c[_MEMORY], 1.0)
    for i in range(9):
        felt[i] += share * (now[i] - felt[i])
