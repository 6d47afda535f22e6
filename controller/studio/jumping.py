"""Motions of which some jumps have no plan: they are shown all the same, and rest meanwhile."""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import replace
from typing import final

from controller.studio.orders import Order, TooLong
from controller.studio.plain import LOOKED_FOR, NO_WAY, UNSOLVED
from go2_wbc.curves import Ease
from go2_wbc.world import World
from motions import CheckedMotion, FeasibilityChecker, Timeline
from motions.dynamics.phases import Phase, Progress
from motions.language.keys import BodyKey, Key, PhaseKey
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

    def evaluate(self, line: Timeline, order: Order) -> CheckedMotion:
        """What the check says of it; of an order that is to be shown, without what was not found.

        Raises:
            TooLong: if a jump was not found in time, and the order is not to be shown without.
        """
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
