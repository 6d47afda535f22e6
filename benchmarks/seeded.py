"""Benchmarks of scenarios over seeds: the options that they share, and how they are run."""

from __future__ import annotations

import argparse
from collections.abc import Callable, Sequence
from dataclasses import replace
from functools import partial

from benchmarks.scenario import Measurement, Scenario, chosen_scenarios
from benchmarks.session import add_options, positive, run_and_report, tasks_of
from controller.sweeps.trials import Trial

IDEAL, IMU = "ideal", "imu"
"""The state that the controller is given: the true one, or what its own sensors tell."""

SEEDS, QUICK_SEEDS = 20, 3


def add_seeded_options(
    parser: argparse.ArgumentParser, more: str = "", *, has_sensors: bool = False
) -> None:
    """Add how many seeds, which rows, and what every benchmark has; ``more``: of the seeds."""
    if has_sensors:
        add_sensors_option(parser)
    parser.add_argument("--seeds", metavar="N", type=positive, help=f"default {SEEDS}{more}")
    parser.add_argument("--quick", action="store_true", help=f"{QUICK_SEEDS} seeds")
    parser.add_argument(
        "--rows", metavar="NAME", nargs="+", default=[], help="only these scenarios; see --list"
    )
    add_options(parser, has_jobs=True, has_list=True)


def add_sensors_option(parser: argparse.ArgumentParser) -> None:
    """Add what the controller is given of the robot's state."""
    parser.add_argument(
        "--sensors",
        choices=(IDEAL, IMU),
        default=IDEAL,
        help="true state, or the robot's own sensors; default %(default)s",
    )


def measure_on(trial: Trial, measure: Callable[[Trial], Measurement], sensors: str) -> Measurement:
    """Measure with a plant of these ``sensors``."""
    return measure(replace(trial, sensors=sensors))


def on_sensors(scenario: Scenario, sensors: str) -> Scenario:
    """The scenario with a plant of these ``sensors``; kept on disk under a name of its own."""
    if sensors == IDEAL:
        return scenario
    measure = partial(measure_on, measure=scenario.measure, sensors=sensors)
    return replace(scenario, name=f"{scenario.name}, {sensors}", measure=measure)


def run_seeded(args: argparse.Namespace, scenarios: Sequence[Scenario]) -> int:
    """Run what was asked for, report, and say by the exit code whether all thresholds are met."""
    chosen = chosen_scenarios(scenarios, args.rows)
    chosen = tuple(on_sensors(s, getattr(args, "sensors", IDEAL)) for s in chosen)
    seeds = args.seeds or (QUICK_SEEDS if args.quick else SEEDS)
    return run_and_report(args, chosen, tasks_of(chosen, seeds))
