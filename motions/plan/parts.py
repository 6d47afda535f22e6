"""Splits a timeline into parts that can be compiled separately, and stored.

A part begins and ends with the robot at rest, standing at home on the feet that it has stepped to:
it does not depend on what is written before. The splines of parts have zero speed at both ends; so,
to good accuracy, have those of the whole motion after a pause, or between minimum-jerk moves, which
rest there.
"""

from __future__ import annotations

from itertools import accumulate, islice, takewhile

from go2_wbc.curves import Ease
from go2_wbc.motion_plan import Posture
from motions.language.keys import (
    BalanceShift,
    BodyKey,
    BodyPathKey,
    Key,
    LegKey,
    Mark,
    PostureKey,
    StepKey,
)
from motions.language.timeline import Timeline
from motions.language.timeline_data import SAME

PAUSE = 0.15
"""Time [s] without a move after which it does not matter how the last one came to rest: 15 samples,
over which a spline forgets to a part in 10^8."""
DECIMALS = 9  #: Of instants [s] that tell parts apart: less is rounding


def rests(line: Timeline) -> list[float]:
    """Instants [s] at which it falls into parts, in order; none of a motion that never rests."""
    keys = sorted((key for key in line.keys if not isinstance(key, Mark)), key=lambda k: k.start)
    ends = list(accumulate(map(_end, keys), max))
    begins = list(accumulate(map(_begin, reversed(keys)), min))[::-1]
    found, first, away = list[float](), 0, set[object]()
    posture = line.entry
    for row, key in enumerate(keys[:-1]):
        posture = key.posture if isinstance(key, PostureKey) else posture
        what, is_away = _left(key)
        (away.add if is_away else away.discard)(what)
        end, begin = ends[row], begins[row + 1]
        if away or posture is not Posture.STAND or begin < end - SAME:
            continue
        beside = [one for one in keys[first : row + 1] if _end(one) > end - PAUSE]
        beside += takewhile(lambda key: key.start < end + PAUSE, islice(keys, row + 1, None))  # noqa: B023
        if begin - end > PAUSE or all(map(_is_smooth, beside)):
            found.append(end)
            first = row + 1
    return found


def _left(key: Key) -> tuple[object, bool]:
    """What a key moves, and whether it leaves it elsewhere than at home."""
    if isinstance(key, BodyKey):
        return key.track, key.value != 0.0
    if isinstance(key, LegKey):
        return key.track, not key.target.is_on_ground
    if isinstance(key, BalanceShift):
        return key.track, bool(key.raised)
    return None, False


def _begin(key: Key) -> float:
    return min(key.start - key.lead, key.since) if isinstance(key, StepKey) else key.start


def _end(key: Key) -> float:
    return key.end + key.lead if isinstance(key, StepKey) else key.end


def _is_smooth(key: Key) -> bool:
    return key.ease is Ease.MINIMUM_JERK and not isinstance(key, BodyPathKey)
