"""Steps: feet that land in new places, one at a time or in a gait."""

from __future__ import annotations

from typing import TypeVar

from go2_wbc.curves import Ease
from go2_wbc.errors import TimelineError
from go2_wbc.legs import Leg
from motions.arguments import positive, quantity, word
from motions.keys import StepKey
from motions.language.written import Written

STEP_HEIGHT = 0.05
"""Height [m] of a foot above the ground in the middle of a step: own choice."""

_Line = TypeVar("_Line", bound="Steps")


class Steps(Written):
    """Where the robot goes."""

    __slots__ = ()

    def step(
        self: _Line,
        leg: Leg | str,
        x: float = 0.0,
        y: float = 0.0,
        *,
        yaw: float = 0.0,
        over: float,
        height: float = STEP_HEIGHT,
    ) -> _Line:
        """Put a foot down in a new place; from then on offsets and ``home`` count from there.

        Args:
            leg: whose foot, on the ground.
            x, y: its way [m] along the heading of the four feet, and to the left of it.
            yaw: angle [rad] by which it also goes round the middle of the four feet.
            over: how long the foot is in the air.
            height: of the foot [m] in the middle of its way.
        """
        which = word("foot", leg, Leg.__members__)
        if which in self.raised:
            raise TimelineError(f"step(): foot {which.name} is raised: put it down() before")
        place = (quantity("x", x), quantity("y", y), quantity("yaw", yaw))
        rise = positive("height", quantity("height", height))
        line = self._shifted(self.raised | {which})
        start, end = line._span(over)
        key = StepKey(start, end, Ease.MINIMUM_JERK, which, place, rise, since=start)
        return line._longer([key], end)
