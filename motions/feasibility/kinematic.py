"""Checks that need no forces: reach, joints, clearance, landings, smoothness and the ends."""

from __future__ import annotations

import numpy as np
from jaxtyping import Float

from go2_wbc.legs import JOINT_NAMES, LEGS
from go2_wbc.reference import MotionPlan, Posture
from go2_wbc.robot.leg_kinematics import LegGeometry, foot_places
from go2_wbc.robot.model import RobotModel
from motions.feasibility.limits import FeasibilityLimits
from motions.feasibility.report import Series
from motions.tracks import home_poses, rotations
from motions.trajectory import Trajectory

BELLY = np.array([[x, y, -0.085] for x in (0.15, -0.15) for y in (0.05, -0.05)])
"""Corners [m] of the trunk's underside in the base frame; lying, the base rests 0.085 m high."""
JOINTS = tuple(name.removesuffix("_joint") for name in JOINT_NAMES)
FEET = tuple(leg.name for leg in LEGS)


def reach(motion: Trajectory, limits: FeasibilityLimits) -> Series:
    """Whether the standing legs reach their feet's places."""
    return _below("reach", "m", FEET, motion, motion.miss, limits.reach)


def joint_position(motion: Trajectory, model: RobotModel) -> Series:
    """Joint angles against the tighter of the URDF's and the published limits."""
    q = motion.q[:, 7:]
    to_lower, to_upper = q - model.q_lower, model.q_upper - q
    bounds = np.where(to_lower < to_upper, model.q_lower, model.q_upper)
    margins = np.minimum(to_lower, to_upper)
    return Series("joint position", "rad", JOINTS, motion.times, q, bounds, margins, tight=0.03)


def joint_speed(motion: Trajectory, model: RobotModel) -> Series:
    """Joint speeds against the URDF's limits."""
    speed = np.abs(motion.v[:, 6:])
    bounds = np.tile(model.speed_limits, (len(speed), 1))
    tight = 0.1 * float(model.speed_limits.min())
    return Series(
        "joint speed", "rad/s", JOINTS, motion.times, speed, bounds, bounds - speed, tight
    )


def clearance(motion: Trajectory, model: RobotModel, limits: FeasibilityLimits) -> Series:
    """Heights of the trunk's underside, the knees and the feet in the air."""
    R, base = rotations(motion.rpy), motion.q[:, :3]
    belly = (np.einsum("nij,kj->nki", R, BELLY) + base[:, None])[:, :, 2].min(axis=1)
    heights, bounds = [belly], [np.full(len(base), limits.clearance)]
    for leg in LEGS:
        geometry = LegGeometry.of(model, leg)
        q = motion.q[:, 7:][:, leg.joints]
        knee = LegGeometry(geometry.p_base_hip, geometry.width, geometry.thigh, 0.0)
        for point, bound in ((knee, limits.clearance), (geometry, -limits.swing_depth)):
            place = np.einsum("nij,nj->ni", R, foot_places(point, q)) + base
            heights.append(place[:, 2] - (0.0 if point is knee else model.foot_radius))
            bounds.append(np.full(len(base), bound))
    values, floor = np.column_stack(heights), np.column_stack(bounds)
    margins = values - floor
    for leg in LEGS:
        margins[motion.stance[:, leg], 2 + 2 * leg] = np.nan
    subjects = ("trunk", *(f"{leg.name} {part}" for leg in LEGS for part in ("knee", "foot")))
    return Series("clearance", "m", subjects, motion.times, values, floor, margins)


def landing(
    motion: Trajectory, model: RobotModel, limits: FeasibilityLimits
) -> tuple[Series, Series]:
    """Where and how fast raised feet leave and meet the ground."""
    away = np.full((len(motion.times), 4), np.nan)
    speed = np.full((len(motion.times), 4), np.nan)
    R, base = rotations(motion.rpy), motion.q[:, :3]
    for leg in LEGS:
        q = motion.q[:, 7:][:, leg.joints]
        place = np.einsum("nij,nj->ni", R, foot_places(LegGeometry.of(model, leg), q)) + base
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
    """Jumps of velocity between samples: m/s of the trunk, rad/s of its attitude and the joints."""
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
    names = (
        "entry place",
        "entry attitude",
        "entry speed",
        "exit place",
        "exit attitude",
        "exit speed",
    )
    bounds = [limits.stance_position, limits.stance_angle, limits.end_speed] * 2
    values = []
    for row, stance in ((0, plan.entry), (-1, plan.exit)):
        pose = np.concatenate([motion.q[row, :3], motion.rpy[row]])
        off = pose - home[stance]
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
