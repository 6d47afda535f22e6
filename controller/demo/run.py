"""Runs the demo on a controller and measures it. No files, no printing."""

from __future__ import annotations

import math
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from controller.demo.steps import (
    DEMO_STEPS,
    DemoReport,
    DemoStep,
    DemoTotals,
    Measurement,
    StepResult,
    StepRun,
)
from controller.go2_controller import GO2Controller
from controller.modes import Mode
from go2_wbc.errors import ClosedError, Go2WbcError, PlantError
from go2_wbc.recording import Recording

MEASUREMENT_RATE = 100.0  #: Samples a second from which the measurements of a step are taken
TOTALS_RATE = 500.0  #: Samples a second for the least margins and loads: short dips count


@dataclass(frozen=True, slots=True)
class DemoProgress:
    """Where a running demo is; told once when a step begins and once when it has ended.

    Attributes:
        index, count, label: of the step, from 0, how many there are, and what it does.
        result: what came of it; None when it begins.
    """

    index: int
    count: int
    label: str
    result: StepResult | None = None


def run_demo(
    go2: GO2Controller,
    on_progress: Callable[[DemoProgress], None] | None = None,
    steps: Sequence[DemoStep] = DEMO_STEPS,
) -> DemoReport:
    """Run the steps one after the other and measure each.

    A failed step does not end the demo, a fall does: the steps after it are reported as not run.

    Args:
        go2: the robot; any plant, any configuration, lying or standing.
        on_progress: is told when a step begins and when it has ended.

    Raises:
        PlantError: if the plant fails.
        ClosedError: if the controller is closed.
    """
    report = on_progress or (lambda _progress: None)
    failures_before = go2.telemetry.qp_failures
    started, cpu_time = go2.state.time, 0.0
    results: list[StepResult] = []
    for index, step in enumerate(steps):
        report(DemoProgress(index, len(steps), step.label))
        result, used = _run_step(go2, step)
        cpu_time += used
        results.append(result)
        report(DemoProgress(index, len(steps), step.label, result))
    margin, load = three_leg_minima(_window(go2.recording(TOTALS_RATE), started, math.inf))
    totals = DemoTotals(
        peak_torque_ratio=go2.telemetry.peak_torque_ratio,
        peak_speed_ratio=go2.telemetry.peak_speed_ratio,
        least_support_margin=margin,
        least_foot_load=load,
        qp_failures=go2.telemetry.qp_failures - failures_before,
        robot_time=go2.state.time - started,
        cpu_time=cpu_time,
    )
    return DemoReport(tuple(results), totals)


def three_leg_minima(recording: Recording) -> tuple[float, float]:
    """Least support margin [m] and least load [N] of a supporting foot while on three legs.

    Both are nan if the robot never stood on exactly three.
    """
    rows = recording.stance.sum(axis=1) == 3
    if not rows.any():
        return math.nan, math.nan
    loads = recording.foot_forces[rows][recording.stance[rows]]
    return float(recording.support_margin[rows].min()), float(loads.min())


def _run_step(go2: GO2Controller, step: DemoStep) -> tuple[StepResult, float]:
    """What came of ``step``, and the processor time [s] of control and physics."""
    start, cpu_start = go2.state.time, time.process_time()
    if go2.mode is Mode.FALLEN:
        reason = "not run: the robot has fallen"
        return StepResult(step.name, step.label, False, reason, start, 0.0), 0.0
    try:
        answer, refusal = step.act(go2), ""
    except (PlantError, ClosedError):
        raise
    except Go2WbcError as error:
        answer, refusal = False, str(error).splitlines()[0]
    cpu_time = time.process_time() - cpu_start
    end = go2.state.time
    recording = _window(go2.recording(MEASUREMENT_RATE), start, end)
    is_measured = not refusal and len(recording.time) > 0
    figures = step.measure(StepRun(go2.last_outcome, recording)) if is_measured else ()
    reason = refusal or _failure(go2, answer, figures)
    result = StepResult(
        step.name, step.label, not reason, reason or "done", start, end - start, figures
    )
    return result, cpu_time


def _failure(go2: GO2Controller, answer: bool | None, figures: Sequence[Measurement]) -> str:
    """Why a step does not count as done; empty if it does."""
    if answer is False or not go2.last_outcome.ok:
        return go2.last_outcome.reason
    if go2.mode in (Mode.FALLEN, Mode.DAMPED):
        return f"the robot is {go2.mode.value}"
    missed = [str(figure) for figure in figures if not figure.is_met]
    if missed:
        return "; ".join(missed)
    return "" if figures else "nothing was measured"


def _window(recording: Recording, start: float, end: float) -> Recording:
    """The samples from the last one at or before ``start`` up to ``end`` [s]."""
    first, last = np.searchsorted(recording.time, (start + 1e-9, end + 1e-9))
    return recording.part(slice(max(int(first) - 1, 0), int(last)))
