"""Tracks of a timeline as functions of many instants at once: targets of trunk and legs.

Everything is in the frame of the motion: z up, x ahead, its origin on the ground in the middle of
the four feet as they stand at first. Offsets are in the frame of the feet as they then stand.
"""

from __future__ import annotations

from bisect import bisect_right
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import pairwise, starmap

import numpy as np
from jaxtyping import Bool, Float
from scipy.interpolate import CubicSpline

from go2_wbc.legs import LEGS, Leg
from go2_wbc.motion_plan import Posture
from go2_wbc.robot.leg_kinematics import LegAngles, LegGeometry, leg_angles
from go2_wbc.robot.model import RobotModel
from motions.batch_kinematics import attitudes, foot_centres, turned, turned_back
from motions.language.footing import Footing, Ground
from motions.language.keys import (
    BODY_CHANNELS,
    ON_GROUND,
    BodyKey,
    BodyPathKey,
    Frame,
    JointKey,
    Key,
    LegKey,
    LegTarget,
    PostureKey,
)
from motions.language.timeline import Timeline
from motions.language.timeline_data import SAME

SAMPLE_PERIOD = 0.01
"""Time [s] between the instants that are looked at. A cubic spline through samples of f misses it
by 5/384 h^4 max|d4f/dt4| at most (Hall & Meyer 1976): 0.2 um for a way L of 0.1 m by minimum jerk
in T = 0.4 s, where the derivative is 360 L / T^4 at most."""
LEAST_STEPS = 2  #: Of a motion, however short
LOW = 0.08
"""A foot that stays this far [m] below its hip's axis moves along straight lines; a higher one in
joint space, since the way of a foot past its hip crosses a singularity of the leg."""

Times = Float[np.ndarray, " n"]
Poses = Float[np.ndarray, "n 6"]
Joints = Float[np.ndarray, "n 12"]
Feet = Float[np.ndarray, "n 4 3"]
Move = tuple[Key, Float[np.ndarray, " k"]]


def sample_times(duration: float) -> Times:
    """Instants [s] from the start of a motion to its end, in even steps."""
    return np.linspace(0.0, duration, max(round(duration / SAMPLE_PERIOD), LEAST_STEPS) + 1)


def anchored_times(duration: float) -> Times:
    """Those of ``SAMPLE_PERIOD`` from the start on, and the end, which may be off these steps.

    What is as in another motion up to some instant is sampled as there, whatever their lengths.
    """
    count = round(duration / SAMPLE_PERIOD)
    if count <= LEAST_STEPS or abs(duration - count * SAMPLE_PERIOD) < SAME:
        return sample_times(duration)
    return np.append(SAMPLE_PERIOD * np.arange(count), duration)


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
        if rows.start < rows.stop:  # of a part of a motion, most keys are elsewhere
            path[rows] = last + _way(key, times[rows], last, goal)
        last = goal
    return path


def body_path(
    timeline: Timeline, home: Mapping[Posture, Float[np.ndarray, "6"]], times: Times, ground: Ground
) -> Poses:
    """Base position [m] and roll, pitch, yaw [rad] at ``times``, without the shift for balance."""
    moves: dict[str, list[Move]] = {channel: [] for channel in BODY_CHANNELS}
    for key in timeline.in_order(BodyKey):
        moves[key.channel].append((key, np.array([key.value])))
    postures = [(key, home[key.posture]) for key in timeline.in_order(PostureKey)]
    offsets = [followed(times, np.zeros(1), moves[channel]) for channel in BODY_CHANNELS]
    path = followed(times, home[timeline.entry], postures) + np.hstack(offsets)
    path[:, :2] = ground.frames[:, :2] + turned(ground.headings, path[:, :3])[:, :2]
    path[:, 5] += ground.frames[:, 2]
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
    shares[during] = key.ease.ways(s[during])
    return shares


@dataclass(frozen=True, slots=True)
class JointPaths:
    """What all legs do at n instants."""

    q: Joints  #: (n, 12) joint angles [rad]
    miss: Float[np.ndarray, "n 4"]
    """(n, 4) distance [m] by which each foot is asked for more than its leg reaches."""


@dataclass(frozen=True, slots=True)
class Instants:
    """Where trunk and feet are at n increasing instants."""

    times: Times  #: (n,) [s]
    p_base: Float[np.ndarray, "n 3"]  #: (n, 3) place of the base [m]
    R: Float[np.ndarray, "n 3 3"]  #: (n, 3, 3) its attitude
    ground: Ground  #: where the feet stand

    @staticmethod
    def of(times: Times, body: Poses, ground: Ground) -> Instants:
        """With the trunk at ``body``."""
        return Instants(times, body[:, :3], attitudes(body[:, 3:]), ground)

    def part(self, rows: slice) -> Instants:
        """Some of them."""
        return Instants(self.times[rows], self.p_base[rows], self.R[rows], self.ground.part(rows))


class LegTracks:
    """Evaluates the legs' tracks of a timeline along a path of the trunk."""

    def __init__(
        self, timeline: Timeline, footing: Footing, model: RobotModel, home: Float[np.ndarray, "6"]
    ) -> None:
        """``home``: pose of the trunk in the frame of the feet in which the motion starts."""
        self._model = model
        self._geometry = {leg: LegGeometry.of(model, leg) for leg in LEGS}
        self._keys: dict[Leg, list[LegKey]] = {leg: [] for leg in LEGS}
        for key in timeline.in_order(LegKey):
            self._keys[key.leg].append(key)
        self._starts = {leg: [key.start for key in keys] for leg, keys in self._keys.items()}
        self.footing = footing  #: where the feet stand
        self._p_home, self._R_home = home[:3], attitudes(home[None, 3:])[0]
        self._keys = {leg: self._completed(leg, keys) for leg, keys in self._keys.items()}

    def _completed(self, leg: Leg, keys: Sequence[LegKey]) -> list[LegKey]:
        """The keys with the angles of joints that stay as they are, from the goal before.

        That is in joints or in the frame of the body, so the trunk's pose does not count.
        """
        done, origin = list[LegKey](), ON_GROUND
        for key in keys:
            whole: LegKey = key
            if isinstance(key, JointKey):
                start = np.array([key.start])
                now = Instants.of(start, np.zeros((1, 6)), self.footing.at(start))
                angles = self._at(leg, origin, now).q[0]
                angles[key.joint] = key.target.values[key.joint]
                hip, thigh, calf = angles.tolist()
                whole = replace(key, target=LegTarget(Frame.JOINTS, (hip, thigh, calf)))
            done.append(whole)
            origin = whole.target
        return done

    def paths(self, now: Instants) -> JointPaths:
        """Joint angles of all legs."""
        legs = [self._path(leg, now) for leg in LEGS]
        return JointPaths(
            np.hstack([leg.q for leg in legs]), np.column_stack([leg.miss for leg in legs])
        )

    def feet(self, raised: Bool[np.ndarray, "n 4"], now: Instants, joints: Joints) -> Feet:
        """Places [m] of the feet's centres: on the ground, and where raised legs hold them."""
        held = foot_centres(now.p_base, now.R, joints, self._model)
        return np.where(raised[:, :, None], held, now.ground.p_feet)

    def _path(self, leg: Leg, now: Instants) -> LegAngles:
        """From its start until the next one starts, a key alone says where the leg is."""
        keys, starts, times = self._keys[leg], self._starts[leg], now.times
        first = max(bisect_right(starts, times[0]) - 1, 0)
        origin = keys[first - 1].target if first else ON_GROUND
        path = self._at(leg, origin, now)
        for index in range(first, bisect_right(starts, times[-1])):
            key = keys[index]
            following = starts[index + 1] if index + 1 < len(keys) else np.inf
            until = max(np.searchsorted(times, following), np.searchsorted(times, key.end, "right"))
            rows = slice(int(np.searchsorted(times, key.start)), int(until))
            moved = self._move(key, origin, now.part(rows))
            path.q[rows], path.miss[rows] = moved.q, moved.miss
            origin = key.target
        return path

    def _move(self, key: LegKey, origin: LegTarget, now: Instants) -> LegAngles:
        share = eased(key, now.times)[:, None]
        goals = (origin, key.target)
        span = now.times <= key.end
        if all(goal.frame is not Frame.JOINTS for goal in goals):
            places = [self._places(key.leg, goal, now) for goal in goals]
            hip = self._geometry[key.leg].p_base_hip[2]
            if all((place[span, 2] < hip - LOW).all() for place in places):
                between = (1.0 - share) * places[0] + share * places[1]
                return leg_angles(self._geometry[key.leg], between)
        first, second = (self._at(key.leg, goal, now) for goal in goals)
        q = (1.0 - share) * first.q + share * second.q
        return LegAngles(q, np.where(share[:, 0] < 1.0, first.miss, second.miss))

    def _at(self, leg: Leg, target: LegTarget, now: Instants) -> LegAngles:
        if target.frame is Frame.JOINTS:
            count = len(now.times)
            return LegAngles(np.tile(target.values, (count, 1)), np.zeros(count))
        return leg_angles(self._geometry[leg], self._places(leg, target, now))

    def _places(self, leg: Leg, target: LegTarget, now: Instants) -> Float[np.ndarray, "n 3"]:
        """Places of a foot [m], seen from the base."""
        offset, ground = np.array(target.values), now.ground
        p, R = ground.p_feet[:, leg], ground.headings
        if target.frame is Frame.BODY:
            seen = turned_back(R, p - np.pad(ground.frames[:, :2], ((0, 0), (0, 1))))
            return (seen - self._p_home) @ self._R_home + offset
        return turned_back(now.R, p + R @ offset - now.p_base)
