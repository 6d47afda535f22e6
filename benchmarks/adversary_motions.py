"""Motions for somebody who looks for mistakes of the check: numbers in, a timeline out.

Four families, each a function of numbers from 0 to 1 that are read one after the other, so that a
small change of them is a small change of the motion, mostly. They share nothing with the
validation set. ``size`` multiplies how far the motion goes from standing, and nothing else.
"""

from collections.abc import Callable, Mapping, Sequence
from typing import TypeVar

from go2_wbc.legs import LEGS
from motions import Timeline, deg

_Item = TypeVar("_Item")
COUNT = 40  #: Numbers of a motion; more than any family reads
_NAMES = tuple(leg.name for leg in LEGS)
_TRUNK = {"z": 0.07, "roll": deg(32.0), "pitch": deg(25.0), "yaw": deg(28.0)}
_PLACE = {"x": 0.07, "y": 0.06}
_PAIRS = (("FL", "RR"), ("FR", "RL"), ("FL", "FR"))


class Numbers:
    """Reads the numbers of a motion in their order."""

    def __init__(self, numbers: Sequence[float], size: float = 1.0) -> None:
        """Args: numbers: (COUNT,) from 0 to 1; size: of what the motion does."""
        self._left = iter(numbers)
        self._size = size

    def between(self, low: float, high: float) -> float:
        """From ``low`` to ``high``."""
        return low + (high - low) * next(self._left)

    def far(self, most: float) -> float:
        """From ``-most`` to ``most``, times the size."""
        return self._size * self.between(-most, most)

    def one_of(self, items: Sequence[_Item]) -> _Item:
        """One of them."""
        return items[min(int(next(self._left) * len(items)), len(items) - 1)]

    def trunk(self, line: Timeline, sizes: Mapping[str, float], over: float) -> Timeline:
        """``line`` and a move of the trunk on two of ``sizes``."""
        first = self.one_of(tuple(sizes))
        second = self.one_of(tuple(name for name in sizes if name != first))
        far = {first: self.far(sizes[first]), second: self.far(0.6 * sizes[second])}
        return line.body(**far, over=over, ease="minimum_jerk")


def _swaying(n: Numbers, way: Timeline) -> Timeline:
    """``way`` with the trunk moved meanwhile."""
    leans, over = Timeline().hold(n.between(0.0, 0.8)), n.between(0.35, 1.6)
    for _ in range(n.one_of((1, 2, 3))):
        leans = n.trunk(leans, _TRUNK, over)
    return Timeline().together(way, leans.home(over=over))


def _went(n: Numbers, gait: str, far: float) -> Timeline:
    """A walk anywhere, at its own pace or slower."""
    goal = n.far(far), n.far(0.5 * far), deg(n.far(110.0))
    way = Timeline().walk(*goal, gait=gait)
    return Timeline().walk(*goal, over=way.end * n.one_of((1.0, 1.0, 1.15)), gait=gait)


def trots(n: Numbers) -> Timeline:
    """A trot somewhere, the trunk moving on the way."""
    return _swaying(n, _went(n, "trot", 0.6))


def steps(n: Numbers) -> Timeline:
    """Single steps and moves of the trunk, or a walk of single steps with the trunk moving."""
    if n.one_of((True, False, False)):
        return _swaying(n, _went(n, "walk", 0.3))
    line = Timeline(shift_time=n.between(0.35, 0.9))
    for _ in range(n.one_of((1, 2, 3))):
        place, yaw = (n.far(0.11), n.far(0.07)), deg(n.far(12.0))
        line = line.step(n.one_of(_NAMES), *place, yaw=yaw, over=n.between(0.2, 0.8))
        line = n.trunk(line, {**_TRUNK, **_PLACE}, n.between(0.25, 0.9))
    return line.home(over=n.between(0.35, 0.9))


def static(n: Numbers) -> Timeline:
    """Leans to and fro, a foot raised and what the trunk does meanwhile, weight shifts."""
    line = Timeline(shift_time=n.between(0.3, 0.9))
    for _ in range(n.one_of((1, 1, 2))):
        line = n.trunk(line, {**_TRUNK, **_PLACE}, n.between(0.25, 0.9))
    for leg in (n.one_of(_NAMES), n.one_of(_NAMES))[: n.one_of((0, 1, 1, 2))]:
        over, z = n.between(0.2, 0.8), 0.02 + abs(n.far(0.15))
        line = line.foot(leg, x=n.far(0.1), y=n.far(0.08), z=z, over=over)
        line = line.hold(n.between(0.0, 0.4))
        line = n.trunk(line, {**_TRUNK, **_PLACE}, n.between(0.3, 0.9))
        line = line.down(leg, over=n.between(0.2, 0.7))
    return line.home(over=n.between(0.35, 0.9))


def _leap(n: Numbers, line: Timeline) -> Timeline:
    kind, height = n.one_of(("jump", "hop", "rear", "lift", "pounce")), n.between(0.05, 0.12)
    far, turn, hold = n.far(0.3), deg(n.far(70.0)), n.between(0.25, 0.7)
    if kind == "jump":
        return line.jump(far, n.far(0.15), turn, height)
    if kind == "hop":
        return line.hop(n.one_of((1, 2)), height=0.6 * height, period=n.between(0.5, 0.7))
    if kind == "rear":
        return line.rear(-deg(12.0) - abs(turn) / 3.0, hold=hold)
    if kind == "lift":
        return line.lift(n.one_of(_PAIRS), hold=hold, height=0.7 * height)
    return line.pounce(abs(far) + 0.05, height=height, crouch=hold + 0.1)


def solved(n: Numbers) -> Timeline:
    """One or two solved parts, and before them, between them and after them moves of the trunk."""
    line, over = Timeline(), n.between(0.3, 0.8)
    for _ in range(n.one_of((1, 1, 2))):
        if n.one_of((True, False)):
            line = n.trunk(line, _TRUNK, over).home(over=over)
        line = _leap(n, line).hold(n.between(0.05, 0.3))
    return n.trunk(line, _TRUNK, over).home(over=over)


Write = Callable[[Numbers], Timeline]
FAMILIES: dict[str, Write] = {one.__name__: one for one in (trots, static, steps, solved)}
"""By their names."""
