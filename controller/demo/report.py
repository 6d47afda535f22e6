"""What came of a demo: every step with its figures, and the totals."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import asdict, dataclass


@dataclass(frozen=True, slots=True)
class Measurement:
    """One measured quantity.

    Attributes:
        name: what was measured.
        measured: in ``unit``; nan if it could not be measured.
        unit: unit of all three numbers.
        asked: what it should be, or None if nothing was asked.
        tolerance: greatest accepted distance from ``asked``; None accepts any.
    """

    name: str
    measured: float
    unit: str
    asked: float | None = None
    tolerance: float | None = None

    @property
    def is_met(self) -> bool:
        """Whether what was asked was measured."""
        if self.asked is None or self.tolerance is None:
            return True
        return abs(self.measured - self.asked) <= self.tolerance  # False for nan

    def __str__(self) -> str:
        """One line for a person."""
        text = f"{self.name} {self.measured:.3g} {self.unit}"
        if self.asked is None:
            return text
        text += f", asked {self.asked:.3g}"
        return text if self.tolerance is None else f"{text} +- {self.tolerance:.2g}"


@dataclass(frozen=True, slots=True)
class StepResult:
    """What came of one step.

    Attributes:
        name: identifies the step.
        label: says what was to be done.
        ok: whether the measurements show that it was done.
        reason: why, in plain words.
        start: plant time [s] at which it began.
        duration: robot time [s] that it took.
        figures: what was measured.
    """

    name: str
    label: str
    ok: bool
    reason: str
    start: float
    duration: float
    figures: tuple[Measurement, ...] = ()

    @property
    def verdict(self) -> str:
        """A few words for a person."""
        return "ok" if self.ok else f"NOT DONE: {self.reason}"


@dataclass(frozen=True, slots=True)
class DemoTotals:
    """Figures over all steps.

    Attributes:
        peak_torque_ratio: greatest |torque| / limit of any joint since the controller started.
        peak_speed_ratio: greatest |joint velocity| / limit of any joint since then; MuJoCo does
            not enforce it, above 1 is not physical.
        least_support_margin: least distance [m] of the CoM's ground projection to the edge of the
            support triangle while on three legs; nan if it never stood on three.
        least_foot_load: least normal force [N] of a supporting foot while on three legs; nan as
            above.
        qp_failures: ticks in which the whole-body QP had no solution.
        robot_time: time [s] that passed for the robot.
        cpu_time: processor time [s] of control and physics for it, start-up and measuring excluded.
    """

    peak_torque_ratio: float
    peak_speed_ratio: float
    least_support_margin: float
    least_foot_load: float
    qp_failures: int
    robot_time: float
    cpu_time: float

    @property
    def real_time_factor(self) -> float:
        """Robot time per processor time; above 1 is faster than real time."""
        return self.robot_time / self.cpu_time if self.cpu_time > 0.0 else math.nan


@dataclass(frozen=True, slots=True)
class DemoReport:
    """Everything that a demo measured."""

    steps: tuple[StepResult, ...]
    totals: DemoTotals

    @property
    def ok(self) -> bool:
        """Whether every step was done."""
        return all(step.ok for step in self.steps)

    def as_dict(self) -> dict[str, object]:
        """Plain values for JSON; what could not be measured is None."""
        totals = asdict(self.totals) | {"real_time_factor": self.totals.real_time_factor}
        values = {"ok": self.ok, "totals": _without_nan(totals)}
        return values | {"steps": self.steps_as_dicts(self.steps)}

    @staticmethod
    def steps_as_dicts(steps: Sequence[StepResult]) -> object:
        """Plain values of ``steps`` for JSON."""
        return _without_nan([asdict(step) for step in steps])


def _without_nan(value: object) -> object:
    if isinstance(value, dict):
        return {key: _without_nan(item) for key, item in value.items()}
    if isinstance(value, list | tuple):
        return [_without_nan(item) for item in value]
    return None if isinstance(value, float) and not math.isfinite(value) else value
