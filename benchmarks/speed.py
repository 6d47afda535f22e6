"""``python -m benchmarks speed``: what a control tick costs, in processor time of one thread.

Ratios come from interleaved measurements (A B C A B C ...) of the same states in one process, so
that what else the machine does falls on all alike. Wants an idle machine all the same.
"""

from __future__ import annotations

import argparse
import time
from collections.abc import Callable
from contextlib import closing
from dataclasses import replace

import numpy as np

from benchmarks.scenario import Measurement, Metric, Scenario, chosen_scenarios
from benchmarks.session import add_options, positive, run_and_report, tasks_of
from benchmarks.trials import Trial, TrialFailed
from controller.assembly import build_pilot
from controller.cli.common import Subparsers, add_parser
from controller.go2_controller import GO2Controller
from controller.procedures import Aborted
from go2_wbc.config import Config
from go2_wbc.planning.command import VelocityCommand
from go2_wbc.reference import Reference
from go2_wbc.robot.model import RobotModel
from go2_wbc.robot.snapshot import Snapshot
from go2_wbc.wbc.config import WbcConfig
from go2_wbc.wbc.controller import WholeBodyController
from go2_wbc.wbc.solution import WbcSolution
from motions import compile_motion

ROUNDS = 300
"""Ticks of each contact mode that are solved by every controller in turn."""
WARM_UP = 20
"""Rounds before the measurement."""
CONTROLLERS = {
    "compiled": ("condensed", "active_set"),
    "condensed": ("condensed", "daqp"),
    "full": ("full", "daqp"),
    "placo": ("placo", "daqp"),
}
"""Back end and solver of what is compared; "condensed" is the readable form of "compiled"."""
FEET = (4, 3, 2)
"""Numbers of stance feet: standing, in the high five, in the trot."""
MODES = ("stand", "trot", "high five", "sit", "lie down")
EXAMPLES = """
python -m benchmarks speed                   two minutes
python -m benchmarks speed ticks --runs 5
python -m benchmarks speed --json --out speed.json
"""

_SOLVE = "whole-body QP, {} stance feet"
SOLVE_METRICS = tuple(
    metric
    for feet in FEET
    for metric in (
        *(
            Metric(f"solve.{feet}.{name}", _SOLVE.format(feet), f"{name}, median", "us", None)
            for name in CONTROLLERS
        ),
        Metric(f"solve.{feet}.p99", _SOLVE.format(feet), "compiled, 99 of 100", "us", None),
    )
)
TICK_METRICS = tuple(
    metric
    for mode in MODES
    for metric in (
        Metric(f"tick.{mode}.median", f"whole tick, 2 ms of physics: {mode}", "median", "us", None),
        Metric(f"tick.{mode}.p99", f"whole tick, 2 ms of physics: {mode}", "99 of 100", "us", None),
    )
)


class Recorder(WholeBodyController):
    """Solves, and keeps ``ROUNDS`` problems for each number of stance feet."""

    def __init__(self, model: RobotModel) -> None:
        """Begin with none."""
        super().__init__(model)
        self.problems: dict[int, list[tuple[Snapshot, Reference]]] = {feet: [] for feet in FEET}

    def solve(
        self, snapshot: Snapshot, reference: Reference, *, relax: bool = False
    ) -> WbcSolution:
        """Solve one tick and keep it if there is room."""
        kept = self.problems.get(int(reference.stance.sum()), [])
        if len(kept) < ROUNDS:
            kept.append((snapshot, reference))
        return super().solve(snapshot, reference, relax=relax)


def measure_solves(trial: Trial) -> Measurement:
    """Terms, assembly and solution of the same problems by each controller in turn.

    The problems are those of a run; each controller gets its own copy of the reference, so that
    what a kernel needs of it is prepared within the measured time.
    """
    problems = _recorded_problems(trial)
    model = RobotModel()
    controllers = {
        name: WholeBodyController(model, backend, WbcConfig(solver=solver))
        for name, (backend, solver) in CONTROLLERS.items()
    }
    values: dict[str, float] = {}
    for feet, cases in problems.items():
        spent: dict[str, list[float]] = {name: [] for name in controllers}
        for snapshot, reference in cases[:WARM_UP] + cases:
            for name, controller in controllers.items():
                own = replace(reference)
                start = time.thread_time_ns()
                controller.solve(snapshot, own, relax=True)
                spent[name].append((time.thread_time_ns() - start) / 1e3)
        for name, times in spent.items():
            values[f"solve.{feet}.{name}"] = float(np.median(times[WARM_UP:]))
        values[f"solve.{feet}.p99"] = float(np.quantile(spent["compiled"][WARM_UP:], 0.99))
    return Measurement(values)


def _recorded_problems(trial: Trial) -> dict[int, list[tuple[Snapshot, Reference]]]:
    with closing(trial.plant()) as plant, closing(build_pilot(plant, Config())) as robot:
        loop = robot.runner.loop
        recorder = Recorder(loop.model)
        loop.wbc = recorder
        try:
            robot.pilot.stand()
            robot.pilot.walk("trot")
            robot.pilot.set_command(VelocityCommand(0.5))
            robot.pilot.wait(2.0)
            robot.pilot.rest()
            robot.pilot.stand()
            robot.pilot.play(compile_motion("high_five", RobotModel()))
        except Aborted as aborted:
            raise TrialFailed(str(aborted)) from aborted
        return recorder.problems


def measure_ticks(trial: Trial) -> Measurement:
    """From the end of one tick to the end of the next, everything included."""
    ends: list[int] = []
    values: dict[str, float] = {}
    plant = trial.plant()
    with (
        closing(plant),
        GO2Controller(plant=plant, after_tick=lambda: ends.append(time.thread_time_ns())) as go2,
    ):
        for mode in MODES:
            if mode == "trot":
                go2.walk()
                go2.move(0.5)
            ends.clear()
            acts: dict[str, Callable[[], object]] = {
                "stand": go2.stand,
                "trot": lambda: go2.wait(4.0),
                "high five": go2.high_five,
                "sit": go2.sit,
                "lie down": go2.lie_down,
            }
            if acts[mode]() is False:
                raise TrialFailed(go2.last_outcome.reason)
            spent = np.diff(ends) / 1e3
            values[f"tick.{mode}.median"] = float(np.median(spent))
            values[f"tick.{mode}.p99"] = float(np.quantile(spent, 0.99))
            if mode == "trot":
                go2.stop()
    return Measurement(values)


SCENARIOS = (
    Scenario("solves", SOLVE_METRICS, measure_solves),
    Scenario("ticks", TICK_METRICS, measure_ticks),
)


def register(subparsers: Subparsers) -> None:
    """Add the options of ``speed``."""
    parser = add_parser(
        subparsers,
        "speed",
        "Processor time of the whole-body QP by each back end, on the same problems in\n"
        "turn, and of whole ticks with 2 ms of physics. Wants an idle machine.",
        examples=EXAMPLES,
    )
    parser.add_argument("names", metavar="NAME", nargs="*", help="solves or ticks; default: both")
    parser.add_argument("--runs", metavar="N", type=positive, default=3, help="default %(default)s")
    add_options(parser, has_list=True)


def run(args: argparse.Namespace) -> int:
    """Measure what was asked for, and report."""
    scenarios = chosen_scenarios(SCENARIOS, args.names)
    return run_and_report(args, scenarios, tasks_of(scenarios, args.runs))
