"""Friction of the ground from feet that slide: part of ``locomotion.plan``.

``planning.slip`` is its readable form, and says why.
"""

from __future__ import annotations

import numpy as np

from go2_wbc.kernels.compilation import subroutine
from go2_wbc.kernels.layout import LOCOMOTION, PLANNER, SNAPSHOT

_V_CONTACTS = SNAPSHOT.start["v_world_contacts"]
_FRICTION, _LOADED, _SLIDING = (PLANNER.start[n] for n in ("friction", "loaded", "sliding"))
_SLIP = LOCOMOTION.start["slip"]
_SPEED, _PATIENCE, _MASK, _STEEPNESS = range(_SLIP, _SLIP + 4)
_TIME, _RECOVERY, _LEAST, _MOST = range(_SLIP + 4, _SLIP + 8)


@subroutine("void(f8[::1], f8[::1], f8[::1], f8[::1], b1[::1], f8)")
def observe_slip(snapshot, contact, s, c, stance, dt):
    """Look at the feet that shall stand, ``dt`` seconds after the last look."""
    slips = False
    for leg in range(4):
        v = _V_CONTACTS + 3 * leg
        speed = np.hypot(snapshot[v], snapshot[v + 1])
        is_level = abs(snapshot[v + 2]) <= c[_STEEPNESS] * speed
        stands = stance[leg] and contact[leg] != 0.0
        s[_LOADED + leg] = s[_LOADED + leg] + dt if stands else 0.0
        slides = s[_LOADED + leg] > c[_MASK] and speed > c[_SPEED] and is_level
        s[_SLIDING + leg] = s[_SLIDING + leg] + dt if slides else 0.0
        slips |= s[_SLIDING + leg] > c[_PATIENCE]
    if slips:
        s[_FRICTION] += (c[_LEAST] - s[_FRICTION]) * min(dt / c[_TIME], 1.0)
    else:
        s[_FRICTION] = min(s[_FRICTION] + c[_RECOVERY] * dt, c[_MOST])
