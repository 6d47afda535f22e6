"""How the load is expected to lie on the standing feet; ``kernels.standing`` says the same.

A foot slips where it is asked for more force along the ground than friction gives, which is in
proportion to its load. So what feet are asked for along the ground is shared in this proportion.
"""

from __future__ import annotations

import numpy as np
from jaxtyping import Float

from go2_wbc.kernels.layout import LEAST_LOAD, LEAST_PRESSURE, MOST_LOAD, SPREAD
from go2_wbc.reference import Reference
from go2_wbc.robot.snapshot import Snapshot


def relative_loads(
    places: Float[np.ndarray, "k 2"], point: Float[np.ndarray, "2"], most: Float[np.ndarray, " k"]
) -> Float[np.ndarray, " k"]:
    """Normal forces of k feet, over their mean.

    Of all that act together at the zero-moment point c, as far as there are any, those nearest to
    an even share: with the feet r_i, their mean m and S = sum (r_i - m)(r_i - m)', the load over
    its mean is 1 + k (r_i - m)' S^-1 (c - m). Kept between ``LEAST_LOAD`` and ``MOST_LOAD``.

    Args:
        places: of the feet on the ground [m].
        point: the zero-moment point c [m].
        most: what each foot may bear, over the mean.
    """
    arms = places - places.mean(axis=0)
    S = arms.T @ arms + SPREAD * np.eye(2)
    loads = 1.0 + len(places) * arms @ np.linalg.solve(S, point - places.mean(axis=0))
    return np.clip(np.minimum(loads, most), LEAST_LOAD, MOST_LOAD)


def planned_loads(
    snapshot: Snapshot, reference: Reference, weight_of_robot: float
) -> Float[np.ndarray, " k"]:
    """Loads of the standing feet, over their mean, while the trunk does what is asked for."""
    stance = np.flatnonzero(reference.stance)
    feet, M, body = snapshot.p_world_feet[stance], snapshot.mass_matrix, reference.body
    R, com = snapshot.R_world_base, snapshot.p_world_com
    mass = M[0, 0]
    weight_of_robot += snapshot.payload[1]
    moment = R @ M[3:6, 3:6] @ R.T @ body.dw_world
    pressure = max(weight_of_robot + mass * body.a_world[2], LEAST_PRESSURE * weight_of_robot)
    push = mass * (com[2] - feet[:, 2].mean()) * body.a_world
    point = com[:2] - np.array([push[0] + moment[1], push[1] - moment[0]]) / pressure
    most = reference.normal_force_max[stance] * len(stance) / pressure
    return relative_loads(feet[:, :2], point, most)
