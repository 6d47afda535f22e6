"""The expected load of standing feet as kernels; ``wbc.loads`` is the readable form."""

from __future__ import annotations

import numpy as np

from go2_wbc.kernels.compilation import subroutine
from go2_wbc.kernels.layout import (
    LEAST_LOAD,
    LEAST_PRESSURE,
    MOST_LOAD,
    REFERENCE,
    SNAPSHOT,
    SPREAD,
)

_R, _M, _COM, _FEET = (
    SNAPSHOT.start[n] for n in ("R_world_base", "mass_matrix", "p_world_com", "p_world_feet")
)
_CARRIED = SNAPSHOT.start["payload"] + 1
"""Weight of the payload [N]."""
_A, _DW, _MOST = (REFERENCE.start[n] for n in ("a_world", "dw_world", "normal_force_max"))


@subroutine("void(f8[:,::1], f8, f8, f8[::1], f8[::1])")
def relative_loads(places, x, y, most, loads):
    """Fill the loads, over their mean, of feet at ``places`` for a zero-moment point at (x, y)."""
    k = len(loads)
    mx, my, xx, xy, yy = 0.0, 0.0, SPREAD, 0.0, SPREAD
    for foot in range(k):
        mx += places[foot, 0] / k
        my += places[foot, 1] / k
    for foot in range(k):
        dx, dy = places[foot, 0] - mx, places[foot, 1] - my
        xx, xy, yy = xx + dx * dx, xy + dx * dy, yy + dy * dy
    determinant = xx * yy - xy * xy
    slope_x = (yy * (x - mx) - xy * (y - my)) / determinant
    slope_y = (xx * (y - my) - xy * (x - mx)) / determinant
    for foot in range(k):
        dx, dy = places[foot, 0] - mx, places[foot, 1] - my
        load = min(1.0 + k * (dx * slope_x + dy * slope_y), most[foot])
        loads[foot] = min(max(load, LEAST_LOAD), MOST_LOAD)


@subroutine("void(f8[::1], f8[::1], f8, i8[::1], f8[::1])")
def planned_loads(snapshot, target, weight_of_robot, stance, loads):
    """Fill the loads, over their mean, of the feet ``stance`` under what the trunk is to do."""
    k = len(stance)
    R = snapshot[_R : _R + 9].reshape(3, 3)
    places, most, turn = np.empty((k, 2)), np.empty(k), np.zeros(3)
    mass, height = snapshot[_M], snapshot[_COM + 2]
    weight_of_robot += snapshot[_CARRIED]
    pressure = weight_of_robot + mass * target[_A + 2]
    pressure = max(pressure, LEAST_PRESSURE * weight_of_robot)
    for foot in range(k):
        leg = stance[foot]
        places[foot, 0], places[foot, 1] = snapshot[_FEET + 3 * leg], snapshot[_FEET + 3 * leg + 1]
        height -= snapshot[_FEET + 3 * leg + 2] / k
        most[foot] = target[_MOST + leg] * k / pressure
    for i in range(3):
        moment = 0.0
        for n in range(3):
            for m in range(3):
                rate = R[m, n] * target[_DW + m]
                moment += snapshot[_M + 18 * (3 + i) + 3 + n] * rate
        turn[i] = moment
    moment_x = R[0, 0] * turn[0] + R[0, 1] * turn[1] + R[0, 2] * turn[2]
    moment_y = R[1, 0] * turn[0] + R[1, 1] * turn[1] + R[1, 2] * turn[2]
    x = snapshot[_COM] - (mass * height * target[_A] + moment_y) / pressure
    y = snapshot[_COM + 1] - (mass * height * target[_A + 1] - moment_x) / pressure
    relative_loads(places, x, y, most, loads)
