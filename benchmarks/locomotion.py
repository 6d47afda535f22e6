"""``python -m benchmarks locomotion``: how fast, and how exactly, the robot walks in every gait.

A run takes ``WINDOW`` seconds, from ``START_TIME`` after
the command on: motors with their torque-speed line, friction 0.6 to 1.0 and masses within 10 %, of
which the controller is not told. The state is the true one, or estimated from IMU, encoders and
feet (the group ``sensors``; ``truth_vs_estimate`` has more of it). Gaits and weights were chosen on
seeds 0 to 9; those judged begin at ``FIRST_SEED``.

- velocity: of MuJoCo's CoM in the heading frame, every tick;
- mean velocity error: |mean - command| / |command|, in the direction of the command;
- mean absolute error: mean of |velocity - command|, oscillation within the stride included;
- turning: from the heading (unwrapped) at both ends of the window;
- saturated ticks: share of ticks in which some motor gives all it has at its speed.

``benchmarks.unknown_world`` has the groups ``unknown``, ``unknown-sensors`` and ``robots``.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from functools import partial

import numpy as np

from benchmarks import library, truth_vs_estimate
from benchmarks.command import Benchmark
from benchmarks.robots import plant_of
from benchmarks.study import Measurement, Metric, Study, sensed
from benchmarks.unknown_world import STUDIES as UNKNOWN
from controller.motion_measurement import FULL
from controller.sweeps.trials import Trial, TrialRobot
from go2_wbc.config import Config
from go2_wbc.planning.command import VelocityCommand, VelocityEnvelope
from go2_wbc.planning.envelopes import TROT
from go2_wbc.plant.mujoco.ground_truth import TruthRecording
from go2_wbc.robot.model import RobotModel

FIRST_SEED = 14000
"""Seed of the first trial that is judged; those from 4000 on were, and causes found on them."""
MASS_RANGE = (0.9, 1.1)
"""Factor on every mass and inertia of the robot; the controller is not told."""
START_TIME, WINDOW = 3.0, 20.0
"""Time [s] after a command that is left out, and that is measured."""
BEYOND = Config(envelope=VelocityEnvelope(forward=4.0))
"""Of the runs that are beyond the envelope."""


@dataclass(frozen=True, slots=True)
class Run:
    """One command to one gait, and what is asked of it.

    Attributes:
        name: of the scenario.
        gait: its name.
        command: what is followed.
        mean: greatest mean error [%]; None if it only informs.
        mae: greatest mean absolute error [m/s]; None if it only informs.
        saturated: greatest share of saturated ticks [%]; None if it only informs.
        group: of the scenario.
        speed: greatest joint speed, as a share of its limit; None if it only informs.
    """

    name: str
    gait: str
    command: VelocityCommand
    mean: float | None
    mae: float | None = None
    saturated: float | None = None
    group: str = "trot"
    speed: float | None = 1.0

    @property
    def metrics(self) -> tuple[Metric, ...]:
        """The rows of the report."""
        c = self.command
        item = f"{self.gait} ({c.linear_x:g}, {c.linear_y:g}) m/s, {c.angular_z:g} rad/s, 20 s"
        turning = [Metric(f"{self.name}.turn", item, "mean turning error", "%", self.mean)]
        moving = [
            Metric(f"{self.name}.mean", item, "mean velocity error", "%", self.mean),
            Metric(f"{self.name}.mae", item, "mean absolute error", "m/s", self.mae),
        ]
        return (
            *(moving if speed_of(c) else ()),
            *(turning if c.angular_z else ()),
            Metric(f"{self.name}.saturated", item, "saturated ticks", "%", self.saturated),
            Metric(f"{self.name}.speed", item, "peak joint speed / limit", "", self.speed),
        )


def speed_of(command: VelocityCommand) -> float:
    """Speed [m/s] of the command, turning aside."""
    return math.hypot(command.linear_x, command.linear_y)


def measure_run(trial: Trial, run: Run) -> Measurement:
    """Follow the command; see the module's docstring for what is measured."""
    command, plant = run.command, plant_of(trial, FIRST_SEED, MASS_RANGE)
    with TrialRobot(plant, BEYOND if speed_of(command) > TROT.forward else None) as robot:
        robot.require(robot.go2.stand())
        robot.require(robot.go2.walk(run.gait))
        robot.go2.move(command.linear_x, command.angular_z, linear_y=command.linear_y)
        robot.truth.clear()
        robot.wait(START_TIME + WINDOW)
        recorded = robot.truth.recording()
    return Measurement(measured(run, recorded.since(recorded.time[0] + START_TIME)))


def measured(run: Run, window: TruthRecording) -> dict[str, float]:
    """The values of the run's metrics."""
    command, model, name = run.command, RobotModel(), run.name
    wanted = speed_of(command)
    values = {
        f"{name}.saturated": 100.0 * float((window.torque_shares(model) >= FULL).mean()),
        f"{name}.speed": window.peak_speed_share(model),
    }
    if wanted:
        direction = np.array([command.linear_x, command.linear_y]) / wanted
        error = window.com_velocity[:, :2] @ direction - wanted
        values[f"{name}.mean"] = 100.0 * abs(float(error.mean())) / wanted
        values[f"{name}.mae"] = float(np.abs(error).mean())
    if command.angular_z:
        rate = (window.rpy[-1, 2] - window.rpy[0, 2]) / (window.time[-1] - window.time[0])
        values[f"{name}.turn"] = 100.0 * abs(rate / command.angular_z - 1.0)
    return values


RUNS = (
    Run("ahead-0.5", "trot", VelocityCommand(0.5), 1.0, 0.012, 5.0),
    Run("ahead-1.0", "trot", VelocityCommand(1.0), 1.0, 0.02, 5.0),
    Run("ahead-1.5", "trot", VelocityCommand(1.5), 1.0, 0.03, 5.0),
    Run("ahead-2.0", "trot", VelocityCommand(2.0), 1.0, 0.04, 5.0),
    Run("ahead-2.5", "trot", VelocityCommand(2.5), 1.0, 0.05, 5.0),
    Run("ahead-3.0", "trot", VelocityCommand(3.0), 3.0, 0.08),
    Run("aside-0.5", "trot", VelocityCommand(0.0, 0.5), 2.0),
    Run("aside-1.0", "trot", VelocityCommand(0.0, 1.0), 2.0),
    Run("turn-2", "trot", VelocityCommand(0.0, 0.0, 2.0), 2.0),
    Run("turn-4", "trot", VelocityCommand(0.0, 0.0, 4.0), 2.0),
    Run("turn-6", "trot", VelocityCommand(0.0, 0.0, 6.0), 2.0),
    Run("curve", "trot", VelocityCommand(0.8, 0.3, 1.0), 2.0),
    Run("ahead-3.5", "trot", VelocityCommand(3.5), None, group="moonshot", speed=None),
    Run("flying-trot", "flying_trot", VelocityCommand(1.5), 5.0, None, 5.0, "gaits"),
    Run("walk", "walk", VelocityCommand(0.4), 5.0, None, 5.0, "gaits"),
    Run("pace", "pace", VelocityCommand(0.8), 5.0, None, 5.0, "gaits"),
    Run("pronk", "pronk", VelocityCommand(0.8), 5.0, None, 5.0, "gaits"),
    Run("bound", "bound", VelocityCommand(0.6), 5.0, None, 5.0, "gaits"),
    Run("gallop", "gallop", VelocityCommand(0.8), 5.0, None, 5.0, "gaits"),
)
ON_SENSORS = (
    *(
        Run(f"{speed:g}", "trot", VelocityCommand(speed), mean)
        for speed, mean in ((0.5, 2.0), (1.0, 2.0), (1.5, 2.0), (2.0, 2.0), (2.5, 3.0), (3.0, None))
    ),
    *(replace(run, mae=None) for run in RUNS if not run.name.startswith("ahead")),
    Run("3.5", "trot", VelocityCommand(3.5), None, speed=None),
)
"""The same on its own sensors; at 3 m/s all that is asked for is not to fall, at 3.5 nothing."""


def _study(run: Run) -> Study:
    return Study(run.name, run.metrics, partial(measure_run, run=run), group=run.group)


STUDIES = (
    *map(_study, RUNS),
    *(sensed(_study(run), "sensors") for run in ON_SENSORS),
    *truth_vs_estimate.STUDIES,
    library.ON_SENSORS,
    *UNKNOWN,
)
"""In the order of the report."""


BENCHMARK = Benchmark(
    "locomotion",
    "Every gait at its speeds: how exactly, and within which limits.",
    STUDIES,
    takes="an hour on two cores",
    examples=(
        "--rows sensors",
        "--rows ahead-2.5 gaits --json",
    ),
)
register, run = BENCHMARK.register, BENCHMARK.run
