"""Pushes of the base, and how large an impulse a robot survives."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from benchmarks.scenario import Direction, Measurement, Metric

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


@dataclass(frozen=True, slots=True)
class PushMetric:
    """The largest impulse that is survived.

    Attributes:
        metric: its row of the report, in N s.
        directions: all of them must be survived; of ``DIRECTIONS``.
        first: impulse [N s] with which the search begins.
    """

    metric: Metric
    directions: tuple[str, ...]
    first: float


def push_metrics(prefix: str, item: str, lateral: float, forward: float) -> tuple[PushMetric, ...]:
    """Both sides, ahead and back, with the thresholds [N s]; the last one informs only."""

    def metric(name: str, threshold: float | None) -> Metric:
        quantity = f"{name} impulse"
        return Metric(f"{prefix}_{name}", item, quantity, "N s", threshold, Direction.AT_LEAST)

    return (
        PushMetric(metric("lateral", lateral), ("left", "right"), lateral),
        PushMetric(metric("forward", forward), ("forward",), forward),
        PushMetric(metric("backward", None), ("backward",), forward),
    )


def force_of(impulse: float, direction: str) -> np.ndarray:
    """Force (3,) [N] that gives ``impulse`` [N s] in ``PUSH_TIME``."""
    return np.array(DIRECTIONS[direction]) * impulse / PUSH_TIME


def measure_impulses(pushes: tuple[PushMetric, ...], failure_of: FailureOf) -> Measurement:
    """Search the largest impulse of every metric.

    A metric below its threshold counts as failed, with what went wrong at the least impulse.
    """
    values: dict[str, float] = {}
    failures: dict[str, str] = {}
    for push in pushes:
        name, threshold = push.metric.name, push.metric.threshold
        values[name], reason = _search(push, failure_of)
        if threshold is not None and values[name] < threshold:
            failures[name] = reason
    return Measurement(values, failures)


def _search(push: PushMetric, failure_of: FailureOf) -> tuple[float, str]:
    """The largest impulse [N s] that is survived, and why the least of the others is not."""
    failures: dict[float, str] = {}

    def survives(impulse: float) -> bool:
        for direction in push.directions:
            failure = failure_of(impulse, direction)
            if failure is not None:
                failures[impulse] = f"{impulse:g} N s {direction}: {failure}"
                return False
        return True

    largest = largest_impulse(survives, push.first)
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
