"""The instants at which a dynamic motion is solved: what stands, what is asked, a first guess.

The guess is kinematic: the trunk goes through the poses of the phases, in flight along a parabola,
the feet from one place to the next, and the legs' angles follow from both.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import pinocchio as pin
from jaxtyping import Bool, Float
from scipy.interpolate import CubicHermiteSpline, PchipInterpolator

from go2_wbc.legs import LEGS
from go2_wbc.recording import true_runs
from go2_wbc.reference import Anchor
from go2_wbc.robot.leg_kinematics import LegGeometry, leg_angles
from go2_wbc.robot.model import RobotModel
from go2_wbc.robot.rotations import rpy_from_rotation, yaw_rotation
from motions.batch_kinematics import attitudes, configurations, foot_centres, turned_back
from motions.dynamics.phases import GRAVITY, KNOT_PERIOD, FullState, Phase, PhaseProblem
from motions.dynamics.plan_audit import PlanLimits
from motions.postures import standing_feet, standing_on

LEAD = 0.2
"""Share of a flight's way by which the trunk is ahead of the feet at take-off, and behind them at
touchdown, in the first guess."""
STANDING_TURN = 1e-3
"""Share of a turn's pace, of that with feet in the air, at which the trunk turns on four feet."""


@dataclass(frozen=True, slots=True)
class Goal:
    """What is asked at one knot."""

    knot: int  #: which
    label: str  #: of the phase that ends there
    pose: Float[np.ndarray, "6"] | None
    """(6,) trunk: place [m] and roll, pitch, yaw [rad]; or ``None``."""
    p_feet: Float[np.ndarray, "4 3"]  #: (4, 3) places [m]
    asked: Bool[np.ndarray, "4"]  #: (4,) feet whose places are asked
    lands: Bool[np.ndarray, "4"]  #: (4,) feet that touch down there


@dataclass(frozen=True, slots=True)
class Knots:
    """A problem at its n + 1 knots; rows of what has n hold from one knot to the next."""

    times: Float[np.ndarray, " n1"]  #: (n+1,) [s]
    stance: Bool[np.ndarray, "n 4"]  #: (n, 4) feet that stand
    p_stance: Float[np.ndarray, "n 4 3"]  #: (n, 4, 3) where those that stand do [m]
    goals: tuple[Goal, ...]  #: what the phases ask, by knots
    clearance: Float[np.ndarray, "n1 4"]  #: (n+1, 4) least height [m] of each foot's centre
    q: Float[np.ndarray, "n1 19"]  #: (n+1, 19) the first guess
    v: Float[np.ndarray, "n1 18"]  #: (n+1, 18) its velocities
    initial: FullState  #: the state at the start
    final: FullState  #: the state at the end


@dataclass(frozen=True, slots=True)
class Solution:
    """A solution at its knots: states, torques, forces, gains, and what it took."""

    x: Float[np.ndarray, "n1 37"]
    tau: Float[np.ndarray, "n 12"]
    forces: Float[np.ndarray, "n 4 3"]
    gains: Float[np.ndarray, "n 12 36"]
    iterations: int
    cost: float


def knots_of(problem: PhaseProblem, model: RobotModel, limits: PlanLimits) -> Knots:
    """``problem`` at its knots."""
    initial = problem.initial or standing(model, standing_feet(model))
    _, p_feet = model.forward_kinematics(initial.q)
    final = problem.final or standing(model, p_feet + problem.shift)
    counts = [max(round(phase.duration / KNOT_PERIOD), 1) for phase in problem.phases]
    ends = np.cumsum(counts)
    pieces = [
        np.linspace(0.0, phase.duration, count + 1)[1:]
        for phase, count in zip(problem.phases, counts, strict=True)
    ]
    starts = np.cumsum([0.0, *(phase.duration for phase in problem.phases)])
    times = np.concatenate([[0.0], *(t0 + t for t0, t in zip(starts, pieces, strict=False))])
    stance = np.repeat(_standing(problem.phases), counts, axis=0)
    goals = _goals(problem, ends.tolist(), initial, p_feet)
    poses = _trunk_path(times, goals, stance, (initial, final), p_feet)
    feet = _foot_paths(times, goals, stance, poses, p_feet, model)
    q = _configurations(poses, feet, model, limits)
    q[0], q[-1] = initial.q, final.q
    return Knots(
        times=times,
        stance=stance,
        p_stance=p_feet + np.repeat(problem.foot_shifts, counts, axis=0),
        goals=goals,
        clearance=_clearances(stance, model, limits),
        q=q,
        v=guess_velocities(q, times, model),
        initial=initial,
        final=final,
    )


def standing(model: RobotModel, p_feet: Float[np.ndarray, "4 3"]) -> FullState:
    """Standing at rest on feet at ``p_feet`` [m]: CoM above their middle, trunk along them."""
    anchor = Anchor.of_feet(p_feet, model.foot_radius)
    p_com, R = anchor.p_world + model.profile.stand_pose[:3], yaw_rotation(anchor.yaw)
    p_base, joints = standing_on(p_feet, p_com, R, model)
    pose = np.concatenate([p_base, [0.0, 0.0, anchor.yaw]])
    return FullState(configurations(pose[None], joints[None])[0], np.zeros(18))


def _standing(phases: tuple[Phase, ...]) -> Bool[np.ndarray, "n 4"]:
    return np.array([[leg in phase.stance for leg in LEGS] for phase in phases])


def _goals(
    problem: PhaseProblem, ends: list[int], initial: FullState, p_feet: Float[np.ndarray, "4 3"]
) -> tuple[Goal, ...]:
    stands = _standing((*problem.phases, problem.phases[-1]))
    base = pose_of(initial.q)
    goals = []
    for row, (phase, shift) in enumerate(zip(problem.phases, problem.foot_shifts, strict=True)):
        lands = stands[row + 1] & ~stands[row]
        asked = np.array([leg in phase.feet for leg in LEGS]) | lands
        pose = None if phase.body is None else base + np.array(phase.body)
        goals.append(Goal(ends[row], phase.label, pose, p_feet + shift, asked, lands))
    return tuple(goals)


def pose_of(q: Float[np.ndarray, "19"]) -> Float[np.ndarray, "6"]:
    """Place [m] and roll, pitch, yaw [rad] of the trunk at configuration ``q``."""
    R = pin.Quaternion(q[3:7]).toRotationMatrix()
    return np.concatenate([q[:3], rpy_from_rotation(R)])


def _trunk_path(
    times: Float[np.ndarray, " n1"],
    goals: tuple[Goal, ...],
    stance: Bool[np.ndarray, "n 4"],
    ends: tuple[FullState, FullState],
    p_feet: Float[np.ndarray, "4 3"],
) -> Float[np.ndarray, "n1 6"]:
    """Through the poses that are asked, over the feet where none is, and ballistic in flight.

    In a flight the feet go farther than the trunk, which is ahead of them at take-off and behind
    them at touchdown.
    """
    first, last = (pose_of(state.q) for state in ends)
    origin = Anchor.of_feet(p_feet, 0.0)
    flights = [(run.start, run.stop) for run in true_runs(np.logical_not(stance.any(axis=1)))]
    edges = {knot for span in flights for knot in span}
    known = [goal for goal in goals if goal.pose is not None or goal.knot in edges]
    known += [goals[-1]] if goals[-1] not in known else []
    keys = [0, *(goal.knot for goal in known)]
    table = np.array([first, *(_over_feet(first, origin, goal.p_feet) for goal in known)])
    if goals[-1].pose is None:
        table[-1] = last
    pace = np.where(stance.all(axis=1), STANDING_TURN, 1.0)  # feet in the air let it turn far
    clock = np.concatenate([[0.0], np.cumsum(pace * np.diff(times))])[keys]
    table[:, 5] = _headings(table[:, 5], [goal.pose for goal in known], clock)
    for begin, end in flights:
        rows = [keys.index(begin), keys.index(end)]
        lead = LEAD * (table[rows[1]] - table[rows[0]])
        table[rows] += np.array([lead, -lead])
    for row, goal in enumerate(known, start=1):
        if goal.pose is not None:
            table[row] = goal.pose
    slopes = PchipInterpolator(times[keys], table).derivative()(times[keys])
    slopes[[0, -1]] = 0.0
    for begin, end in flights:
        rows = [keys.index(begin), keys.index(end)]
        inside = slice(rows[0], rows[1] + 1)
        t = times[np.array(keys)[inside]] - times[begin]
        share = (t / t[-1])[:, None]
        table[inside] = (1.0 - share) * table[rows[0]] + share * table[rows[1]]
        table[inside, 2] += 0.5 * GRAVITY * t * (t[-1] - t)
        slopes[inside] = (table[rows[1]] - table[rows[0]]) / t[-1]
        slopes[inside, 2] += 0.5 * GRAVITY * (t[-1] - 2.0 * t)
    return CubicHermiteSpline(times[keys], table, slopes)(times)


def _headings(
    over_feet: Float[np.ndarray, " k"],
    poses: Sequence[Float[np.ndarray, "6"] | None],
    clock: Float[np.ndarray, " k"],
) -> Float[np.ndarray, " k"]:
    """The asked yaw [rad] as it stands, so that 360 deg is a turn; elsewhere that of the feet.

    Whole turns are added to the latter so that they lead from one that is asked to the next.
    ``poses`` are those of all rows but the first.
    """
    yaw, is_asked = over_feet.copy(), np.array([True, *(pose is not None for pose in poses)])
    yaw[is_asked] = [over_feet[0], *(pose[5] for pose in poses if pose is not None)]
    expected = np.interp(clock, clock[is_asked], yaw[is_asked])
    for row in np.flatnonzero(~is_asked).tolist():
        off = (yaw[row] - expected[row]) - (yaw[row - 1] - expected[row - 1])
        yaw[row] -= 2.0 * np.pi * np.round(off / (2.0 * np.pi))
    return yaw


def _over_feet(
    first: Float[np.ndarray, "6"], origin: Anchor, p_feet: Float[np.ndarray, "4 3"]
) -> Float[np.ndarray, "6"]:
    """The first pose, moved as the feet have moved."""
    here = Anchor.of_feet(p_feet, 0.0)
    pose = first.copy()
    pose[:2] += here.p_world[:2] - origin.p_world[:2]
    pose[5] += here.yaw - origin.yaw
    return pose


def _foot_paths(
    times: Float[np.ndarray, " n1"],
    goals: tuple[Goal, ...],
    stance: Bool[np.ndarray, "n 4"],
    poses: Float[np.ndarray, "n1 6"],
    p_feet: Float[np.ndarray, "4 3"],
    model: RobotModel,
) -> Float[np.ndarray, "n1 4 3"]:
    """From one place to the next; a foot in the air without one hangs below the trunk."""
    R = attitudes(poses[:, 3:])
    home = (p_feet - poses[0, :3]) @ R[0]
    paths = np.empty((len(times), 4, 3))
    for leg in LEGS:
        keys, places = [0], [p_feet[leg]]
        for goal in goals:
            is_free = not stance[goal.knot - 1, leg] and not goal.asked[leg]
            hangs = poses[goal.knot, :3] + R[goal.knot] @ home[leg]
            keys.append(goal.knot)
            places.append(hangs if is_free else goal.p_feet[leg])
        paths[:, leg] = PchipInterpolator(times[keys], np.array(places))(times)
    return paths


def _clearances(
    stance: Bool[np.ndarray, "n 4"], model: RobotModel, limits: PlanLimits
) -> Float[np.ndarray, "n1 4"]:
    """The least heights of the feet's centres: on the ground, and higher once under way."""
    least = np.full((len(stance) + 1, 4), model.foot_radius)
    for leg in LEGS:
        for flight in true_runs(~stance[:, leg]):
            least[flight.start + 2 : flight.stop - 1, leg] += limits.clearance
    return least


def _configurations(
    poses: Float[np.ndarray, "n1 6"],
    feet: Float[np.ndarray, "n1 4 3"],
    model: RobotModel,
    limits: PlanLimits,
) -> Float[np.ndarray, "n1 19"]:
    R = attitudes(poses[:, 3:])
    joints = np.empty((len(poses), 12))
    for leg in LEGS:
        places = turned_back(R, feet[:, leg] - poses[:, :3])
        joints[:, leg.joints] = leg_angles(LegGeometry.of(model, leg), places).q
    margin = limits.joint_margin
    return configurations(poses, np.clip(joints, model.q_lower + margin, model.q_upper - margin))


def guess_velocities(
    q: Float[np.ndarray, "n1 19"], times: Float[np.ndarray, " n1"], model: RobotModel
) -> Float[np.ndarray, "n1 18"]:
    """Rates that lead from each row to the next, as the solver integrates; at rest at the start."""
    v = np.zeros((len(q), 18))
    for row in range(1, len(q)):
        step = pin.difference(model.pin_model, q[row - 1], q[row])
        v[row] = step / (times[row] - times[row - 1])
    v[-1] = 0.0
    return v


def feet_at(model: RobotModel, q: Float[np.ndarray, "n 19"]) -> Float[np.ndarray, "n 4 3"]:
    """Centres of the feet [m] at configurations ``q``."""
    poses = np.array([pose_of(row) for row in q])
    return foot_centres(poses[:, :3], attitudes(poses[:, 3:]), q[:, 7:], model)
