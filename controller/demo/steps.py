"""The demo as data: what is done, what is measured of it, and the report; and what runs it.

No files, no printing.
"""

from __future__ import annotations

import math
import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import asdict, dataclass, replace

import numpy as np
from jaxtyping import Float

from controller.go2_controller import GO2Controller
from controller.modes import ANGLE_TOLERANCE, HEIGHT_TOLERANCE, STILL_SPEED, Mode, Outcome
from controller.navigation import HEADING_TOLERANCE
from go2_wbc.errors import ClosedError, Go2WbcError, PlantError
from go2_wbc.plant.terrain import BOTH, Blocks, Course, Gap, Stairs, Stones, Terrain
from go2_wbc.recording import Recording
from go2_wbc.robot.description import find_profile


@dataclass(frozen=True, slots=True)
class Measurement:
    """One measured quantity."""

    name: str  #: what was measured
    measured: float  #: in ``unit``; nan if it could not be measured
    unit: str  #: of all three numbers
    asked: float | None = None  #: what it should be, or None if nothing was asked
    tolerance: float | None = None  #: greatest accepted distance from ``asked``; None for any

    @property
    def is_met(self) -> bool:
        """Whether what was asked was measured."""
        if self.asked is None or self.tolerance is None:
            return True
        return abs(self.measured - self.asked) <= self.tolerance  # False for nan

    def __str__(self) -> str:
        text = f"{self.name} {self.measured:.3g} {self.unit}"
        if self.asked is None:
            return text
        text += f", asked {self.asked:.3g}"
        return text if self.tolerance is None else f"{text} +- {self.tolerance:.2g}"


@dataclass(frozen=True, slots=True)
class StepResult:
    """What came of one step."""

    name: str
    label: str  #: what was to be done
    ok: bool  #: whether the measurements show that it was done
    reason: str  #: why, in plain words
    start: float  #: plant time [s] at which it began
    duration: float  #: robot time [s] that it took
    figures: tuple[Measurement, ...] = ()  #: what was measured

    @property
    def verdict(self) -> str:
        """A few words for a person."""
        return "ok" if self.ok else f"NOT DONE: {self.reason}"


@dataclass(frozen=True, slots=True)
class DemoTotals:
    """Figures over all steps."""

    peak_torque_ratio: float
    """Greatest |torque| / limit of any joint since the controller started."""
    peak_speed_ratio: float
    """Greatest |joint velocity| / limit of any joint since then; MuJoCo does not enforce it, above
    1 is not physical."""
    least_support_margin: float
    """Least distance [m] of the CoM's ground projection to the edge of the support triangle while
    on three legs; nan if it never stood on three."""
    least_foot_load: float
    """Least normal force [N] of a supporting foot while on three legs; nan as above."""
    qp_failures: int  #: ticks in which the whole-body QP had no solution
    robot_time: float  #: time [s] that passed for the robot
    cpu_time: float
    """Processor time [s] of control and physics for it, start-up and measuring excluded."""

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


FORWARD_SPEED = 0.2  #: Speed [m/s] of the walk
FORWARD_TIME = 2.0  #: Duration [s] of the walk
SPEED_UP_TIME = 0.5
"""Time [s] at the start of the walk that does not count for its mean speed; the ramp takes 0.13 s
and the first stride 0.36 s."""
SPEED_TOLERANCE = 0.02  #: Accepted error [m/s] of the mean speed: a tenth of what is asked
STOP_TIME = 1.0  #: Time [s] that the robot gets to come to rest
TURN_ANGLE = math.pi / 2  #: Angle [rad] of the turn, to the left
WAY_TOLERANCE = 0.1  #: Accepted error [m] of the way over a terrain, by the robot's own estimate
HOLD_TIME = 2.0  #: Time [s] for which the paw is held up


@dataclass(frozen=True, slots=True)
class StepRun:
    """One step that has just been run, ready to be measured."""

    outcome: Outcome  #: of its last blocking call
    recording: Recording  #: what happened in it, at least one sample


@dataclass(frozen=True, slots=True)
class DemoStep:
    """One step of the demo."""

    name: str
    label: str  #: what is done, in at most 21 characters
    act: Callable[[GO2Controller], bool | None]
    """Does it; False means that it was not done, None that the figures must tell."""
    measure: Callable[[StepRun], tuple[Measurement, ...]]
    """Figures from what was measured, never from what was commanded."""


def yaw_angles(recording: Recording) -> Float[np.ndarray, " n"]:
    """Heading [rad] of every sample, without jumps of a full turn."""
    x, y, z, w = recording.q[:, 3:7].T
    return np.unwrap(np.arctan2(2.0 * (w * z + x * y), 1.0 - 2.0 * (y * y + z * z)))


def displacement(recording: Recording, start: int = 0) -> Float[np.ndarray, "2"]:
    """Way [m] of the base ahead and to the left, seen from its pose at the sample ``start``."""
    yaw = yaw_angles(recording)[start]
    dx, dy = recording.q[-1, :2] - recording.q[start, :2]
    c, s = math.cos(yaw), math.sin(yaw)
    return np.array([c * dx + s * dy, -s * dx + c * dy])


def _standing(run: StepRun) -> tuple[Measurement, ...]:
    height = _of(run, "CoM height [m]")
    return (Measurement("CoM height", height, "m", find_profile().stand_height, HEIGHT_TOLERANCE),)


def _sitting(run: StepRun) -> tuple[Measurement, ...]:
    height, angle = find_profile().sit
    pitch = math.degrees(angle)
    tolerance = math.degrees(ANGLE_TOLERANCE)
    return (
        Measurement("base height", _of(run, "base height [m]"), "m", height, HEIGHT_TOLERANCE),
        Measurement("trunk pitch", _of(run, "pitch [deg]"), "deg", pitch, tolerance),
    )


def _forward(run: StepRun) -> tuple[Measurement, ...]:
    recording = run.recording
    since = recording.time - recording.time[0]
    steady = min(int(np.searchsorted(since, SPEED_UP_TIME)), len(since) - 1)
    time = float(since[-1] - since[steady])
    speed = float(displacement(recording, steady)[0]) / time if time > 0.0 else math.nan
    ahead, aside = displacement(recording)
    return (
        Measurement("mean speed", speed, "m/s", FORWARD_SPEED, SPEED_TOLERANCE),
        Measurement("way ahead", float(ahead), "m", FORWARD_SPEED * FORWARD_TIME),
        Measurement("way aside", float(aside), "m", 0.0),
    )


def _stopping(run: StepRun) -> tuple[Measurement, ...]:
    speed = float(np.linalg.norm(run.recording.v[-1, :2]))
    way = float(displacement(run.recording)[0])
    return (
        Measurement("speed at the end", speed, "m/s", 0.0, STILL_SPEED),
        Measurement("way to rest", way, "m"),
    )


def _turning(run: StepRun) -> tuple[Measurement, ...]:
    yaw = yaw_angles(run.recording)
    turned, asked = math.degrees(yaw[-1] - yaw[0]), math.degrees(TURN_ANGLE)
    drift = float(np.linalg.norm(displacement(run.recording)))
    return (
        Measurement("turned left", turned, "deg", asked, math.degrees(HEADING_TOLERANCE)),
        Measurement("moved from the place", drift, "m", 0.0),
    )


def _raising_paw(run: StepRun) -> tuple[Measurement, ...]:
    return (
        Measurement("paw held, least height", _of(run, "least paw height [m]"), "m"),
        Measurement("paw held, mean height", _of(run, "mean paw height [m]"), "m"),
    )


def _of(run: StepRun, name: str) -> float:
    return run.outcome.measured.get(name, math.nan)


def _walk_forward(go2: GO2Controller) -> None:
    go2.move(linear_x=FORWARD_SPEED)
    go2.wait(FORWARD_TIME)


def _come_to_rest(go2: GO2Controller) -> None:
    go2.move(linear_x=FORWARD_SPEED)  # refused if there is nothing to stop
    go2.stop()
    go2.wait(STOP_TIME)


DEMO_STEPS: tuple[DemoStep, ...] = (
    DemoStep("stand", "stand up", lambda go2: go2.stand(), _standing),
    DemoStep("sit", "sit", lambda go2: go2.sit(), _sitting),
    DemoStep("walk", "walking mode", lambda go2: go2.walk(), _standing),
    DemoStep("forward", "forward 0.2 m/s, 2 s", _walk_forward, _forward),
    DemoStep("stop", "stop", _come_to_rest, _stopping),
    DemoStep("turn", "turn left 90 deg", lambda go2: go2.turn_left(TURN_ANGLE), _turning),
    DemoStep("high_five", "high five", lambda go2: go2.high_five(hold=HOLD_TIME), _raising_paw),
    DemoStep("sit_again", "sit", lambda go2: go2.sit(), _sitting),
)
"""Stand, sit, walk, forward, stop, turn, high five, sit."""

TERRAINS: Mapping[str, Terrain] = {
    "stairs": Stairs(0.16, 4, 0.31, way=BOTH, landing=1.2),
    "course": Course(
        (Stairs(0.15, 3, 0.31, way=BOTH, landing=1.0), Blocks(0.18, count=1), Stones(), Gap(0.2))
    ),
}
"""What a robot that sees can be shown on, by name."""
BEHIND = 0.6  #: How far [m] behind the end of a terrain its way ends


def terrain_steps(terrain: Terrain) -> tuple[DemoStep, ...]:
    """Stand, walk over a terrain that has an end, and stand."""
    way = terrain.end + BEHIND

    def crossed(run: StepRun) -> tuple[Measurement, ...]:
        ahead, aside = displacement(run.recording)
        climbed = float(np.ptp(run.recording.q[:, 2]))
        return (
            Measurement("way ahead", float(ahead), "m", way, WAY_TOLERANCE),
            Measurement("way aside", float(aside), "m", 0.0),
            Measurement("up and down", climbed, "m"),
        )

    label = f"walk {way:.1f} m by sight"
    cross = DemoStep("cross", label, lambda go2: go2.move_forward(way), crossed)
    stand, _, walk = DEMO_STEPS[:3]
    return stand, walk, cross, replace(stand, name="stand_again")


MEASUREMENT_RATE = 100.0  #: Samples a second from which the measurements of a step are taken
TOTALS_RATE = 500.0  #: Samples a second for the least margins and loads: short dips count


@dataclass(frozen=True, slots=True)
class DemoProgress:
    """Where a running demo is; told once when a step begins and once when it has ended."""

    index: int  #: of the step, from 0
    count: int  #: how many there are
    label: str  #: what it does
    result: StepResult | None = None  #: what came of it; None when it begins


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
