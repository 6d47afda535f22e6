"""Joints that are asked to go beyond their stops, and what that takes from a plan.

A joint stays at its stop. A raised foot is off by that: one that follows its place goes to the
nearest one. The feet of standing legs do not move, so there the trunk is off. The controller holds
its attitude far more firmly than its place: 0.1 rad of roll weigh as much as 0.5 m. So it keeps its
attitude, and is where all standing legs keep their ranges, as near to its plan as that is:

    min  p' K p    such that    q_low <= q(p) <= q_up

of all joints of standing legs, with the place p of the trunk from its plan, the gains K of that and
the legs' inverse kinematics q(p). Constraints are met one after the other, each by moving along its
normal, and let go by as much as they did before (Hildreth, *A quadratic programming procedure*,
Naval Research Logistics Quarterly 1957; for intervals Lent & Censor 1980), q(p) linear near p.
"""

from __future__ import annotations

import numpy as np
from jaxtyping import Bool, Float

from go2_wbc.legs import LEGS
from go2_wbc.robot.leg_kinematics import LegGeometry, foot_places, leg_angles
from go2_wbc.robot.model import RobotModel
from go2_wbc.wbc.config import Gains, WbcConfig
from motions.batch_kinematics import attitudes
from motions.feasibility.forces import JOINTS, Case
from motions.feasibility.report import Series

PAIR = 2  #: Standing feet over which a trunk can fall to its side
TIGHT_ANGLE = 0.03  #: Margin [rad] below which a warning is due; own choice
ROUNDS = 12  #: In which every constraint is met once; more move the trunk by less than 0.2 mm


def joint_position(case: Case) -> Series:
    """Joint angles against the tighter of the URDF's and the published limits.

    A joint that is asked to go beyond its stop stays at it. Where its foot, or the trunk over a
    standing one, is off by no more than ``limits.stop`` for it, the margin counts as 0: a warning.
    Hips of two standing legs keep ``limits.pair_hip`` to their stops: a trunk that rolls late needs
    them, and no third foot holds it. Farther beyond, a joint counts as far as a stretched knee that
    displaces by as much, if that is more: 0.1 rad of a hip do as 0.3 of a knee.
    """
    motion, model, limits = case.path, case.model, case.limits
    q, stands, room = motion.q[:, 7:], motion.stance, np.zeros((len(motion.times), 12))
    held = stands & (stands.sum(axis=1) <= PAIR)[:, None] & ~motion.is_dynamic[:, None]
    room[:, ::3] = limits.pair_hip * held
    lower, upper = model.q_lower + room, model.q_upper - room
    to_lower, to_upper = q - lower, upper - q
    bounds = np.where(to_lower < to_upper, lower, upper)
    margins = np.minimum(to_lower, to_upper)
    off, beyond = np.zeros(stands.shape), (margins < 0.0).any(axis=1)
    off[beyond] = _displaced(q[beyond], stands[beyond], motion.swings[beyond], model)
    is_near = (off <= limits.stop) & ~(held & (margins[:, ::3] < 0.0))
    near, far = (np.repeat(x, 3, axis=1) for x in (is_near, off / _stretching(model)))
    counted = np.where(near, 0.0, np.minimum(margins, -far))
    margins = np.where(margins < 0.0, counted, margins)
    return Series("joint position", "rad", JOINTS, motion.times, q, bounds, margins, TIGHT_ANGLE)


def sinking(case: Case) -> Float[np.ndarray, " n"]:
    """How much lower [m] the trunk is at each sample, as joints of standing legs stay at stops."""
    motion, model = case.path, case.model
    q, lower = motion.q[:, 7:], np.zeros(len(motion.times))
    beyond = np.flatnonzero(((q < model.q_lower) | (q > model.q_upper)).any(axis=1))
    if len(beyond):
        asked = np.stack([foot_places(*one) for one in _legs(q[beyond], model)], 1)
        p = trunk_at_stops(asked, motion.stance[beyond], WbcConfig().body_position, model)
        lower[beyond] = np.maximum(-(attitudes(motion.rpy[beyond])[:, 2] * p).sum(axis=1), 0.0)
    return lower


def _stretching(model: RobotModel) -> float:
    """By how much [m/rad] a knee at its stop moves the foot away from the hip."""
    leg, stop = LegGeometry.of(model, LEGS[0]), model.q_upper[2]
    both = leg.thigh * leg.calf
    return float(
        -both * np.sin(stop) / np.sqrt(leg.thigh**2 + leg.calf**2 + 2.0 * both * np.cos(stop))
    )


def _displaced(
    q: Float[np.ndarray, "k 12"],
    stance: Bool[np.ndarray, "k 4"],
    swings: Bool[np.ndarray, "k 4"],
    model: RobotModel,
) -> Float[np.ndarray, "k 4"]:
    """How far each foot, or the trunk over it [m], is off if joints stay at their stops.

    A foot that follows its place goes to the nearest one; one that follows its joints keeps those
    that are not at their stops.
    """
    config = WbcConfig()
    kept = np.clip(q, model.q_lower, model.q_upper)
    asked, left = (np.stack([foot_places(*one) for one in _legs(x, model)], 1) for x in (q, kept))
    trunk = trunk_at_stops(asked, stance, config.body_position, model)
    off = np.where(stance[:, :, None], trunk[:, None], asked - left)
    for leg in LEGS:
        alone = swings & (np.arange(len(LEGS)) == leg)
        if alone.any():
            nearest = trunk_at_stops(asked, alone, config.swing_foot, model)
            off[swings[:, leg], leg] = nearest[swings[:, leg]]
    return np.linalg.norm(off, axis=2)


def _legs(
    q: Float[np.ndarray, "k 12"], model: RobotModel
) -> list[tuple[LegGeometry, Float[np.ndarray, "k 3"]]]:
    return [(LegGeometry.of(model, leg), q[:, leg.joints]) for leg in LEGS]


def trunk_at_stops(
    p_base_feet: Float[np.ndarray, "k 4 3"],
    stance: Bool[np.ndarray, "k 4"],
    gains: Gains,
    model: RobotModel,
) -> Float[np.ndarray, "k 3"]:
    """Where the trunk is [m], from where it should be, in its frame.

    ``p_base_feet``: places (k, 4, 3) of the feet [m] in the planned frame of the trunk, of which
    those of ``stance`` (k, 4) stand; ``gains`` pull the trunk back to its place. A foot that goes
    to the nearest place itself goes there by as much, the other way.
    """
    count, yields = len(stance), 1.0 / gains.arrays[0]
    p, normals, pulls = np.zeros((count, 3)), np.zeros((count, 12, 3)), np.zeros((count, 12))
    for _ in range(ROUNDS):
        for leg in (leg for leg in LEGS if stance[:, leg].any()):
            geometry, stands = LegGeometry.of(model, leg), stance[:, leg]
            lower, upper = model.q_lower[leg.joints], model.q_upper[leg.joints]
            q = leg_angles(geometry, p_base_feet[:, leg] - p).q
            turns = -np.linalg.pinv(_jacobian(geometry, np.clip(q, lower, upper)))
            normals[:, leg.joints] = yields * turns
            start, p = p, (normals * pulls[:, :, None]).sum(axis=1)
            for i, joint in enumerate(range(leg.joints.start, leg.joints.stop)):
                now = q[:, i] + ((p - start) * turns[:, i]).sum(axis=1)
                size = (turns[:, i] * normals[:, joint]).sum(axis=1)
                least, most = (lower[i] - now) / size, (upper[i] - now) / size
                pull = np.where(stands, np.clip(-pulls[:, joint], least, most), 0.0)
                p += pull[:, None] * normals[:, joint]
                pulls[:, joint] += pull
    return p


def _jacobian(geometry: LegGeometry, q: Float[np.ndarray, "k 3"]) -> Float[np.ndarray, "k 3 3"]:
    """d ``foot_places`` / d q, of legs that are neither stretched nor beside their hip."""
    s, c = np.sin(q[:, 0]), np.cos(q[:, 0])
    x, y, z = (foot_places(geometry, q) - geometry.p_base_hip).T
    ahead = geometry.calf * np.cos(q[:, 1] + q[:, 2])
    up = geometry.calf * np.sin(q[:, 1] + q[:, 2])
    down = s * y - c * z
    J = np.array([[0.0 * x, -down, -ahead], [-z, s * x, -s * up], [y, -c * x, c * up]])
    return J.transpose(2, 0, 1)
