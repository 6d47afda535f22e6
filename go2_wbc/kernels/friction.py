"""The motors' torques as a kernel; ``robot.joint_friction`` is its readable form."""

from __future__ import annotations

import numpy as np

from go2_wbc.kernels.compilation import subroutine
from go2_wbc.kernels.layout import FRICTION, SNAPSHOT

_V = SNAPSHOT.start["v"] + 6
_DRY, _VISCOUS, _LIMITS = (FRICTION.start[n] for n in ("dry", "viscous", "torque_limits"))
_TRANSITION, _LOOKAHEAD = FRICTION.start["transition"], FRICTION.start["lookahead"]


@subroutine("void(f8[::1], f8[::1], f8[::1], f8[::1], f8[::1])")
def motor_torques(snapshot, z, tau, c, out):
    """Fill ``out`` (12,): ``tau`` and the friction of the joints, within the torque limits.

    ``z`` is the QP's decision, which begins with the base's acceleration and the joints'.
    """
    for n in range(12):
        v = snapshot[_V + n]
        w = v + c[_LOOKAHEAD] * z[6 + n]
        friction = c[_DRY + n] * np.tanh(w / c[_TRANSITION]) + c[_VISCOUS + n] * v
        limit = c[_LIMITS + n]
        out[n] = min(max(tau[n] + friction, -limit), limit)
