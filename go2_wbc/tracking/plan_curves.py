"""The reference of a plan at an instant, from its cubics and its contacts, in the motion's frame.

The curves are the body's x, y, z [m] and roll, pitch, yaw [rad], the angles of the twelve joints
[rad], and the positions of the four feet's centres [m]. The trunk's angular velocity and
acceleration are those of Z-Y-X angles (Craig, Introduction to Robotics, 3rd ed., eq. 5.44):

    w = (cos y cos p r' - sin y p',  sin y cos p r' + cos y p',  y' - sin p r')

The load of a stance foot is ramped up from its touchdown, and down to its lift-off.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from go2_wbc.compilation import Foreign, kernel, subroutine
from go2_wbc.contacts import TIE
from go2_wbc.records import packed
from go2_wbc.reference import STANCE, Target

CURVES = 30  #: How many curves a plan has
JOINTS_FROM, FEET_FROM = 6, 18
"""The first curve of the joints, and of the feet; those of the body come before."""


@dataclass(frozen=True, slots=True)
class StanceLoad:
    """Bounds of the normal force of a foot that stands."""

    ramp: float
    """Time [s] over which it takes up its load after touchdown and gives it up before lift-off."""
    least: float  #: bound [N] once it has taken it up
    greatest: float  #: the other one [N]


@dataclass(frozen=True, slots=True)
class PlanCurves:
    """Cubics and a contact schedule."""

    knots: Float[np.ndarray, " k"]
    """(n + 1,) instants [s] between which the curves are cubics, from 0."""
    pieces: Float[np.ndarray, "4 n c"]
    """(4, n, ``CURVES``) their coefficients, the cube's first, of the time since the knot."""
    events: Float[np.ndarray, " m"]  #: (m,) instants [s] at which the legs' tasks change
    tasks: Float[np.ndarray, "m 4"]
    """(m, 4) what the legs do from each event on, values of ``LegTask``."""
    since: Float[np.ndarray, "m 4"]
    """(m, 4) when [s] each foot's contact changed last, where its load is ramped."""
    until: Float[np.ndarray, "m 4"]  #: (m, 4) when [s] it changes next, likewise
    load: StanceLoad  #: of the feet that stand

    def __post_init__(self) -> None:
        """Have the load's numbers in a row."""
        object.__setattr__(self, "load", packed(self.load))

    def at(self, t: float) -> Target:
        """What is asked for at ``t`` [s]; the ends are held."""
        target, tables = Target(), (self.events, self.tasks, self.since, self.until)
        sample(self.knots, self.pieces, *tables, self.load, t, target)
        return target


@kernel
def stand(
    is_com: bool, body: Float[np.ndarray, "3 6"], least: float, greatest: float, target: Target
) -> None:
    """Fill the reference of a trunk over four feet that stand.

    Args:
        is_com: whether the first three components of ``body`` move the CoM, else the base.
        body: x, y, z [m] and roll, pitch, yaw [rad], their rates, and their accelerations.
        least, greatest: bounds [N] of the feet's normal forces.
    """
    target.is_com = is_com
    set_body(body[0], body[1], body[2], target)
    for leg in range(4):
        target.legs[leg] = STANCE
        target.normal_force_min[leg], target.normal_force_max[leg] = least, greatest


@kernel
def sample(
    knots: Foreign[Float[np.ndarray, " k"]],
    pieces: Foreign[Float[np.ndarray, "4 n c"]],
    events: Foreign[Float[np.ndarray, " m"]],
    tasks: Foreign[Float[np.ndarray, "m 4"]],
    since: Foreign[Float[np.ndarray, "m 4"]],
    until: Foreign[Float[np.ndarray, "m 4"]],
    load: StanceLoad,
    t: float,
    target: Target,
) -> None:
    """Fill the reference of ``PlanCurves`` at ``t``."""
    curves = np.zeros((3, CURVES))
    evaluate(knots, pieces, t, curves)
    target.is_com = True
    set_body(curves[0], curves[1], curves[2], target)
    event = max(np.searchsorted(events, t + TIE, side="right") - 1, 0)
    for leg in range(4):
        target.legs[leg] = tasks[event, leg]
        if tasks[event, leg] == STANCE:
            nearest = min(max(t - since[event, leg], 0.0), until[event, leg] - t)
            set_load(leg, nearest, load, target)
        for i in range(3):
            k, n = FEET_FROM + 3 * leg + i, JOINTS_FROM + 3 * leg + i
            target.p_world_feet[leg, i] = curves[0, k]
            target.v_world_feet[leg, i] = curves[1, k]
            target.a_world_feet[leg, i] = curves[2, k]
            target.q_joints[3 * leg + i] = curves[0, n]
            target.v_joints[3 * leg + i] = curves[1, n]
            target.a_joints[3 * leg + i] = curves[2, n]


@subroutine
def evaluate(
    knots: Foreign[Float[np.ndarray, " k"]],
    pieces: Foreign[Float[np.ndarray, "4 n c"]],
    t: float,
    curves: Float[np.ndarray, "3 30"],
) -> None:
    """Fill values, rates and accelerations of cubics; beyond the ends the rates stay 0."""
    inside = min(max(t, 0.0), knots[-1])
    piece = min(np.searchsorted(knots, inside, side="right"), len(knots) - 1) - 1
    s = inside - knots[piece]
    for k in range(CURVES):
        a, b, c = pieces[0, piece, k], pieces[1, piece, k], pieces[2, piece, k]
        curves[0, k] = ((a * s + b) * s + c) * s + pieces[3, piece, k]
        if inside == t:
            curves[1, k] = (3 * a * s + 2 * b) * s + c
            curves[2, k] = 6 * a * s + 2 * b


@subroutine
def set_body(
    value: Float[np.ndarray, " n"],
    rate: Float[np.ndarray, " n"],
    acceleration: Float[np.ndarray, " n"],
    target: Target,
) -> None:
    """Put in the trunk's motion, from x, y, z, roll, pitch, yaw and their derivatives."""
    for i in range(3):
        target.p_world[i], target.v_world[i], target.a_world[i] = value[i], rate[i], acceleration[i]
    cr, sr = np.cos(value[3]), np.sin(value[3])
    cp, sp = np.cos(value[4]), np.sin(value[4])
    cy, sy = np.cos(value[5]), np.sin(value[5])
    R, w, dw = target.R_world_base, target.w_world, target.dw_world
    R[0, 0], R[0, 1], R[0, 2] = cy * cp, cy * sp * sr - sy * cr, cy * sp * cr + sy * sr
    R[1, 0], R[1, 1], R[1, 2] = sy * cp, sy * sp * sr + cy * cr, sy * sp * cr - cy * sr
    R[2, 0], R[2, 1], R[2, 2] = -sp, cp * sr, cp * cr
    dr, dp, dy = rate[3], rate[4], rate[5]
    ddr, ddp, ddy = acceleration[3], acceleration[4], acceleration[5]
    w[0], w[1], w[2] = cy * cp * dr - sy * dp, sy * cp * dr + cy * dp, dy - sp * dr
    dw[0] = cy * cp * ddr - sy * ddp - (sy * dy * cp + cy * sp * dp) * dr - cy * dy * dp
    dw[1] = sy * cp * ddr + cy * ddp + (cy * dy * cp - sy * sp * dp) * dr - sy * dy * dp
    dw[2] = ddy - sp * ddr - cp * dp * dr


@subroutine
def set_load(leg: int, nearest: float, load: StanceLoad, target: Target) -> None:
    """Bound the force of a foot whose contact changes, or has changed, ``nearest`` seconds away."""
    share = min(max(nearest / max(load.ramp, TIE), 0.0), 1.0)
    target.normal_force_min[leg] = load.least * share
    target.normal_force_max[leg] = load.greatest * share
