"""Friction of the ground from feet that slide: part of ``locomotion.plan``.

``planning.slip`` is its readable form, and says why.
"""

from __future__ import annotations

import numpy as np

from go2_wbc.algebra.vectors import cross, dot, plus_scaled
from go2_wbc.kernels.compilation import subroutine
from go2_wbc.kernels.layout import LOCOMOTION, PLANNER, SNAPSHOT

_N = SNAPSHOT.start
_V_CONTACTS, _J_CONTACTS, _BIAS = (_N[n] for n in ("v_world_contacts", "J_contacts", "bias"))
_FRICTION, _LOADED, _SLIDING = (PLANNER.start[n] for n in ("friction", "loaded", "sliding"))
_SLIP = LOCOMOTION.start["slip"]
_SPEED, _PATIENCE, _MASK, _STEEPNESS = range(_SLIP, _SLIP + 4)
_TIME, _RECOVERY, _LEAST, _MOST, _HALF_SPEED = range(_SLIP + 4, _SLIP + 9)
_TINY = 1e-9
"""As ``planning.slip``."""


@subroutine("f8(f8[::1], f8[::1], i8)")
def exerted_ratio(snapshot, tau, leg):
    """Force of a foot along the ground over that into it, as the torques of its leg make it."""
    k = _J_CONTACTS + 54 * leg + 6 + 3 * leg
    x = snapshot[k], snapshot[k + 18], snapshot[k + 36]
    y = snapshot[k + 1], snapshot[k + 19], snapshot[k + 37]
    z = snapshot[k + 2], snapshot[k + 20], snapshot[k + 38]
    b, f = _BIAS + 6 + 3 * leg, (0.0, 0.0, 0.0)
    f = plus_scaled(f, snapshot[b] - tau[3 * leg], cross(y, z))
    f = plus_scaled(f, snapshot[b + 1] - tau[3 * leg + 1], cross(z, x))
    f = plus_scaled(f, snapshot[b + 2] - tau[3 * leg + 2], cross(x, y))
    return np.hypot(f[0], f[1]) / max(f[2] * np.sign(dot(x, cross(y, z))), _TINY)


@subroutine("void(f8[::1], f8[::1], f8[::1], f8[::1], f8[::1], b1[::1], f8)")
def observe_slip(snapshot, contact, tau, s, c, stance, dt):
    """Look at the feet that shall stand, ``dt`` seconds after the last look."""
    slips, shown = False, c[_MOST]
    for leg in range(4):
        v = _V_CONTACTS + 3 * leg
        speed = np.hypot(snapshot[v], snapshot[v + 1])
        is_level = abs(snapshot[v + 2]) <= c[_STEEPNESS] * speed
        touches, loaded = contact[leg] != 0.0, s[_LOADED + leg] + dt
        if not touches:
            loaded = max(min(loaded, 2.0 * c[_MASK]) - 2.0 * dt, 0.0)
        s[_LOADED + leg] = loaded if stance[leg] else 0.0
        may_slide = s[_LOADED + leg] > c[_MASK]
        slides = may_slide and touches and speed > c[_SPEED] and is_level
        if touches or not may_slide:
            s[_SLIDING + leg] = s[_SLIDING + leg] + dt if slides else 0.0
        if slides and s[_SLIDING + leg] > c[_PATIENCE]:
            slips = True
            ratio = exerted_ratio(snapshot, tau, leg)
            shown = min(shown, ratio / (1.0 + speed / c[_HALF_SPEED]))
    if slips:
        fall = min(max(shown, c[_LEAST]) - s[_FRICTION], 0.0)
        s[_FRICTION] += fall * min(dt / c[_TIME], 1.0)
    else:
        s[_FRICTION] = min(s[_FRICTION] + c[_RECOVERY] * dt, c[_MOST])
