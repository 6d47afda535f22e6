"""The motors' torques as a kernel; ``robot.joint_friction`` is its readable form."""

from __future__ import annotations

import numpy as np

from go2_wbc.kernels.compilation import subroutine
from go2_wbc.kernels.layout import FRICTION, SNAPSHOT
from go2_wbc.kernels.motor import available

_V = SNAPSHOT.start["v"] + 6
_F = FRICTION.start
_DRY, _VISCOUS, _TRANSITION, _LOOKAHEAD = (
    _F[name] for name in ("dry", "viscous", "transition", "lookahead")
)
_PEAK, _KNEE, _NO_LOAD = _F["peak_torque"], _F["knee_speed"], _F["no_load_speed"]


@subroutine("void(f8[::1], f8[::1], f8[::1], f8[::1], f8[::1])")
def motor_torques(snapshot, z, tau, c, out):
    """Fill ``out`` (12,): ``tau`` and the friction of the joints, within the motors' line.

    ``z`` is the QP's decision, which begins with the base's acceleration and the joints'.
    """
    for n in range(12):
        v = snapshot[_V + n]
        w = v + c[_LOOKAHEAD] * z[6 + n]
        friction = c[_DRY + n] * np.tanh(w / c[_TRANSITION]) + c[_VISCOUS + n] * v
        peak, knee, no_load = c[_PEAK + n], c[_KNEE + n], c[_NO_LOAD + n]
        least, most = -available(-v, peak, knee, no_load), available(v, peak, knee, no_load)
        out[n] = min(max(tau[n] + friction, least), most)
