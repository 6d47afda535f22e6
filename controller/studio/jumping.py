"""Motions of which some part has no plan yet: they are shown all the same.

The robot rests in the place of a jump. Where the nearest motion is asked for, what is written
stands for it: a coarse answer at once, and while something is dragged.
"""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import replace
from typing import final

from controller.studio.orders import Order, Task, TooLong
from controller.studio.plain import LOOKED_FOR, NO_WAY, UNSOLVED
from go2_wbc.curves import Ease
from go2_wbc.world import World
from motions import CheckedMotion, FeasibilityChecker, Timeline
from motions.dynamics.phases import Phase, Progress
from motions.language.keys import BodyKey, Key, PhaseKey
from motions.language.timeline_data import AS_WRITTEN, NEAREST
from motions.memory import Memory
from motions.plan.compiled_plan import CompiledPlan, Problem

Phases = tuple[Phase, ...]


@final
class Jumps:
    """Checks motions, and knows for which jumps no plan was found in time.

    Attributes:
        checker: with what it has worked out for the world that it is in.
    """

    def __init__(self, progress: Progress) -> None:
        self._progress, self._given_up = progress, set[Phases]()
        self.checker = FeasibilityChecker(memory=Memory(), progress=progress)

    def meet(self, world: World) -> None:
        """Check in ``world`` from now on; nothing that was worked out in another holds there."""
        felt = replace(world, sensors="ideal")  # the check has no equation for sensors
        if felt != self.checker.world:
            model = self.checker.model
            self.checker = FeasibilityChecker(
                model, world=felt, memory=Memory(), progress=self._progress
            )

    def evaluate(self, line: Timeline, order: Order) -> tuple[CheckedMotion, bool]:
        """What the check says of it, and whether coarsely: of what is written, not of the nearest.

        Of an order that is to be shown, without what was not found.

        Raises:
            TooLong: if that was not found in time, and the order is not to be shown without.
        """
        if line.physics != NEAREST:
            return self._evaluated(line, order), False
        if order.task is not Task.DRAFT:
            try:
                return self.checker.evaluate(line), False
            except TooLong:
                if not order.is_shown:
                    raise
        return self._evaluated(replace(line, physics=AS_WRITTEN), order), True

    def _evaluated(self, line: Timeline, order: Order) -> CheckedMotion:
        blocks = line.in_order(PhaseKey)
        if not order.is_shown or not blocks:
            return self.checker.evaluate(line)
        if order.is_afresh:
            self._given_up.clear()
        kept = set[Phases]()
        for block in blocks:
            if block.phases in self._given_up:
                continue
            try:
                self.checker.plan(_resting(line, {*kept, block.phases}), check=False)
                kept.add(block.phases)
            except TooLong:
                self._given_up.add(block.phases)
        plan = self.checker.plan(_resting(line, kept), check=False)
        if isinstance(plan, CompiledPlan):
            reason = LOOKED_FOR if order.is_looked_for else NO_WAY
            missing = tuple(
                Problem(UNSOLVED, "trunk", 0.5 * (one.start + one.end), reason=reason)
                for one in blocks
                if one.phases not in kept
            )
            plan = replace(plan, problems=(*plan.problems, *missing))
        return self.checker.evaluate(plan)


def _resting(line: Timeline, kept: Collection[Phases]) -> Timeline:
    """With rest in the place of all jumps but those that are ``kept``."""

    def other(key: Key) -> Key:
        if not isinstance(key, PhaseKey) or key.phases in kept:
            return key
        return BodyKey(key.start, key.end, Ease.LINEAR, "z", 0.0)

    return replace(line, keys=tuple(map(other, line.keys)))
