"""The ground below a walking robot: part of ``locomotion.plan``.

``planning.ground`` is its readable form, and says why.
"""

from __future__ import annotations

import numpy as np

from go2_wbc.kernels.compilation import subroutine
from go2_wbc.kernels.layout import LOCOMOTION, PLANNER, SNAPSHOT

_P_COM, _P_FEET = SNAPSHOT.start["p_world_com"], SNAPSHOT.start["p_world_feet"]
_S, _C = PLANNER.start, LOCOMOTION.start
_HEIGHT, _SLOPE, _P_SEEN = (_S[n] for n in ("ground", "slope", "p_seen"))
_P_MET, _ROUGHNESS = _S["p_met"], _S["roughness"]
_SHARE, _RADIUS, _GROUND = (_C[n] for n in ("ground_share", "foot_radius", "ground"))
_SLOPE_SHARE, _FOLLOW, _SMOOTH, _RAISE, _CALMING, _STUMBLE, _DELAY = range(_GROUND, _GROUND + 7)
_LEAST, _MOST = _C["least_determinant"], _C["most_slope"]
_FRICTION, _LEAST_FRICTION = _S["friction"], _C["slip"] + 6
_LEVEL_SLOPE = 0.05
"""As ``planning.ground.LEVEL_SLOPE``."""


@subroutine("f8(f8[::1], f8, f8)")
def ground_at(s, x, y):
    """Height of the plane."""
    return s[_HEIGHT] + s[_SLOPE] * (x - s[_P_SEEN]) + s[_SLOPE + 1] * (y - s[_P_SEEN + 1])


@subroutine("f8(f8[::1], f8[::1])")
def apex_raise(s, c):
    """Height by which a swing is higher than on smooth ground."""
    return min(max(s[_ROUGHNESS] - c[_SMOOTH], 0.0), c[_RAISE])


@subroutine("f8(f8[::1], f8[::1])")
def delay(s, c):
    """Share of a swing in which the foot only rises."""
    return c[_DELAY] * apex_raise(s, c) / c[_RAISE] if c[_RAISE] > 0.0 else 0.0


@subroutine("Tuple((f8, f8))(f8[::1], f8[::1])")
def tilt(s, c):
    """Slope that the trunk follows."""
    return c[_FOLLOW] * s[_SLOPE], c[_FOLLOW] * s[_SLOPE + 1]


@subroutine("f8(f8[::1], f8[::1])")
def level_friction(s, c):
    """Coefficient of the upright cone that lies within that about the ground's normal."""
    friction, steep = s[_FRICTION], np.hypot(s[_SLOPE], s[_SLOPE + 1])
    steep *= min(max(steep / _LEVEL_SLOPE - 1.0, 0.0), 1.0)
    if s[_ROUGHNESS] > c[_SMOOTH]:
        return friction
    return max((friction - steep) / (1.0 + friction * steep), c[_LEAST_FRICTION])


@subroutine("void(f8[::1], f8[::1])")
def carry_ground(snapshot, s):
    """Follow the CoM."""
    x, y = snapshot[_P_COM], snapshot[_P_COM + 1]
    s[_HEIGHT] = ground_at(s, x, y)
    s[_P_SEEN], s[_P_SEEN + 1] = x, y


@subroutine("Tuple((f8, f8))(f8[::1], f8[::1])")
def fitted_slope(s, c):
    """Of the plane through where the feet were met; as it was if that is a line."""
    middle = np.zeros(3)
    for leg in range(4):
        for i in range(3):
            middle[i] += s[_P_MET + 3 * leg + i] / 4
    xx = xy = yy = xz = yz = 0.0
    for leg in range(4):
        k = _P_MET + 3 * leg
        x, y, z = s[k] - middle[0], s[k + 1] - middle[1], s[k + 2] - middle[2]
        xx += x * x
        xy += x * y
        yy += y * y
        xz += x * z
        yz += y * z
    determinant = xx * yy - xy * xy
    if determinant < c[_LEAST]:
        return s[_SLOPE], s[_SLOPE + 1]
    a, b = (yy * xz - xy * yz) / determinant, (xx * yz - xy * xz) / determinant
    most = c[_MOST]
    return min(max(a, -most), most), min(max(b, -most), most)


@subroutine("void(f8[::1], f8[::1], f8[::1], b1[::1])")
def learn_ground(snapshot, s, c, met):
    """Take in where feet, of which some are ``met`` at this tick, have met the ground."""
    count, mean, most = 0, 0.0, 0.0
    for leg in range(4):
        if met[leg]:
            k = _P_FEET + 3 * leg
            off = snapshot[k + 2] - c[_RADIUS] - ground_at(s, snapshot[k], snapshot[k + 1])
            count += 1
            mean += off
            most = max(most, abs(off))
            for i in range(3):
                s[_P_MET + 3 * leg + i] = snapshot[k + i]
    if count == 0:
        return
    s[_ROUGHNESS] = max(c[_CALMING] * s[_ROUGHNESS], most)
    s[_HEIGHT] += c[_SHARE] * mean / count
    a, b = fitted_slope(s, c)
    s[_SLOPE] += c[_SLOPE_SHARE] * (a - s[_SLOPE])
    s[_SLOPE + 1] += c[_SLOPE_SHARE] * (b - s[_SLOPE + 1])


@subroutine("void(f8[::1], f8[::1])")
def note_stumble(s, c):
    """Take in that a foot was stopped in its swing."""
    s[_ROUGHNESS] = max(s[_ROUGHNESS], c[_STUMBLE])
