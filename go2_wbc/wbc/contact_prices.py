"""The price of stopping stance feet that move: the multipliers of their contacts.

With the slope s of cost and limits in the accelerations, the multipliers m of the base's rows and l
of a stance leg's contact, in the blocks and with the numbers of ``condensed``,

    stance leg   s_l + M_bl' m + J_l' l = 0
    base         s_b + M_b' m + sum_stance J_bl' l = 0

As in (3) and (4) l is eliminated. c_l is the acceleration that stops the foot; l'c_l / |c_l| is by
how much the optimal cost falls per unit by which |c_l| is less, negative if it falls.
"""

from __future__ import annotations

import numpy as np
from jaxtyping import Bool, Float

from go2_wbc.algebra.linear import solve_linear, triple
from go2_wbc.compilation import subroutine
from go2_wbc.reference import STANCE, Target
from go2_wbc.robot.state import Snapshot
from go2_wbc.wbc.constraints import StanceFeetStill, left_over
from go2_wbc.wbc.problem import Problem

HASTY = 10.0
"""Acceleration [m/s^2] that damps the velocity of a foot from which on its contact is a limit, as
it is of a foot that slides at 0.5 m/s with the usual ``stance_damping``."""


@subroutine
def is_hasty(now: Snapshot, target: Target, still: StanceFeetStill, leg: int) -> bool:
    """Whether a foot shall stand, but moves."""
    x, y, z = triple(now.v_world_contacts[leg])
    return target.legs[leg] == STANCE and still.damping * np.sqrt(x * x + y * y + z * z) > HASTY


def are_hasty(problem: Problem) -> Bool[np.ndarray, " feet"]:
    """The same of each foot that shall stand."""
    velocities = problem.snapshot.v_world_contacts[problem.stance]
    damping = problem.source(StanceFeetStill).damping
    return np.asarray(damping * np.linalg.norm(velocities, axis=1) > HASTY)


@subroutine
def price_contacts(
    now: Snapshot,
    target: Target,
    still: StanceFeetStill,
    slope: Float[np.ndarray, "18"],
    A: Float[np.ndarray, "6 30"],
    legs: Float[np.ndarray, "12 7"],
    prices: Float[np.ndarray, "4"],
) -> None:
    """Fill the ``prices`` of hasty feet.

    ``A`` has (1) and ``legs`` (3) of ``condensed``.
    """
    system = np.zeros((6, 7))
    for i in range(6):
        system[i, 6] = -slope[i]
        for k in range(6):
            system[i, k] = A[k, i]
        for n in range(12):
            if target.legs[n // 3] == STANCE:
                system[i, 6] -= legs[n, i] * slope[6 + n]
                for k in range(6):
                    system[i, k] += legs[n, i] * A[k, 6 + n]
    if not solve_linear(system, 6):
        return
    for leg in range(4):
        if not is_hasty(now, target, still, leg):
            continue
        x, y, z = left_over(now, still, leg)
        for n in range(3 * leg, 3 * leg + 3):
            value = slope[6 + n]
            for k in range(6):
                value += A[k, 6 + n] * system[k, 6]
            prices[leg] -= legs[n, 6] * value / np.sqrt(x * x + y * y + z * z)
