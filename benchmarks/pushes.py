"""Pushes of the base, and how large an impulse a robot survives."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence

import numpy as np

from benchmarks.study import Direction, Measurement, Metric

PUSH_TIME = 0.1
"""Duration [s] of a push."""
IMPULSE_STEP = 2.0
"""N s between the impulses that are tried."""
DIRECTIONS: dict[str, tuple[float, float, float]] = {
    "forward": (1.0, 0.0, 0.0),
    "backward": (-1.0, 0.0, 0.0),
    "left": (0.0, 1.0, 0.0),
    "right": (0.0, -1.0, 0.0),
    "up": (0.0, 0.0, 1.0),
    "down": (0.0, 0.0, -1.0),
}
"""Unit vectors ahead, left, up of the robot."""
FailureOf = Callable[[float, str], str | None]
"""Pushes a robot with an impulse [N s] in a direction; says what went wrong, or None."""


def heading_force(angle: float, impulse: float) -> np.ndarray:
    """Force (3,) [N] that gives ``impulse`` [N s] at ``angle`` [rad] from ahead to the left."""
    return impulse / PUSH_TIME * np.array([math.cos(angle), math.sin(angle), 0.0])


def push_metrics(prefix: str, item: str, lateral: float, forward: float) -> tuple[Metric, ...]:
    """Both sides, ahead and back, with the thresholds [N s]; the last one informs only."""
    thresholds = {"lateral": lateral, "forward": forward, "backward": None}
    return tuple(
        Metric(f"{prefix}_{name}", item, f"{name} impulse", "N s", least, Direction.AT_LEAST)
        for name, least in thresholds.items()
    )


def directions_of(metric: Metric) -> tuple[str, ...]:
    """The directions in which an impulse must be survived."""
    name = metric.quantity.split()[0]
    return ("left", "right") if name == "lateral" else (name,)


def force_of(impulse: float, direction: str) -> np.ndarray:
    """Force (3,) [N] that gives ``impulse`` [N s] in ``PUSH_TIME``."""
    return np.array(DIRECTIONS[direction]) * impulse / PUSH_TIME


def measure_impulses(metrics: Sequence[Metric], failure_of: FailureOf) -> Measurement:
    """Search the largest impulse of every metric, from its threshold or the last one on.

    A metric below its threshold counts as failed, with what went wrong at the least impulse.
    """
    values: dict[str, float] = {}
    failures: dict[str, str] = {}
    first = 0.0
    for metric in metrics:
        first = metric.threshold or first
        largest, reason = _search(directions_of(metric), first, failure_of)
        values[metric.name] = largest
        if metric.threshold is not None and largest < metric.threshold:
            failures[metric.name] = reason
    return Measurement(values, failures)


def _search(directions: Sequence[str], first: float, failure_of: FailureOf) -> tuple[float, str]:
    """The largest impulse [N s] that is survived, and why the least of the others is not."""
    failures: dict[float, str] = {}

    def survives(impulse: float) -> bool:
        for direction in directions:
            failure = failure_of(impulse, direction)
            if failure is not None:
                failures[impulse] = f"{impulse:g} N s {direction}: {failure}"
                return False
        return True

    largest = largest_impulse(survives, first)
    return largest, failures[min(failures)] if failures else ""


def largest_impulse(survives: Callable[[float], bool], first: float) -> float:
    """The largest impulse [N s] that is survived, beginning at ``first``.

    From a survived first impulse it goes one step up, and what lies beyond is not looked for; from
    one that is not, down until one is. Zero if none is.
    """
    impulse = first
    while impulse > 0.0 and not survives(impulse):
        impulse -= IMPULSE_STEP
    if impulse == first and survives(first + IMPULSE_STEP):
        return first + IMPULSE_STEP
    return max(impulse, 0.0)
