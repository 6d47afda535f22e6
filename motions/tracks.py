"""Tracks of a timeline as functions of many instants at once: where trunk and legs shall be.

Everything is in the frame of the motion: z up, x ahead, its origin on the ground in the middle of
the four feet as they stand at first. Offsets count in the frame of the feet as they stand by then.
"""

from __future__ import annotations

from bisect import bisect_right
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import pairwise, starmap
from weakref import WeakKeyDictionary

import numpy as np
from jaxtyping import Bool, Float
from scipy.interpolate import CubicSpline

from go2_wbc.legs import LEGS, Leg
from go2_wbc.reference import Posture
from go2_wbc.robot.leg_kinematics import LegAngles, LegGeometry, foot_places, leg_angles
from go2_wbc.robot.model import RobotModel
from motions.footing import Footing, standing_feet
from motions.keys import (
    BODY_CHANNELS,
    BodyKey,
    BodyPathKey,
    Frame,
    JointKey,
    Key,
    LegKey,
    LegTarget,
    PostureKey,
    StepKey,
)
from motions.placement import Wanted, attitudes, place, turned, turned_back
from motions.postures import LIE_POSE, SIT_POSE, STAND_POSE
from motions.timeline import Timeline

SAMPLE_PERIOD = 0.01
"""Time [s] between the instants that are looked at. A cubic spline through samples of f misses it
by 5/384 h^4 max|d4f/dt4| at most (Hall & Meyer 1976): 0.2 um for a way L of 0.1 m by minimum jerk
in T = 0.4 s, where the derivative is 360 L / T^4 at most."""
LOW = 0.08
"""A foot that stays this far [m] below its hip's axis moves along straight lines; a higher one in
joint space, since the way of a foot past its hip crosses a singularity of the leg."""
SETTLING_STEPS = 10
"""Steps that find the place of the base below which the CoM stands; see ``place``."""

Times = Float[np.ndarray, " n"]
Poses = Float[np.ndarray, "n 6"]
Joints = Float[np.ndarray, "n 12"]
Feet = Float[np.ndarray, "n 4 3"]
Move = tuple[Key, Float[np.ndarray, " k"]]


def sample_times(duration: float) -> Times:
    """Instants [s] from the start of a motion to its end."""
    return np.linspace(0.0, duration, max(round(duration / SAMPLE_PERIOD), 2) + 1)


def followed(
    times: Times, first: Float[np.ndarray, " k"], moves: Sequence[Move]
) -> Float[np.ndarray, "n k"]:
    """Values (n, k) at ``times`` of what goes from ``first`` to one goal after the other.

    Args:
        times: increasing instants [s].
        first: where it is before the first move.
        moves: keys by their starts, each with its goal (k,); none starts before the one before it
            has ended.
    """
    path = np.tile(first, (len(times), 1))
    last = first
    edges = np.searchsorted(times, [*(key.start for key, _ in moves), np.inf]).tolist()
    for (key, goal), rows in zip(moves, starmap(slice, pairwise(edges)), strict=True):
        path[rows] = last + _way(key, times[rows], last, goal)
        last = goal
    return path


def body_path(
    timeline: Timeline,
    home: Mapping[Posture, Float[np.ndarray, "6"]],
    times: Times,
    frames: Float[np.ndarray, "n 3"],
) -> Poses:
    """Base position [m] and roll, pitch, yaw [rad] at ``times``, without the shift for balance.

    ``frames``: x, y [m] and yaw [rad] of the frame of the feet (``Footing.frames``).
    """
    moves: dict[str, list[Move]] = {channel: [] for channel in BODY_CHANNELS}
    for key in timeline.in_order(BodyKey):
        moves[key.channel].append((key, np.array([key.value])))
    postures = [(key, home[key.posture]) for key in timeline.in_order(PostureKey)]
    offsets = [followed(times, np.zeros(1), moves[channel]) for channel in BODY_CHANNELS]
    path = followed(times, home[timeline.entry], postures) + np.hstack(offsets)
    path[:, :2] = frames[:, :2] + turned(_headings(frames), path[:, :3])[:, :2]
    path[:, 5] += frames[:, 2]
    return path


def _way(
    key: Key, times: Times, last: Float[np.ndarray, " k"], goal: Float[np.ndarray, " k"]
) -> Float[np.ndarray, "n k"]:
    """How far (n, k) a key has gone from ``last``; a path through points by a clamped spline."""
    if not isinstance(key, BodyPathKey):
        return eased(key, times)[:, None] * (goal - last)
    shares = np.array([0.0, *key.shares, 1.0])
    places = np.array([float(last[0]), *key.through, key.value]) - last[0]
    passed = np.clip((times - key.start) / (key.end - key.start), 0.0, 1.0)
    return CubicSpline(shares, places, bc_type="clamped")(passed)[:, None]


def eased(key: Key, times: Times) -> Float[np.ndarray, " n"]:
    """0 before ``key`` starts, 1 after it has ended, eased between them."""
    s = np.clip((times - key.start) / (key.end - key.start), 0.0, 1.0)
    shares = np.where(s < 1.0, 0.0, 1.0)
    during = (s > 0.0) & (s < 1.0)
    shares[during] = [key.ease.progress(float(value))[0] for value in s[during]]
    return shares


def flights(timeline: Timeline, leg: Leg) -> list[tuple[float, float]]:
    """Spans [s] in which a foot is off the ground; the last one may be endless."""
    spans = swings(timeline, leg)
    begin: float | None = None
    for key in timeline.in_order(LegKey):
        if key.leg is not leg:
            continue
        if begin is None:
            begin = key.start
        if key.target.is_on_ground:
            spans.append((begin, key.end))
            begin = None
    return sorted(spans if begin is None else [*spans, (begin, np.inf)])


def swings(timeline: Timeline, leg: Leg) -> list[tuple[float, float]]:
    """Spans [s] in which a foot steps."""
    return [(key.start, key.end) for key in timeline.in_order(StepKey) if key.leg is leg]


class LegTracks:
    """Evaluates the legs' tracks of a timeline along a path of the trunk.

    Attributes:
        footing: where the feet stand.
    """

    def __init__(
        self, timeline: Timeline, footing: Footing, model: RobotModel, home: Float[np.ndarray, "6"]
    ) -> None:
        """``home``: pose of the trunk in the frame of the feet in which the motion starts."""
        self._geometry = {leg: LegGeometry.of(model, leg) for leg in LEGS}
        self._keys: dict[Leg, list[LegKey]] = {leg: [] for leg in LEGS}
        for key in timeline.in_order(LegKey):
            self._keys[key.leg].append(key)
        self.footing = footing
        self._p_home, self._R_home = home[:3], attitudes(home[None, 3:])[0]
        homes = home_poses(model)
        for leg, keys in self._keys.items():
            self._keys[leg] = self._completed(leg, keys, timeline, homes)
        self._starts = {leg: [key.start for key in keys] for leg, keys in self._keys.items()}

    def _completed(
        self,
        leg: Leg,
        keys: Sequence[LegKey],
        timeline: Timeline,
        homes: Mapping[Posture, Float[np.ndarray, "6"]],
    ) -> list[LegKey]:
        """The keys with the angles of joints that stay as they are, from the goal before."""
        done, origin = list[LegKey](), LegTarget.on_ground()
        for key in keys:
            whole: LegKey = key
            if isinstance(key, JointKey):
                times = np.array([key.start])
                ground = self.ground(leg, times)
                body = body_path(timeline, homes, times, ground.frames)
                angles = self._at(leg, origin, body, ground).q[0]
                angles[key.joint] = key.target.values[key.joint]
                hip, thigh, calf = angles.tolist()
                whole = replace(key, target=LegTarget(Frame.JOINTS, (hip, thigh, calf)))
            done.append(whole)
            origin = whole.target
        return done

    def path(self, leg: Leg, times: Times, body: Poses) -> LegAngles:
        """Joint angles of ``leg`` at increasing ``times``, at which the trunk is at ``body``.

        From its start until the next one starts, a key alone says where the leg is.
        """
        keys, starts = self._keys[leg], self._starts[leg]
        first = max(bisect_right(starts, times[0]) - 1, 0)
        origin = keys[first - 1].target if first else LegTarget.on_ground()
        ground = self.ground(leg, times)
        path = self._at(leg, origin, body, ground)
        for index in range(first, bisect_right(starts, times[-1])):
            key = keys[index]
            following = starts[index + 1] if index + 1 < len(keys) else np.inf
            until = max(np.searchsorted(times, following), np.searchsorted(times, key.end, "right"))
            rows = slice(int(np.searchsorted(times, key.start)), int(until))
            moved = self._move(key, origin, times[rows], body[rows], ground.part(rows))
            path.q[rows], path.miss[rows] = moved.q, moved.miss
            origin = key.target
        return path

    def ground(self, leg: Leg, times: Times) -> Ground:
        """Where the foot of ``leg`` stands at ``times``."""
        return Ground(self.footing.place(leg, times), self.footing.frames(times))

    def feet(
        self, raised: Bool[np.ndarray, "n 4"], p_feet: Feet, body: Poses, joints: Joints
    ) -> Feet:
        """Places [m] of the feet's centres: ``p_feet``, and where raised legs hold them.

        ``body``, ``joints``: pose of the trunk and joint angles.
        """
        R, places = attitudes(body[:, 3:]), p_feet.copy()
        for leg in LEGS:
            rows = raised[:, leg]
            seen = foot_places(self._geometry[leg], joints[rows][:, leg.joints])
            places[rows, leg] = body[rows, :3] + turned(R[rows], seen)
        return places

    def _move(
        self, key: LegKey, origin: LegTarget, times: Times, body: Poses, ground: Ground
    ) -> LegAngles:
        share = eased(key, times)[:, None]
        goals = (origin, key.target)
        span = times <= key.end
        if all(goal.frame is not Frame.JOINTS for goal in goals):
            places = [self._places(goal, body, ground) for goal in goals]
            hip = self._geometry[key.leg].p_base_hip[2]
            if all((place[span, 2] < hip - LOW).all() for place in places):
                between = (1.0 - share) * places[0] + share * places[1]
                return leg_angles(self._geometry[key.leg], between)
        first, second = (self._at(key.leg, goal, body, ground) for goal in goals)
        q = (1.0 - share) * first.q + share * second.q
        return LegAngles(q, np.where(share[:, 0] < 1.0, first.miss, second.miss))

    def _at(self, leg: Leg, target: LegTarget, body: Poses, ground: Ground) -> LegAngles:
        if target.frame is Frame.JOINTS:
            return LegAngles(np.tile(target.values, (len(body), 1)), np.zeros(len(body)))
        return leg_angles(self._geometry[leg], self._places(target, body, ground))

    def _places(self, target: LegTarget, body: Poses, ground: Ground) -> Float[np.ndarray, "n 3"]:
        """Places of a foot [m], seen from the base."""
        offset, R = np.array(target.values), _headings(ground.frames)
        if target.frame is Frame.BODY:
            seen = turned_back(R, ground.p - _flat(ground.frames))
            return (seen - self._p_home) @ self._R_home + offset
        place = ground.p + R @ offset
        return turned_back(attitudes(body[:, 3:]), place - body[:, :3])


@dataclass(frozen=True, slots=True)
class Ground:
    """Where one foot stands.

    Attributes:
        p: (n, 3) its centre [m].
        frames: (n, 3) x, y [m] and yaw [rad] of the frame of the four feet.
    """

    p: Float[np.ndarray, "n 3"]
    frames: Float[np.ndarray, "n 3"]

    def part(self, rows: slice) -> Ground:
        """Some of its instants."""
        return Ground(self.p[rows], self.frames[rows])


def _flat(frames: Float[np.ndarray, "n 3"]) -> Float[np.ndarray, "n 3"]:
    return np.column_stack([frames[:, :2], np.zeros(len(frames))])


def _headings(frames: Float[np.ndarray, "n 3"]) -> Float[np.ndarray, "n 3 3"]:
    return attitudes(np.column_stack([np.zeros((len(frames), 2)), frames[:, 2]]))


def home_poses(model: RobotModel) -> Mapping[Posture, Float[np.ndarray, "6"]]:
    """Pose of the base in every resting posture, on four feet below the hips.

    Standing is given by its CoM. They are found once for each model.
    """
    home = _HOMES.get(model)
    if home is None:
        wanted = Wanted(
            p=STAND_POSE[None, :3],
            is_com=np.ones(1, dtype=bool),
            R=attitudes(STAND_POSE[None, 3:]),
            q_joints=np.zeros((1, 12)),
            raised=np.zeros((1, 4), dtype=bool),
            p_feet=standing_feet(model)[None],
        )
        p_base = place(wanted, SETTLING_STEPS, model).p_base[0]
        stand = np.concatenate([p_base, STAND_POSE[3:]])
        home = {Posture.STAND: stand, Posture.SIT: SIT_POSE, Posture.LIE: LIE_POSE}
        _HOMES[model] = home
    return home


_HOMES: WeakKeyDictionary[RobotModel, Mapping[Posture, np.ndarray]] = WeakKeyDictionary()
"""The resting postures of every living model for which they were asked."""
