"""Where the feet stand while a motion steps, and the frame from which its trunk is counted."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Float

from go2_wbc.errors import TimelineError
from go2_wbc.legs import LEGS, Leg
from go2_wbc.reference import Anchor
from go2_wbc.robot.rotations import yaw_rotation
from motions.batch_kinematics import attitudes
from motions.language.keys import Key, LegKey, StepKey
from motions.language.timeline_data import SAME, TimelineData

Times = Float[np.ndarray, " n"]

SQUARE = 1e-3  #: Distance [m] from its place below the hip within which a foot is in it
_ROUND = 64.0  #: 1 / (u^3 (1 - u)^3) at u = 1/2: makes the height of a swing 1 in its middle


@dataclass(frozen=True, slots=True)
class Ground:
    """Where the feet stand, or are on their way, at n instants."""

    p_feet: Float[np.ndarray, "n 4 3"]  #: (n, 4, 3) their centres [m]
    frames: Float[np.ndarray, "n 3"]  #: (n, 3) x, y [m] and yaw [rad] of the frame of the four feet
    headings: Float[np.ndarray, "n 3 3"]  #: (n, 3, 3) its attitude

    def part(self, rows: slice) -> Ground:
        """Some of its instants."""
        return Ground(self.p_feet[rows], self.frames[rows], self.headings[rows])


class _Way:
    """Where one foot has come after 0, 1, 2 ... of its steps, so that few are looked at."""

    def __init__(
        self, start: Float[np.ndarray, "3"], steps: list[tuple[StepKey, Float[np.ndarray, "3"]]]
    ) -> None:
        self.places, self.moves, self.sums = [start], list[np.ndarray](), [start[:2]]
        last = start
        for _, goal in steps:
            self.moves.append(goal[:2] - last[:2])
            self.sums.append(self.sums[-1] + self.moves[-1])
            self.places.append(self.places[-1] + (goal - self.places[-1]))
            last = goal
        spans = [(key.start, key.end, key.lead) for key, _ in steps]
        self._begin, self._end, self._lead = np.array(spans).reshape(-1, 3).T

    def during(self, times: Times, *, with_lead: bool) -> tuple[int, int]:
        """Which steps are under way at increasing ``times``: the first, and the first after it."""
        lead = self._lead if with_lead else 0.0
        is_over = self._end + lead + SAME < times[0] if len(times) else np.zeros(0, dtype=bool)
        has_begun = self._begin - lead <= times[-1] if len(times) else is_over
        return int(np.logical_and.accumulate(is_over).sum()), int(has_begun.sum())


class Footing:
    """The places of the feet of a timeline, in the frame of the motion.

    A foot that steps swings along a straight line by minimum jerk, and up and down by the curve
    h 64 u^3 (1 - u)^3 of the share u of the time, which begins and ends without speed and
    acceleration.

    Attributes:
        start: (4, 3) where the feet's centres are at first [m].
    """

    def __init__(
        self,
        timeline: TimelineData,
        nominal: Float[np.ndarray, "4 3"],
        start: Float[np.ndarray, "4 3"] | None = None,
    ) -> None:
        """Work out where every step lands.

        Args:
            timeline: that steps.
            nominal: where the feet's centres stand below their hips [m].
            start: where they are at first [m], by default there.

        Raises:
            TimelineError: if a raised foot steps.
        """
        self.start = nominal if start is None else start
        self._nominal = nominal
        self._steps: dict[Leg, list[tuple[StepKey, Float[np.ndarray, "3"]]]] = {
            leg: [] for leg in LEGS
        }
        for key in timeline.in_order(StepKey):
            self._steps[key.leg].append((key, self._goal(key)))
        for leg, steps in self._steps.items():
            if steps:
                _require_on_ground(timeline, leg)
        self._ways = {leg: _Way(self.start[leg], steps) for leg, steps in self._steps.items()}

    def at(self, times: Times) -> Ground:
        """Where the feet are at increasing ``times``, and the frame from which the trunk counts."""
        p_feet = np.stack([self.place(leg, times) for leg in LEGS], axis=1)
        frames = self.frames(times)
        turns = np.column_stack([np.zeros((len(frames), 2)), frames[:, 2]])
        return Ground(p_feet, frames, attitudes(turns))

    def place(self, leg: Leg, times: Times) -> Float[np.ndarray, "n 3"]:
        """The centre [m] of one foot at increasing ``times``."""
        way = self._ways[leg]
        first, last = way.during(times, with_lead=False)
        steps = self._steps[leg][first:last]
        rows = [_rows(key, times, 0.0) for key, _ in steps]
        done = np.searchsorted([end for _, end in rows], np.arange(len(times)), side="right")
        p_foot = np.array(way.places[first : last + 1])[done]
        for (key, goal), (begin, end) in zip(steps, rows, strict=True):
            u, here = _shares(key, times[begin:end], 0.0), p_foot[begin:end]
            here += _minimum_jerk(u)[:, None] * (goal - here)
            here[:, 2] += key.height * _ROUND * (u * (1.0 - u)) ** 3
        return p_foot

    def frames(self, times: Times) -> Float[np.ndarray, "n 3"]:
        """x, y [m] and yaw [rad] of the frame of the feet, as the trunk follows it.

        Every step moves it by minimum jerk; the yaw is continuous over increasing ``times``.
        """
        count = len(times)
        p_feet = np.empty((count, 4, 2))
        for leg, way in self._ways.items():
            first, last = way.during(times, with_lead=True)
            steps, gone = self._steps[leg][first:last], np.zeros((count + 1, 2))
            rows = [_rows(key, times, key.lead) for key, _ in steps]
            gone[0] = way.sums[first]
            for (_, end), move in zip(rows, way.moves[first:last], strict=True):
                gone[end] += move
            p_feet[:, leg] = np.cumsum(gone[:count], axis=0)
            for (key, _), (begin, end), move in zip(steps, rows, way.moves[first:], strict=False):
                share = _minimum_jerk(_shares(key, times[begin:end], key.lead))
                p_feet[begin:end, leg] += share[:, None] * move
        ahead = p_feet[:, :2].mean(axis=1) - p_feet[:, 2:].mean(axis=1)
        yaw = np.unwrap(np.arctan2(ahead[:, 1], ahead[:, 0]))
        return np.column_stack([p_feet.mean(axis=1), yaw])

    @property
    def end(self) -> Float[np.ndarray, "4 3"]:
        """Where the feet's centres are when all steps are done [m]."""
        return self._feet_at(np.inf)

    def steps_back(self, end: float) -> dict[StepKey, StepKey]:
        """For every step the one back, of the motion that is this one backwards.

        Args:
            end: when the motion ends [s].

        Raises:
            TimelineError: if the feet do not end below their hips, where every motion starts.
        """
        last, frame = self.end, Anchor.of_feet(self.end, 0.0)
        off = last - frame.p_world - self._nominal @ yaw_rotation(frame.yaw).T
        if (far := np.abs(off[:, :2]).max(axis=1)).max() > SQUARE:
            leg = Leg(int(np.argmax(far)))
            raise TimelineError(
                f"reverse(): foot {leg.name} ends {1e3 * far[leg]:.0f} mm from its place below the "
                "hip, where no motion starts: end on walk() or turn()"
            )
        places = [(key, goal) for steps in self._steps.values() for key, goal in steps]
        origins = {key: self._before(key) for key, _ in places}
        found = dict[StepKey, StepKey]()
        for key, goal in places:
            p_feet = last.copy()
            for other, _ in sorted(places, key=lambda place: -place[0].end):
                if other.end > key.end + SAME:
                    p_feet[other.leg] = origins[other]
            R = yaw_rotation(Anchor.of_feet(p_feet, 0.0).yaw)
            x, y, _ = ((origins[key] - goal) @ R).tolist()
            start = end - key.end
            found[key] = replace(
                key, start=start, end=end - key.start, place=(x, y, 0.0), since=start,
                is_square=False,
            )  # fmt: skip
        return found

    def _before(self, key: StepKey) -> Float[np.ndarray, "3"]:
        """Where the foot of a step stood before it [m]."""
        places = [self.start[key.leg], *(goal for _, goal in self._steps[key.leg])]
        keys = [other for other, _ in self._steps[key.leg]]
        return places[keys.index(key)]

    def _goal(self, key: StepKey) -> Float[np.ndarray, "3"]:
        p_feet = self._feet_at(key.since)
        frame = Anchor.of_feet(p_feet, 0.0)
        x, y, yaw = key.place
        way, R = np.array([x, y, 0.0]), yaw_rotation(frame.yaw)
        turned = R @ yaw_rotation(yaw)
        if key.is_square:
            foot = self._nominal[key.leg]
            place = frame.p_world + R @ way + turned @ foot
        else:
            place = frame.p_world + turned @ R.T @ (p_feet[key.leg] - frame.p_world) + R @ way
        return np.array([*place[:2], p_feet[key.leg, 2]])

    def _feet_at(self, t: float) -> Float[np.ndarray, "4 3"]:
        """Where the feet stand [m], or will land, of those steps that have begun before ``t``."""
        p_feet = self.start.copy()
        for leg, steps in self._steps.items():
            for key, goal in steps:
                if key.start < t - SAME:
                    p_feet[leg] = goal
        return p_feet


def _require_on_ground(timeline: TimelineData, leg: Leg) -> None:
    is_raised = False
    keys: list[Key] = [*timeline.in_order(LegKey), *timeline.in_order(StepKey)]
    for key in sorted(keys, key=lambda key: key.start):
        if isinstance(key, LegKey) and key.leg is leg:
            is_raised = not key.target.is_on_ground
        if isinstance(key, StepKey) and key.leg is leg and is_raised:
            raise TimelineError(
                f"foot {leg.name} is raised when it shall step at {key.start:.2f} s: put it down "
                "before"
            )


def _rows(key: StepKey, times: Times, lead: float) -> tuple[int, int]:
    """The first of increasing ``times`` at which a step is under way, and the first after it."""
    begin, end = np.searchsorted(times, (key.start - lead, key.end + lead + SAME)).tolist()
    return begin, end


def _shares(key: StepKey, times: Times, lead: float) -> Times:
    return np.clip((times - key.start + lead) / (key.end - key.start + 2.0 * lead), 0.0, 1.0)


def _minimum_jerk(u: Times) -> Times:
    return u**3 * (10.0 + u * (6.0 * u - 15.0))
