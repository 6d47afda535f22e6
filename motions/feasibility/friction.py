"""Checks of friction: how much the motion needs, and how far feet slide on what there is.

Friction is a cone, |f_t| <= mu f_z, here a pyramid of ``FACETS`` facets inside of it (2 % less).
Two questions are asked:

- With which least coefficient can the feet give what the trunk needs, however the load is shared?
  With less, no controller can keep to the plan.
- How far do the feet slide when the load is shared as the whole-body controller shares it? It asks
  each foot for much the same force along the ground, so one that bears little may slide though the
  others could hold; and a short slip moves little. Each foot is a block on the ground (Newmark
  1965, *Effects of earthquakes on dams and embankments*): what exceeds friction accelerates it, and
  friction stops it. How heavy that block is, and how much the joints hold it, was fitted to motions
  in MuJoCo (``FOOT_MASS``, ``HELD``): a foot with 5 N on it that lacks 2 N hardly slides.

Where a leg turns fast, a foot creeps as well, however rough the ground is. A constraint of MuJoCo
asks for J a = -b J v (Todorov, *Convex and analytically-invertible dynamics with contacts and
constraints*, ICRA 2014) and leaves out the derivative of J. What is left out moves the foot at the
speed dJ/dt v / b, and as the plan's feet rest, dJ/dt v = -J a. Fast rocking makes 13 mm of it.
"""

from __future__ import annotations

import numpy as np
from jaxtyping import Bool, Float

from go2_wbc.feasibility_limits import FeasibilityLimits
from go2_wbc.robot.leg_kinematics import leg_table
from go2_wbc.robot.model import RobotModel
from go2_wbc.wbc.trajectory_loads import accelerate, least_friction, slide
from motions.batch_kinematics import attitudes
from motions.feasibility.forces import (
    ARM,
    PRESSED,
    TIGHT_FRICTION,
    Forces,
    numbers_of,
    scale_of_wrench,
)
from motions.feasibility.kinematic import FEET
from motions.feasibility.report import Series
from motions.plan.trajectory import Trajectory

FACETS = 16
"""Of the cone."""
NEAR = 0.8
"""Share of the limit up to which the controller's own share of the load is looked at, no better."""
MOST = 1.5
"""Friction coefficient above which none is looked for: rubber on dry concrete has 1."""
FOOT_MASS, HELD = 1.0, 0.5
"""Mass [kg] of the block that a sliding foot is, and the force [N] along the ground by which the
dry friction of its joints holds it, 0.2 N m on an arm of 0.3 m or so: with them 10 mm of slip in
1,400 generated motions (seeds that judge nothing) are told best. A leg weighs 2.2 kg."""
CREEP = 145.0
"""Rate b [1/s] at which a contact of MuJoCo stops a foot: 105 by its numbers (2 / 0.95 / 0.02 s);
more, as trunks lag their plan. Own choice, seen on motions that judge nothing."""
SETTLED = 0.1
"""Time [s] after a touchdown, and before a lift-off, in which a foot without load may skid."""
TIGHT_SLIP = 0.003
"""Margin [m] below which a warning is due: own choice."""


def friction(
    motion: Trajectory, forces: Forces, model: RobotModel, limits: FeasibilityLimits, floor: float
) -> Series:
    """The least friction coefficient with which the feet can give what the trunk needs.

    ``floor``: that of the floor. Below ``NEAR`` of it the value is that of the controller's share
    of the load, which is no less.
    """
    values = _least(motion, forces, model, limits, floor)
    written = ~motion.is_dynamic & motion.stance.any(axis=1)
    what = ("friction", "", ("feet",), motion.times, values[:, None])
    return Series.against(*what, floor, where=written[:, None], tight=TIGHT_FRICTION)


def slip(
    motion: Trajectory, forces: Forces, model: RobotModel, limits: FeasibilityLimits, floor: float
) -> Series:
    """How far each foot slides and creeps while it stands [m], on the friction ``floor``."""
    counts = _settled(motion) & ~motion.is_dynamic[:, None]
    dt = float(motion.times[-1] - motion.times[0]) / max(len(motion.times) - 1, 1)
    ways = np.zeros(counts.shape)
    held = forces.contact + [0.0, 0.0, HELD / floor]  # as a load of that size would
    slide(held, creep(motion, model), counts, floor, FOOT_MASS, dt, ways)
    what = ("slip", "m", FEET, motion.times, ways)
    return Series.against(*what, limits.slip, where=counts, tight=TIGHT_SLIP)


def creep(motion: Trajectory, model: RobotModel) -> Float[np.ndarray, "n 4 2"]:
    """Speed [m/s] along the ground at which standing feet creep, by the rows of MuJoCo's contacts.

    That is -J a / ``CREEP`` of the contact points.
    """
    J_a = np.empty((len(motion.times), 4, 2))
    joints, a = np.array(motion.q[:, 7:], order="C"), np.array(motion.a, order="C")
    accelerate(joints, attitudes(motion.rpy), a, leg_table(model), model.foot_radius, J_a)
    return -J_a / CREEP


def cone(facets: int = FACETS) -> Float[np.ndarray, "k 3"]:
    """Rows of a pyramid inside the cone of coefficient 1 (at most 0), and of the normal force."""
    angles = 2.0 * np.pi * np.arange(facets) / facets
    inside = np.full(facets, -np.cos(np.pi / facets))
    sides = np.column_stack([np.cos(angles), np.sin(angles), inside])
    return np.vstack([sides, [0.0, 0.0, 1.0]])


def _least(
    motion: Trajectory, forces: Forces, model: RobotModel, limits: FeasibilityLimits, floor: float
) -> Float[np.ndarray, " n"]:
    normal = forces.contact[:, :, 2]
    along = np.linalg.norm(forces.contact[:, :, :2], axis=2)
    values = np.where(normal > PRESSED, along / np.maximum(normal, PRESSED), 0.0).max(axis=1)
    missing = np.hypot(forces.missing[:, 0], forces.missing[:, 1] / ARM)
    is_given = missing <= limits.wrench
    highest = np.where(is_given, values, MOST)
    highest[(highest < NEAR * floor) | motion.is_dynamic] = 0.0
    joints, load_share = (np.array(a, order="C") for a in (motion.q[:, 7:], motion.load_share))
    given = (joints, attitudes(motion.rpy), forces.wrench, load_share, leg_table(model), cone())
    what = (scale_of_wrench(), numbers_of(model), highest, limits.wrench)
    least_friction(*given, *what, values)
    return values


def _settled(motion: Trajectory) -> Bool[np.ndarray, "n 4"]:
    """Where feet stand, and have stood and will stand for ``SETTLED``; the motion's ends count."""
    stands = motion.stance.copy()
    for edge, leg in np.argwhere(motion.stance[1:] != motion.stance[:-1]):
        stands[np.abs(motion.times - motion.times[edge]) < SETTLED, leg] = False
    return stands
