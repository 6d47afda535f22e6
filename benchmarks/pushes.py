"""Pushes of the base, and how large an impulse a robot survives."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass

import numpy as np

from benchmarks.rows import Direction, Measurement, Row

PUSH_TIME = 0.1
"""Duration [s] of a push."""
RUNG = 2.0
"""N s between the impulses that are tried."""
CLIMB = 1
"""Rungs that are tried above the first; what lies beyond is not looked for."""

Heading = tuple[float, float, float]
"""A unit vector ahead, left, up of the robot."""


@dataclass(frozen=True, slots=True)
class PushRow:
    """A row of impulses.

    Attributes:
        row: its line in the report, in N s.
        directions: all of them must be survived.
        first: impulse [N s] with which the search begins.
    """

    row: Row
    directions: tuple[Heading, ...]
    first: float


def push_rows(prefix: str, item: str, lateral: float, forward: float) -> tuple[PushRow, ...]:
    """Rows for both sides, ahead and back; the last one informs only."""

    def row(name: str, bar: float | None) -> Row:
        return Row(f"{prefix}_{name}", item, f"{name} impulse", "N s", bar, Direction.AT_LEAST)

    return (
        PushRow(row("lateral", lateral), ((0.0, 1.0, 0.0), (0.0, -1.0, 0.0)), lateral),
        PushRow(row("forward", forward), ((1.0, 0.0, 0.0),), forward),
        PushRow(row("backward", None), ((-1.0, 0.0, 0.0),), forward),
    )


def force_of(impulse: float, direction: Heading) -> np.ndarray:
    """Force (3,) [N] that gives ``impulse`` [N s] in ``PUSH_TIME``."""
    return np.array(direction) * impulse / PUSH_TIME


def measure_rungs(
    rows: tuple[PushRow, ...], fault_of: Callable[[float, Heading], str | None]
) -> Measurement:
    """Searches the largest impulse of every row.

    ``fault_of(impulse, direction)`` pushes a robot and says what went wrong, or None. A row below
    its bar counts as a failure, with the last thing that went wrong.
    """
    values: dict[str, float] = {}
    failures: dict[str, str] = {}
    for item in rows:
        faults: dict[float, str] = {}

        def survives(impulse: float, item: PushRow = item, faults: dict = faults) -> bool:
            for direction in item.directions:
                fault = fault_of(impulse, direction)
                if fault is not None:
                    faults[impulse] = f"{impulse:g} N s towards {_words(direction)}: {fault}"
                    return False
            return True

        row = item.row
        values[row.name] = highest_rung(survives, item.first)
        if row.bar is not None and values[row.name] < row.bar:
            failures[row.name] = _of_lowest(faults)
    return Measurement(values, failures)


def highest_rung(survives: Callable[[float], bool], first: float) -> float:
    """The largest impulse [N s] that is survived, beginning at ``first``.

    From a survived first rung it goes up until one is not survived, by ``CLIMB`` rungs at most;
    from one that is not, down until one is. Zero if none is.
    """
    impulse = first
    if not survives(impulse):
        impulse -= RUNG
        while impulse > 0.0 and not survives(impulse):
            impulse -= RUNG
        return max(impulse, 0.0)
    for _ in range(CLIMB):
        if not survives(impulse + RUNG):
            break
        impulse += RUNG
    return impulse


def _of_lowest(faults: Mapping[float, str]) -> str:
    return faults[min(faults)] if faults else ""


def _words(direction: Heading) -> str:
    x, y, z = direction
    return {x: "the front", -x: "the back", y: "the left", -y: "the right", z: "the sky"}.get(
        1.0, "the ground"
    )
