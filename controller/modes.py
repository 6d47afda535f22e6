"""Modes of the robot, and what comes of what it is asked to do."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from enum import Enum

from go2_wbc.brief import brief


class Mode(Enum):
    """What the robot is doing between calls."""

    LYING = "lying"
    STANDING = "standing"
    SITTING = "sitting"
    WALKING = "walking"
    MOVING = "moving"
    FALLEN = "fallen"
    DAMPED = "damped"
    CLOSED = "closed"

    @property
    def is_upright(self) -> bool:
        """Whether the robot is on its feet."""
        return self in (Mode.STANDING, Mode.SITTING, Mode.WALKING, Mode.MOVING)


Measurements = Mapping[str, float]
"""Measured quantities by name with unit."""
Limited = Mapping[str, tuple[float, float | None]]
"""What was measured, by name with unit: the value, and what it must stay below, if anything."""


@dataclass(frozen=True, slots=True)
class Outcome:
    """What came of a blocking call, or of a job.

    Attributes:
        ok: whether the measured state shows that it was done.
        reason: why, in plain words.
        duration: robot time [s] that it took.
        measured: the measured quantities that the verdict rests on, by name with unit.
        cancelled: whether a job ended early because it was called off.
        is_refused: whether a job was never begun.
        error: what a job raised, if anything.
    """

    ok: bool
    reason: str
    duration: float = 0.0
    measured: Measurements = field(default_factory=dict)
    cancelled: bool = field(default=False, repr=False)
    is_refused: bool = field(default=False, repr=False)
    error: Exception | None = field(default=None, repr=False)

    __repr__ = brief

    def __bool__(self) -> bool:
        """Truth of the outcome is ``ok``."""
        return self.ok


class Aborted(Exception):
    """A procedure did not reach its end; the message says why, ``measured`` what was measured."""

    def __init__(self, reason: str, measured: Measurements | None = None) -> None:
        super().__init__(reason)
        self.measured = dict(measured or {})


def are_within(measured: Limited) -> bool:
    """Whether every value is below its limit."""
    return not _beyond(measured)


def told(measured: Limited) -> str:
    """What of it is not below its limit, each with the limit, in one line."""
    return ", ".join(
        f"{name} {value:.3g}, limit {limit:.3g}" for name, value, limit in _beyond(measured)
    )


def _beyond(measured: Limited) -> list[tuple[str, float, float]]:
    return [
        (name, value, limit)
        for name, (value, limit) in measured.items()
        if limit is not None and not value < limit
    ]


def listed(measured: Measurements) -> str:
    """``measured`` in one line."""
    return ", ".join(f"{name} {value:.3g}" for name, value in measured.items())
