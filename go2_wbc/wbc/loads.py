"""How the load is expected to lie on the standing feet.

A foot slips where it is asked for more force along the ground than friction gives, which is in
proportion to its load. So what feet are asked for along the ground is shared in this proportion.

Of all loads that act together at the zero-moment point c, as far as there are any, those nearest to
an even share are taken: with the feet r_i, their mean m and S = sum (r_i - m)(r_i - m)', the load
over its mean is 1 + k (r_i - m)' S^-1 (c - m). It is kept between ``LEAST_LOAD`` and ``MOST_LOAD``.
"""

from __future__ import annotations

import numpy as np
from jaxtyping import Float

from go2_wbc.compilation import subroutine
from go2_wbc.records import Array4
from go2_wbc.reference import STANCE, Target
from go2_wbc.robot.state import Snapshot

LEAST_LOAD, MOST_LOAD = 0.05, 2.0
"""Bounds of a foot's load, over the mean of the standing feet, by which it is spared: own
choice."""
LEAST_PRESSURE = 0.2
"""Share of the weight by which moments are divided at least: the zero-moment point stays near."""
SPREAD = 1e-6
"""[m^2] by which two feet, between which there is no area, count as spread to all sides."""


@subroutine
def share_load(
    places: Float[np.ndarray, "k 2"],
    x: float,
    y: float,
    most: Float[np.ndarray, " k"],
    loads: Float[np.ndarray, " k"],
) -> None:
    """Fill the normal forces of k feet, over their mean.

    Args:
        places: of the feet on the ground [m].
        x, y: the zero-moment point c [m].
        most: what each foot may bear, over the mean.
        loads: is filled.
    """
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


@subroutine
def plan_loads(now: Snapshot, target: Target, weight_of_robot: float, loads: Array4) -> None:
    """Fill the load of each foot, over the mean, while the trunk does what is asked for.

    1 for a foot that does not stand. ``weight_of_robot`` [N] is without what it carries.
    """
    places, most, turn = np.empty((4, 2)), np.empty(4), np.zeros(3)
    k = 0
    for leg in range(4):
        loads[leg] = 1.0
        if target.legs[leg] == STANCE:
            k += 1
    if k == 0:
        return
    R, M, com = now.R_world_base, now.mass_matrix, now.p_world_com
    mass, height = M[0, 0], com[2]
    weight = weight_of_robot + now.payload[1]
    pressure = max(weight + mass * target.a_world[2], LEAST_PRESSURE * weight)
    foot = 0
    for leg in range(4):
        if target.legs[leg] == STANCE:
            p = now.p_world_feet[leg]
            places[foot, 0], places[foot, 1] = p[0], p[1]
            height -= p[2] / k
            most[foot] = target.normal_force_max[leg] * k / pressure
            foot += 1
    for i in range(3):
        moment = 0.0
        for n in range(3):
            for m in range(3):
                rate = R[m, n] * target.dw_world[m]
                moment += M[3 + i, 3 + n] * rate
        turn[i] = moment
    moment_x = R[0, 0] * turn[0] + R[0, 1] * turn[1] + R[0, 2] * turn[2]
    moment_y = R[1, 0] * turn[0] + R[1, 1] * turn[1] + R[1, 2] * turn[2]
    x = com[0] - (mass * height * target.a_world[0] + moment_y) / pressure
    y = com[1] - (mass * height * target.a_world[1] - moment_x) / pressure
    standing = np.empty(k)
    share_load(places[:k], x, y, most[:k], standing)
    foot = 0
    for leg in range(4):
        if target.legs[leg] == STANCE:
            loads[leg] = standing[foot]
            foot += 1
