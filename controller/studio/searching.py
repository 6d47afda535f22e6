"""What is looked for while edits go on: the most of a number that the robot can do."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence

from controller.studio.edits import edited, run_of, site_of
from controller.studio.orders import Bar
from controller.studio.source import Source
from go2_wbc.errors import StudioError

FINEST = 0.01, 1.0  #: How near [m, deg] to the most that can be done it is looked for


def most(
    source: Source,
    order: Mapping[str, object],
    bars: Sequence[Bar],
    motion: str,
    can_do: Callable[[bytes, int], bool],
) -> float | None:
    """The most of an argument that can be done, between what is saved and what is asked for.

    Args:
        source: the text that is saved.
        order: the "set" that asks for too much, with the callers of its bar.
        bars: of the text.
        motion: the name of the motion.
        can_do: whether the robot can do the bar of that place in another text.

    Raises:
        StudioError: if it is no number.
        ValueError: if no bar is meant.
    """
    site, run, asked = site_of(order.get("site")), run_of(order), order.get("value")
    found = [one for one in source.slots(site, run) if one.name == order.get("name")]
    low = found[0].value if found else 0.0
    if not isinstance(asked, int | float) or not isinstance(low, int | float):
        raise StudioError("only of a number there is a most")
    index = [(bar.site, bar.number) for bar in bars].index((site, run.number))
    step, best, high = FINEST[bool(found) and found[0].is_angle], None, float(asked)
    while abs(high - low) > 1.5 * step:
        middle = round(step * round(0.5 * (low + high) / step), 2)
        after = edited(source, {**order, "op": "set", "value": middle}, motion)
        if can_do(after.data, index):
            best = low = middle
        else:
            high = middle
    return best
