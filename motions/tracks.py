"""Tracks of a timeline as functions of many instants at once: where trunk and legs shall be.

Everything is in the frame of the motion: z up, x ahead, its origin on the ground in the middle of
the four feet.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Float

from go2_wbc.curves import Ease
from go2_wbc.legs import LEGS, Leg
from go2_wbc.reference import Posture
from go2_wbc.robot.leg_kinematics import LegGeometry, leg_angles
from go2_wbc.robot.model import RobotModel
from go2_wbc.robot.rotations import quaternion_from_rpy, rotation_from_rpy
from motions.keys import BODY_CHANNELS, BodyKey, Frame, LegKey, LegTarget, PostureKey
from motions.postures import LIE_POSE, SIT_POSE, STAND_POSE
from motions.timeline import Timeline

LOW = 0.08
"""A foot that stays this far [m] below its hip's axis moves along straight lines; a higher one in
joint space, since the way of a foot past its hip crosses a singularity of the leg."""
SETTLING_STEPS = 10
"""The CoM hangs a little off the base; finding its place converges by a factor of 8 a step."""

Times = Float[np.ndarray, " n"]
Poses = Float[np.ndarray, "n 6"]


@dataclass(frozen=True, slots=True)
class LegPath:
    """How a leg moves.

    Attributes:
        q: (n, 3) joint angles [rad].
        miss: (n,) distance [m] by which the wanted place is out of reach.
    """

    q: Float[np.ndarray, "n 3"]
    miss: Float[np.ndarray, " n"]


def body_path(
    timeline: Timeline, home: Mapping[Posture, Float[np.ndarray, "6"]], times: Times
) -> Poses:
    """Base position [m] and roll, pitch, yaw [rad] at ``times``, without the shift for balance."""
    path = np.tile(home[timeline.entry], (len(times), 1))
    last = home[timeline.entry]
    for key in timeline.in_order(PostureKey):
        path += progress(key, times)[:, None] * (home[key.stance] - last)
        last = home[key.stance]
    for column, channel in enumerate(BODY_CHANNELS):
        value = 0.0
        for key in timeline.in_order(BodyKey):
            if key.channel == channel:
                path[:, column] += progress(key, times) * (key.value - value)
                value = key.value
    return path


def progress(key: BodyKey | PostureKey | LegKey, times: Times) -> Float[np.ndarray, " n"]:
    """Share of the key's way that is done: 0 before it, 1 after it."""
    return eased(key.start, key.end, key.ease, times)


def eased(start: float, end: float, ease: Ease, times: Times) -> Float[np.ndarray, " n"]:
    """0 before ``start``, 1 after ``end``, eased between them."""
    s = np.clip((times - start) / (end - start), 0.0, 1.0)
    shares = np.where(s < 1.0, 0.0, 1.0)
    during = (s > 0.0) & (s < 1.0)
    shares[during] = [ease.progress(float(value))[0] for value in s[during]]
    return shares


def flights(timeline: Timeline, leg: Leg) -> list[tuple[float, float]]:
    """Spans [s] in which a foot is off the ground; the last one may be endless."""
    spans: list[tuple[float, float]] = []
    begin: float | None = None
    for key in timeline.in_order(LegKey):
        if key.leg is not leg:
            continue
        if begin is None:
            begin = key.start
        if key.target.is_on_ground:
            spans.append((begin, key.end))
            begin = None
    return spans if begin is None else [*spans, (begin, np.inf)]


class LegTracks:
    """Evaluates the tracks of the legs along a path of the trunk."""

    def __init__(self, model: RobotModel, home: Float[np.ndarray, "6"]) -> None:
        """``home``: pose of the trunk in which the motion starts, on four feet."""
        self._geometry = {leg: LegGeometry.of(model, leg) for leg in LEGS}
        self.p_feet = model.p_base_feet_nominal.copy()
        self.p_feet[:, 2] = model.foot_radius
        self._p_base_feet_home = (self.p_feet - home[:3]) @ rotations(home[None, 3:])[0]

    def path(self, timeline: Timeline, leg: Leg, times: Times, body: Poses) -> LegPath:
        """Joint angles of ``leg`` while the trunk moves along ``body``."""
        target, path = LegTarget.on_ground(), self._at(leg, LegTarget.on_ground(), body)
        for key in timeline.in_order(LegKey):
            if key.leg is leg:
                during = times >= key.start
                path = self._joined(path, self._move(key, target, times, body), during)
                target = key.target
        return path

    def _move(self, key: LegKey, origin: LegTarget, times: Times, body: Poses) -> LegPath:
        share = progress(key, times)[:, None]
        goals = (origin, key.target)
        span = (times >= key.start) & (times <= key.end)
        if all(goal.frame is not Frame.JOINTS for goal in goals):
            places = [self._places(key.leg, goal, body) for goal in goals]
            hip = self._geometry[key.leg].p_base_hip[2]
            if all((place[span, 2] < hip - LOW).all() for place in places):
                between = (1.0 - share) * places[0] + share * places[1]
                found = leg_angles(self._geometry[key.leg], between)
                return LegPath(found.q, found.miss)
        first, second = (self._at(key.leg, goal, body) for goal in goals)
        q = (1.0 - share) * first.q + share * second.q
        return LegPath(q, np.where(share[:, 0] < 1.0, first.miss, second.miss))

    def _at(self, leg: Leg, target: LegTarget, body: Poses) -> LegPath:
        if target.frame is Frame.JOINTS:
            return LegPath(np.tile(target.values, (len(body), 1)), np.zeros(len(body)))
        found = leg_angles(self._geometry[leg], self._places(leg, target, body))
        return LegPath(found.q, found.miss)

    def _places(self, leg: Leg, target: LegTarget, body: Poses) -> Float[np.ndarray, "n 3"]:
        offset = np.array(target.values)
        if target.frame is Frame.BODY:
            return np.tile(self._p_base_feet_home[leg] + offset, (len(body), 1))
        return np.einsum(
            "nij,ni->nj", rotations(body[:, 3:]), self.p_feet[leg] + offset - body[:, :3]
        )

    @staticmethod
    def _joined(before: LegPath, after: LegPath, during: Bool[np.ndarray, " n"]) -> LegPath:
        return LegPath(
            np.where(during[:, None], after.q, before.q), np.where(during, after.miss, before.miss)
        )


def rotations(rpy: Float[np.ndarray, "n 3"]) -> Float[np.ndarray, "n 3 3"]:
    """Rz(yaw) Ry(pitch) Rx(roll) for every row."""
    return np.array([rotation_from_rpy(*row) for row in rpy.tolist()])


def configuration(
    pose: Float[np.ndarray, "6"], joints: Float[np.ndarray, "12"]
) -> Float[np.ndarray, "19"]:
    """q of a trunk at ``pose`` (position, then roll, pitch, yaw) with these joint angles."""
    roll, pitch, yaw = pose[3:].tolist()
    return np.concatenate([pose[:3], quaternion_from_rpy(roll, pitch, yaw), joints])


def home_poses(model: RobotModel) -> dict[Posture, Float[np.ndarray, "6"]]:
    """Pose of the base in every resting posture, on four feet below the hips."""
    stand = STAND_POSE.copy()
    tracks = LegTracks(model, STAND_POSE)
    start, still = np.zeros(1), Timeline()
    for _ in range(SETTLING_STEPS):
        joints = [tracks.path(still, leg, start, stand[None]).q[0] for leg in LEGS]
        com, _ = model.forward_kinematics(configuration(stand, np.concatenate(joints)))
        stand[:3] += STAND_POSE[:3] - com
    return {Posture.STAND: stand, Posture.SIT: SIT_POSE, Posture.LIE: LIE_POSE}
