"""The friction of the ground, told by feet that slide.

Of ground on which the robot has not walked yet nothing is known. The estimate begins low there
(``LocomotionConfig.ground_friction``), and rises as it steps and nothing slides: a walk that began
with 0.6 slid at once on a friction of 0.2, and where commands act 10 ms late as well it fell in its
first second. With 0.2 it follows a curve as it begins by 0.03 m/s less exactly, and withstands the
same pushes. A robot that stands on the feet of one side, or of one end, pushes along the ground or
tips over: until a foot has slid it counts on ``MOST_FRICTION``.

A foot that carries load and slides has less friction than it was counted on. While one does, the
estimate falls towards what that foot shows, and otherwise it recovers, slowly:

    mu' = (mu_shown - mu) / T   while a foot slides,    mu' = r   else,    mu <= mu_most
    mu_shown = f_t / f_n / (1 + v / v_half),    mu_least <= mu_shown <= mu

The forces along the ground and into it, ``f_t`` and ``f_n``, are those that the measured torques of
the foot's leg make. Part of ``f_t`` has gone into the leg that slides, not into the ground: more
of it the faster it is. A foot that creeps at the edge of its friction, as one that a push has
overloaded, shows nearly the ratio that it bore, and the estimate hardly falls. To fall towards the
least at every slide took the force away with which the robot would have caught itself.

A foot slides if its contact point has been faster than a speed for some time. Just after touchdown
it may: there the foot still comes to rest. One that chatters while it slides, which on the robot's
own sensors made it fall on a friction of 0.2, has not come down anew: what it has stood passes away
while it does not touch, from twice the time after touchdown on.
"""

from __future__ import annotations

import numpy as np
from jaxtyping import Bool, Float

from go2_wbc.algebra.linear import cross, dot, plus_scaled, triple
from go2_wbc.compilation import Foreign, subroutine
from go2_wbc.records import Record
from go2_wbc.robot.state import Snapshot

SLIP_SPEED, SLIP_PATIENCE = 0.1, 0.004
"""Speed [m/s] of the contact point, along the ground, above which a foot slides, and the time [s]
for which it must. These numbers are from a search on this robot in simulation."""
TOUCHDOWN_MASK = 0.02
"""Time [s] after touchdown in which a foot may slide. At 3 m/s feet that hold slide longer."""
MOST_STEEPNESS = 0.35
"""Greatest ratio of the point's vertical speed to that: a foot that comes off the edge of a step
says nothing of the friction."""
FRICTION_FALL_TIME, FRICTION_RISE = 0.03, 0.1
"""Time constant [s] of the fall, and rate [1/s] of the rise."""
LEAST_FRICTION, MOST_FRICTION = 0.12, 0.6  #: Bounds of the estimate
HALF_SPEED = 0.5
"""Speed [m/s] of a sliding contact point at which the ground bears half of the force along it that
the torques make."""
_TINY = 1e-9  #: Force [N], over a determinant, that stands in for none where one divides by it


class Slip(Record):
    """What the feet have shown."""

    friction: float  #: the estimate
    has_slid: bool
    """Whether a foot has, and has shown less than the greatest estimate, since that was the
    estimate."""
    loaded: Float[np.ndarray, "4"]  #: time [s] for which each foot has stood
    sliding: Float[np.ndarray, "4"]  #: time [s] for which it has slid


@subroutine
def exerted_ratio(now: Snapshot, tau: Foreign[Float[np.ndarray, "12"]], leg: int) -> float:
    """Force of a foot along the ground over that into it, as the torques of its leg make it.

    ``J' f = h - tau`` of the leg's own joints, whose accelerations are left out. Cramer's rule
    gives f up to the determinant, of which a ratio needs only the sign, so that a straight leg does
    no harm. Huge for a foot that does not press on the ground.
    """
    J, first, h = now.J_contacts[leg], 6 + 3 * leg, now.bias
    x = J[0, first], J[1, first], J[2, first]
    y = J[0, first + 1], J[1, first + 1], J[2, first + 1]
    z = J[0, first + 2], J[1, first + 2], J[2, first + 2]
    f = plus_scaled((0.0, 0.0, 0.0), h[first] - tau[3 * leg], cross(y, z))
    f = plus_scaled(f, h[first + 1] - tau[3 * leg + 1], cross(z, x))
    f = plus_scaled(f, h[first + 2] - tau[3 * leg + 2], cross(x, y))
    return np.hypot(f[0], f[1]) / max(f[2] * np.sign(dot(x, cross(y, z))), _TINY)


@subroutine
def observe_slip(
    slip: Slip,
    now: Snapshot,
    contact: Foreign[Bool[np.ndarray, "4"]],
    tau: Foreign[Float[np.ndarray, "12"]],
    stance: Bool[np.ndarray, "4"],
    is_stepping: bool,
    stands_beside_com: bool,
    dt: float,
) -> None:
    """Look at the feet that shall stand, ``dt`` seconds after the last look.

    ``contact`` are the feet in measured contact, ``tau`` [N m] the measured torques.
    """
    if stands_beside_com and not slip.has_slid:
        slip.friction = MOST_FRICTION
    slips, shown = False, MOST_FRICTION
    for leg in range(4):
        v_x, v_y, v_z = triple(now.v_world_contacts[leg])
        speed = np.hypot(v_x, v_y)
        is_level = abs(v_z) <= MOST_STEEPNESS * speed
        loaded = slip.loaded[leg] + dt
        if not contact[leg]:
            loaded = max(min(loaded, 2.0 * TOUCHDOWN_MASK) - 2.0 * dt, 0.0)
        slip.loaded[leg] = loaded if stance[leg] else 0.0
        may_slide = slip.loaded[leg] > TOUCHDOWN_MASK
        slides = may_slide and contact[leg] and speed > SLIP_SPEED and is_level
        if contact[leg] or not may_slide:
            slip.sliding[leg] = slip.sliding[leg] + dt if slides else 0.0
        if slides and slip.sliding[leg] > SLIP_PATIENCE:
            slips = True
            ratio = exerted_ratio(now, tau, leg)
            shown = min(shown, ratio / (1.0 + speed / HALF_SPEED))
    if slips:
        slip.has_slid = slip.has_slid or shown < MOST_FRICTION
        fall = min(max(shown, LEAST_FRICTION) - slip.friction, 0.0)
        slip.friction += fall * min(dt / FRICTION_FALL_TIME, 1.0)
    elif is_stepping:
        slip.friction = min(slip.friction + FRICTION_RISE * dt, MOST_FRICTION)
        slip.has_slid = slip.has_slid and slip.friction < MOST_FRICTION
