"""Checks that need no forces: reach, joints, clearance, landings, smoothness and the ends.

Everything is geometry of the ``Trajectory``, in the frame of the motion: z up, ground at z = 0.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from jaxtyping import Float

from go2_wbc.legs import JOINT_NAMES, LEGS, Leg
from go2_wbc.reference import MotionPlan, Posture
from go2_wbc.robot.leg_kinematics import LegGeometry, foot_places
from go2_wbc.robot.model import RobotModel
from motions.feasibility.limits import FeasibilityLimits
from motions.feasibility.report import Series
from motions.tracks import home_poses
from motions.trajectory import Trajectory

BELLY = np.array([[x, y, -0.085] for x in (0.15, -0.15) for y in (0.05, -0.05)])
"""Corners [m] of the trunk's underside in the base frame; lying, the base rests 0.085 m high."""
JOINTS = tuple(name.removesuffix("_joint") for name in JOINT_NAMES)
FEET = tuple(leg.name for leg in LEGS)
FOOT_COLUMNS = slice(2, None, 2)
"""Of the heights: the trunk, then knee and foot of every leg."""
ENDS = ("entry", "exit")
TIGHT_ANGLE, TIGHT_SPEED = 0.03, 0.1
"""Margins below which a warning is due: rad, and share of the least speed limit; own choice."""


def reach(motion: Trajectory, limits: FeasibilityLimits) -> Series:
    """Whether the standing legs reach their feet's places."""
    return _below("reach", "m", FEET, motion, motion.miss, limits.reach)


def joint_position(motion: Trajectory, model: RobotModel) -> Series:
    """Joint angles against the tighter of the URDF's and the published limits."""
    q = motion.q[:, 7:]
    to_lower, to_upper = q - model.q_lower, model.q_upper - q
    bounds = np.where(to_lower < to_upper, model.q_lower, model.q_upper)
    margins = np.minimum(to_lower, to_upper)
    return Series("joint position", "rad", JOINTS, motion.times, q, bounds, margins, TIGHT_ANGLE)


def joint_speed(motion: Trajectory, model: RobotModel) -> Series:
    """Joint speeds against the URDF's limits."""
    speed = np.abs(motion.v[:, 6:])
    bounds = np.tile(model.speed_limits, (len(speed), 1))
    tight = TIGHT_SPEED * float(model.speed_limits.min())
    return Series(
        "joint speed", "rad/s", JOINTS, motion.times, speed, bounds, bounds - speed, tight
    )


def clearance(motion: Trajectory, model: RobotModel, limits: FeasibilityLimits) -> Series:
    """Heights of the trunk's underside, the knees and the feet in the air.

    A point p_b of the base is at z of p + R p_b; knees and feet by the legs' forward kinematics.
    """
    corners = [motion.placed(np.tile(corner, (len(motion.times), 1))) for corner in BELLY]
    heights = [np.min([corner[:, 2] for corner in corners], axis=0)]
    for leg in LEGS:
        geometry = LegGeometry.of(model, leg)
        heights.append(_places(motion, leg, replace(geometry, calf=0.0))[:, 2])
        heights.append(_places(motion, leg, geometry)[:, 2] - model.foot_radius)
    values = np.column_stack(heights)
    floor = np.full_like(values, limits.clearance)
    floor[:, FOOT_COLUMNS] = -limits.swing_depth
    margins = values - floor
    margins[:, FOOT_COLUMNS][motion.stance] = np.nan
    subjects = ("trunk", *(f"{leg.name} {part}" for leg in LEGS for part in ("knee", "foot")))
    return Series("clearance", "m", subjects, motion.times, values, floor, margins)


def dragging(motion: Trajectory, model: RobotModel, limits: FeasibilityLimits) -> Series:
    """Ways [m] that feet in the air go sideways while they are on the ground nevertheless.

    Such a foot is not raised, or moves on before it is put down: it would rub, with forces that the
    plan and this check leave out. The way is summed for as long as the foot stays that low.
    """
    ways = np.zeros((len(motion.times), len(LEGS)))
    for leg in LEGS:
        place = _places(motion, leg, LegGeometry.of(model, leg))
        low = place[:, 2] - model.foot_radius < limits.drag_height
        rubs = low & ~motion.stance[:, leg]
        steps = np.linalg.norm(np.diff(place[:, :2], axis=0), axis=1)
        for row in np.flatnonzero(rubs[1:] & rubs[:-1]):
            ways[row + 1, leg] = ways[row, leg] + steps[row]
    return _below("dragging", "m", FEET, motion, ways, limits.drag)


def landing(
    motion: Trajectory, model: RobotModel, limits: FeasibilityLimits
) -> tuple[Series, Series]:
    """Where and how fast raised feet leave and meet the ground.

    The speed at touchdown is that of the sample before: the central difference at the last one in
    the air already reaches to the foot that stands.
    """
    away = np.full((len(motion.times), 4), np.nan)
    speed = np.full((len(motion.times), 4), np.nan)
    for leg in LEGS:
        place = _places(motion, leg, LegGeometry.of(model, leg))
        pace = np.linalg.norm(np.gradient(place, motion.times, axis=0), axis=1)
        stands = motion.stance[:, leg]
        edges = np.flatnonzero(stands[1:] != stands[:-1])
        for edge in edges:
            row = edge if stands[edge + 1] else edge + 1  # the sample of the flight
            away[row, leg] = np.linalg.norm(place[row] - motion.p_feet[leg])
            speed[row, leg] = pace[max(row - 1, 0)] if stands[edge + 1] else 0.0
    return (
        _below("landing place", "m", FEET, motion, away, limits.landing),
        _below("landing speed", "m/s", FEET, motion, speed, limits.landing_speed),
    )


def smoothness(motion: Trajectory, limits: FeasibilityLimits) -> Series:
    """Jumps of velocity between samples: m/s of the trunk, rad/s of its attitude and the joints.

    A limit on |v_i+1 - v_i|, so on the acceleration over a sample: 400 rad/s^2 of a joint.
    """
    jumps = np.vstack([np.zeros(18), np.abs(np.diff(motion.v, axis=0))])
    values = np.column_stack(
        [jumps[:, :3].max(axis=1), jumps[:, 3:6].max(axis=1), jumps[:, 6:].max(axis=1)]
    )
    bounds = np.tile([limits.body_jump, limits.body_jump, limits.joint_jump], (len(values), 1))
    subjects = ("trunk", "trunk turning", "joints")
    return Series("continuity", "/s", subjects, motion.times, values, bounds, bounds - values)


def ends(
    plan: MotionPlan, motion: Trajectory, model: RobotModel, limits: FeasibilityLimits
) -> Series:
    """Whether the motion starts and ends at rest in the postures that it names."""
    home = home_poses(model)
    names = tuple(f"{end} {what}" for end in ENDS for what in ("place", "attitude", "speed"))
    bounds = [limits.stance_position, limits.stance_angle, limits.end_speed] * 2
    values = []
    for row, posture in ((0, plan.entry), (-1, plan.exit)):
        pose = np.concatenate([motion.q[row, :3], motion.rpy[row]])
        off = pose - home[posture]
        values += [float(np.abs(off[:3]).max()), float(np.abs(off[3:]).max())]
        values.append(float(np.abs(motion.v[row]).max()))
    if plan.entry is Posture.LIE or not motion.stance[0].all():
        values[0] = np.inf
    if not motion.stance[-1].all():
        values[3] = np.inf
    times = np.array([0.0, plan.duration])
    table, limit = np.tile(values, (2, 1)), np.tile(bounds, (2, 1))
    margins = limit - table
    margins[0, 3:], margins[1, :3] = np.nan, np.nan
    return Series("entry and exit", "m, rad", names, times, table, limit, margins)


def _places(motion: Trajectory, leg: Leg, geometry: LegGeometry) -> Float[np.ndarray, "n 3"]:
    """The end of a leg of that ``geometry`` [m] in the frame of the motion."""
    return motion.placed(foot_places(geometry, motion.q[:, 7:][:, leg.joints]))


def _below(
    check: str,
    unit: str,
    subjects: tuple[str, ...],
    motion: Trajectory,
    values: Float[np.ndarray, "n k"],
    limit: float,
) -> Series:
    bounds = np.full_like(values, limit)
    return Series(check, unit, subjects, motion.times, values, bounds, bounds - values)
