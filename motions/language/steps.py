"""Steps: feet that land in new places, one at a time or in a gait."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import TypeVar

from jaxtyping import Float
import numpy as np

from go2_wbc.curves import Ease
from go2_wbc.errors import TimelineError
from go2_wbc.legs import Leg
from motions.arguments import positive, quantity, word
from motions.keys import BalanceShift, StepKey
from motions.language.written import Written

STEP_HEIGHT = 0.05
"""Height [m] of a foot above the ground in the middle of a step: own choice."""


@dataclass(frozen=True, slots=True)
class StepGait:
    """In which order feet step, and how far and fast.

    Attributes:
        offsets: of FL, FR, RL, RR: shares of a round at which their swings start.
        period: time [s] of a round, unless it is asked for faster or slower.
        least_period: of the fastest round [s].
        duty: share of a round in which each foot stands.
        stride: longest way [m] in a round.
        turn: largest turn [rad] in a round.
        rest: time [s] on four feet before the first step and after the last one.
        height: of the feet [m] in the middle of a step.
    """

    offsets: tuple[float, float, float, float]
    period: float
    least_period: float
    duty: float
    stride: float
    turn: float
    rest: float
    height: float


STEP_GAITS: Mapping[str, StepGait] = {
    "walk": StepGait(
        offsets=(0.25, 0.75, 0.0, 0.5),
        period=2.0,
        least_period=1.8,
        duty=0.82,
        stride=0.12,
        turn=0.35,
        rest=0.9,
        height=0.05,
    ),
    "trot": StepGait(
        offsets=(0.0, 0.5, 0.5, 0.0),
        period=0.4,
        least_period=0.36,
        duty=0.575,
        stride=0.12,
        turn=0.2,
        rest=0.4,
        height=0.05,
    ),
}
"""Gaits of authored steps: own choice, found in simulation."""
Frame = tuple[float, float, float]

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

    def walk(
        self: _Line,
        x: float = 0.0,
        y: float = 0.0,
        turn: float = 0.0,
        *,
        over: float | None = None,
        gait: str = "walk",
    ) -> _Line:
        """Walk there, straight and turning evenly; with ``over`` alone, on the spot."""
        def frame(share: float) -> Frame:
            return share * x, share * y, share * turn

        return self._stepped(frame, math.hypot(x, y), abs(turn), over, STEP_GAITS[gait])

    def _stepped(self: _Line, frame, length, turn, over, gait: StepGait) -> _Line:
        rounds = max(math.ceil(length / gait.stride + turn / gait.turn - 1e-9), 1)
        last = max(gait.offsets) + 1.0 - gait.duty - 1.0
        if over is None:
            period = gait.period
            over = (rounds + last) * period + 2 * gait.rest
        else:
            over *= self.beat
            rounds = max(rounds, round((over - 2 * gait.rest) / gait.period - last))
            period = (over - 2 * gait.rest) / (rounds + last)
        if period < gait.least_period - 1e-9:
            raise TimelineError("too short")
        start = self.cursor
        swing = (1.0 - gait.duty) * period
        keys = [BalanceShift(start, start + over, Ease.MINIMUM_JERK, frozenset(), is_swaying=True)]
        for n in range(rounds):
            for leg in Leg:
                t = start + gait.rest + (n + gait.offsets[leg]) * period
                keys.append(
                    StepKey(
                        t,
                        t + swing,
                        Ease.MINIMUM_JERK,
                        leg,
                        frame((n + 1) / rounds),
                        gait.height,
                        since=start,
                        lead=(period - swing) / 2,
                        is_square=True,
                    )
                )
        return self._longer(keys, start + over)
