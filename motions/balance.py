"""Where the trunk goes so that the CoM stays over the feet that stand, when others are raised.

At every key during a raise, PlaCo's inverse kinematics finds a place of the trunk whose CoM keeps a
distance to the edges of the support polygon, with the attitude, the height and the raised leg as
written. Between those instants the trunk moves smoothly.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from go2_wbc.curves import Ease
from go2_wbc.errors import IkError
from go2_wbc.legs import LEGS, Leg
from go2_wbc.robot.inverse_kinematics import PoseTargets, solve_pose
from go2_wbc.robot.model import RobotModel
from motions.keys import ShiftKey
from motions.timeline import SAME, Timeline
from motions.tracks import LegTracks, Poses, Times, configuration, eased

MARGINS = (0.08, 0.065, 0.05, 0.035, 0.02)
"""Distances [m] of the CoM to the edges of the support polygon that are tried, best first."""
JOINT_MARGIN = 0.02
"""Distance [rad] that the joints keep from their limits in a balanced pose."""


@dataclass(frozen=True, slots=True)
class Unbalanced:
    """A moment at which no balanced pose was found: when [s], and why."""

    time: float
    reason: str


@dataclass(frozen=True, slots=True)
class Balance:
    """Shift of the trunk.

    Attributes:
        offsets: (n, 2) to add to the trunk's place [m].
        failures: moments without a balanced pose.
    """

    offsets: Float[np.ndarray, "n 2"]
    failures: tuple[Unbalanced, ...]


class Balancer:
    """Finds the shifts of all raises of a timeline."""

    def __init__(
        self, timeline: Timeline, tracks: LegTracks, model: RobotModel, times: Times, body: Poses
    ) -> None:
        """``body``: the path of the trunk at ``times``, without any shift."""
        self._timeline, self._tracks, self._model = timeline, tracks, model
        self._times, self._body = times, body

    def balance(self) -> Balance:
        """The shifts, moment by moment."""
        offsets, last = np.zeros((len(self._times), 2)), np.zeros(2)
        failures: list[Unbalanced] = []
        shifts = self._timeline.in_order(ShiftKey)
        starts = [*(shift.start for shift in shifts), self._timeline.end]
        for shift, end in zip(shifts, starts[1:], strict=True):
            start = shift.start
            for knot in self._knots(shift, end):
                try:
                    goal = self._offset(knot, shift.raised, last)
                except IkError as error:
                    failures.append(Unbalanced(knot, str(error)))
                    goal = last
                share = eased(start, knot, Ease.MINIMUM_JERK, self._times)
                offsets += share[:, None] * (goal - last)
                start, last = knot, goal
        return Balance(offsets, tuple(failures))

    def _knots(self, shift: ShiftKey, end: float) -> list[float]:
        """The end of the shift, and every later end of a key while it lasts."""
        knots = [shift.end]
        if shift.raised:
            for t in sorted(key.end for key in self._timeline.keys):
                if knots[-1] + SAME < t < end - SAME:
                    knots.append(t)
        return knots

    def _offset(
        self, t: float, raised: frozenset[Leg], guess: Float[np.ndarray, "2"]
    ) -> Float[np.ndarray, "2"]:
        if not raised:
            return np.zeros(2)
        index = int(np.argmin(np.abs(self._times - t)))
        pose = self._body[index].copy()
        pose[:2] += guess
        instant = self._times[index : index + 1]
        paths = [self._tracks.path(self._timeline, leg, instant, pose[None]) for leg in LEGS]
        joints = np.concatenate([path.q[0] for path in paths])
        return self._solve(raised, pose, joints)[:2] - self._body[index, :2]

    def _solve(
        self,
        raised: frozenset[Leg],
        pose: Float[np.ndarray, "6"],
        joints: Float[np.ndarray, "12"],
    ) -> Float[np.ndarray, "19"]:
        if len(raised) > 1:
            names = " and ".join(leg.name for leg in sorted(raised))
            raise IkError(f"{names} are raised at once: two feet cannot balance the trunk")
        (leg,) = raised
        best: IkError | None = None
        for margin in MARGINS:
            hip, thigh, calf = joints[leg.joints].tolist()
            targets = PoseTargets(
                p_world_feet=self._tracks.p_feet,
                rpy=(float(pose[3]), float(pose[4]), float(pose[5])),
                height=float(pose[2]),
                raised=leg,
                q_raised=(hip, thigh, calf),
                support=tuple(other for other in LEGS if other is not leg),
                com_margin=margin,
                joint_margin=JOINT_MARGIN,
            )
            try:
                return solve_pose(self._model, targets, configuration(pose, joints)).q
            except IkError as error:
                best = error
        raise IkError(f"no pose balances without foot {leg.name}: {best}")
