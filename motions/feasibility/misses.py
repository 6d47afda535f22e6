"""How far a dynamic plan is from what was asked, measured on the plan itself."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float
from scipy.spatial.transform import Rotation

from go2_wbc.legs import LEGS, Leg
from go2_wbc.reference import Anchor
from go2_wbc.robot.model import RobotModel
from go2_wbc.robot.rotations import yaw_rotation
from motions.dynamic_span import DynamicSpan, attitude_angles, feet_at
from motions.dynamics.phases import PhaseProblem
from motions.dynamics.trajectory import DynamicTrajectory

_Places = Float[np.ndarray, "n1 4 3"]


@dataclass(frozen=True, slots=True)
class Misses:
    """Of trunk and feet, at k instants; nan where nothing was asked.

    Attributes:
        times: (k,) after the start of the span [s].
        away: (k, 5) distances [m].
        turned: (k, 5) angles [rad]; of the trunk only.
    """

    times: Float[np.ndarray, " k"]
    away: Float[np.ndarray, "k 5"]
    turned: Float[np.ndarray, "k 5"]


def of_phases(
    plan: DynamicTrajectory, asked: PhaseProblem, frame: Anchor, places: _Places
) -> Misses:
    """What is missed at the ends of phases; whole turns count.

    Args:
        plan: in the frame of the motion.
        asked: in ``frame``.
        frame: of the problem, in that of the motion.
        places: (n+1, 4, 3) of the plan's feet [m].
    """
    R, angles = yaw_rotation(frame.yaw), attitude_angles(plan.q)
    shifts = asked.foot_shifts @ R.T
    ends = np.cumsum([phase.duration for phase in asked.phases])
    away, turned = (np.full((len(ends), 5), np.nan) for _ in range(2))
    nothing: frozenset[Leg] = frozenset()
    following = [*(phase.stance for phase in asked.phases[1:]), nothing]
    for row, (phase, after) in enumerate(zip(asked.phases, following, strict=True)):
        knot = int(np.argmin(np.abs(plan.times - ends[row])))
        for leg in LEGS:
            if leg in phase.feet or leg in after - phase.stance:
                goal = places[0, leg] + shifts[row, leg]
                away[row, 1 + leg] = np.linalg.norm(places[knot, leg] - goal)
        if phase.body is not None:
            p = plan.q[0, :3] + R @ np.array(phase.body[:3])
            away[row, 0] = np.linalg.norm(plan.q[knot, :3] - p)
            turned[row, 0] = np.abs(angles[knot] - angles[0] - phase.body[3:]).max()
    return Misses(ends, away, turned)


def of_written(span: DynamicSpan, places: _Places, model: RobotModel) -> Misses:
    """What the trunk misses at every knot, and the feet where they land.

    Args:
        span: which was asked to do what was written.
        places: (n+1, 4, 3) of its feet [m].
        model: the robot.
    """
    plan = span.trajectory
    wanted = span.written(span.start + plan.times)
    away, turned = (np.full((len(wanted), 5), np.nan) for _ in range(2))
    away[:, 0] = np.linalg.norm(plan.q[:, :3] - wanted[:, :3], axis=1)
    asked, done = (Rotation.from_quat(q[:, 3:7]) for q in (wanted, plan.q))
    turned[:, 0] = (asked.inv() * done).magnitude()
    feet = feet_at(wanted, np.zeros((len(wanted), 18)), model)[0]
    lands = plan.stance[1:] & ~plan.stance[:-1]
    for row, leg in np.argwhere(lands) + [1, 0]:
        away[row, 1 + leg] = np.linalg.norm(places[row, leg] - feet[row, leg])
    return Misses(plan.times, away, turned)
