"""Where the trunk goes so that the CoM stays over the feet that stand, when others are raised.

At every key during a raise, PlaCo's inverse kinematics finds a place of the trunk whose CoM keeps a
distance to the edges of the support polygon, with the attitude, the height and the raised leg as
written. Between those instants the trunk moves smoothly.
"""

from __future__ import annotations

from bisect import bisect_left, bisect_right
from dataclasses import replace

import numpy as np
from jaxtyping import Float

from go2_wbc.errors import IkError
from go2_wbc.legs import Leg
from go2_wbc.robot.inverse_kinematics import PoseTargets, solve_pose
from go2_wbc.robot.model import RobotModel
from motions.batch_kinematics import configurations
from motions.language.clock import SAME
from motions.language.keys import BalanceShift
from motions.language.timeline import Timeline
from motions.plan.compiled_plan import Problem
from motions.plan.tracks import LegTracks, Poses, Times, followed

MARGINS = (0.08, 0.065, 0.05, 0.035, 0.02)
"""Distances [m] of the CoM to the edges of the support polygon that are tried, best first.

The largest circle in the triangle of three feet, 0.387 m by 0.284 m, has a radius of 95 mm. The
last is the check's limit (``FeasibilityLimits.support``) with 5 mm to spare. Own choice.
"""
JOINT_MARGIN = 0.02
"""Distance [rad] that the joints keep from their limits in a balanced pose: own choice."""


class Balancer:
    """Finds the shifts of all raises of a timeline."""

    def __init__(
        self, timeline: Timeline, tracks: LegTracks, model: RobotModel, times: Times, body: Poses
    ) -> None:
        """``body``: the path of the trunk at ``times``, without any shift."""
        self._tracks, self._model = tracks, model
        self._times, self._body = times, body
        self._shifts, self._end = timeline.in_order(BalanceShift), timeline.end
        self._key_ends = sorted(key.end for key in timeline.keys)

    def balance(self) -> tuple[Float[np.ndarray, "n 2"], list[Problem]]:
        """What to add to the trunk's places [m] (n, 2), and the moments without a balanced pose."""
        moves, last = [], np.zeros(2)
        problems: list[Problem] = []
        starts = [*(shift.start for shift in self._shifts), self._end]
        for shift, end in zip(self._shifts, starts[1:], strict=True):
            start = shift.start
            for knot in self._knots(shift, end):
                try:
                    last = self._offset(knot, shift.raised, last)
                except IkError as error:
                    problems.append(Problem("balance", "trunk", knot, reason=str(error)))
                moves.append((replace(shift, start=start, end=knot), last))
                start = knot
        return followed(self._times, np.zeros(2), moves), problems

    def _knots(self, shift: BalanceShift, end: float) -> list[float]:
        """The end of the shift, and every later end of a key while it lasts."""
        knots = [shift.end]
        if shift.raised:
            first = bisect_right(self._key_ends, shift.end + SAME)
            for t in self._key_ends[first : bisect_left(self._key_ends, end - SAME)]:
                if t > knots[-1] + SAME:
                    knots.append(t)
        return knots

    def _offset(
        self, t: float, raised: frozenset[Leg], guess: Float[np.ndarray, "2"]
    ) -> Float[np.ndarray, "2"]:
        if not raised:
            return np.zeros(2)
        index = nearest(self._times, t)
        pose = self._body[index].copy()
        pose[:2] += guess
        instant = self._times[index : index + 1]
        ground = self._tracks.footing.at(instant)
        joints = self._tracks.paths(instant, pose[None], ground).q[0]
        placed = self._solve(raised, pose, joints, ground.p_feet[0])
        return placed[:2] - self._body[index, :2]

    def _solve(
        self,
        raised: frozenset[Leg],
        pose: Float[np.ndarray, "6"],
        joints: Float[np.ndarray, "12"],
        p_feet: Float[np.ndarray, "4 3"],
    ) -> Float[np.ndarray, "19"]:
        """The balanced configuration nearest to ``pose`` that keeps the greatest margin.

        Standing still, the CoM above the support polygon is all that balance asks for (McGhee &
        Frank 1968, static stability margin); the check adds what accelerations need.
        """
        if len(raised) > 1:
            names = " and ".join(leg.name for leg in sorted(raised))
            raise IkError(f"{names} are raised at once: two feet cannot balance the trunk")
        (leg,) = raised
        start = configurations(pose[None], joints[None])[0]
        best: IkError | None = None
        for margin in MARGINS:
            targets = PoseTargets(
                p_world_feet=p_feet,
                rpy=(float(pose[3]), float(pose[4]), float(pose[5])),
                height=float(pose[2]),
                raised=leg,
                com_margin=margin,
                joint_margin=JOINT_MARGIN,
            )
            try:
                return solve_pose(self._model, targets, start)
            except IkError as error:
                best = error
        raise IkError(f"no pose balances without foot {leg.name}: {best}")


def nearest(times: Times, t: float) -> int:
    """Index of the one of the increasing ``times`` that is nearest to ``t``, the first of two."""
    after = min(int(np.searchsorted(times, t)), len(times) - 1)
    before = max(after - 1, 0)
    return before if abs(float(times[before]) - t) <= abs(float(times[after]) - t) else after
