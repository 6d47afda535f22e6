"""``python -m benchmarks dynamics``: what solving dynamic motions takes, and what comes of it.

Plans are made from cold, by processor time and without imports. The moves are those on which the
planner's numbers were chosen, so their rows say what it costs, not how far it generalises; that is
for ``python -m benchmarks nearest``.
"""

from __future__ import annotations

import math
import tempfile
import time
from collections.abc import Callable
from functools import partial
from pathlib import Path

from benchmarks.command import Benchmark
from benchmarks.study import Measurement, Metric, Study
from controller.sweeps.trials import Trial
from go2_wbc.errors import PlanNotFound
from go2_wbc.robot.model import RobotModel
from motions.dynamics import (
    DynamicTrajectory,
    Phase,
    PhaseProblem,
    audit,
    solve,
    solve_cached,
)
from motions.dynamics import (
    phase_builders as moves,
)
from motions.dynamics.solver import require_crocoddyl

PLANNING, SLOW_PLANNING = 4.0, 10.0
"""Processor time [s] that a plan may take."""
FROM_CACHE = 50.0
"""Processor time [ms] that a kept plan may take."""
Make = Callable[[], tuple[Phase, ...]]

MOVES: dict[str, tuple[str, Make, float]] = {
    "jump": ("jump up 0.15 m", moves.jump, PLANNING),
    "forward": ("jump 0.5 m ahead", partial(moves.jump, x=0.5), PLANNING),
    "sideways": ("jump 0.3 m sideways", partial(moves.jump, y=0.3), PLANNING),
    "back": ("jump 0.3 m back", partial(moves.jump, x=-0.3), PLANNING),
    "turn": ("jump turning 90 deg", partial(moves.jump, yaw=math.pi / 2), PLANNING),
    "hops": ("three hops", moves.hop, PLANNING),
    "rear": ("rear up by 25 deg", moves.rear, PLANNING),
    "rear40": ("rear up by 40 deg", partial(moves.rear, math.radians(-40.0)), SLOW_PLANNING),
    "lift": ("lift two diagonal feet", moves.lift, PLANNING),
}


def metrics_of(name: str, item: str, limit: float) -> tuple[Metric, ...]:
    """What is asked of planning one move."""
    return (
        Metric(f"{name}.cpu", item, "processor time", "s", limit),
        Metric(f"{name}.iterations", item, "iterations", "", None),
        Metric(f"{name}.cached", item, "from the cache", "ms", FROM_CACHE),
        Metric(f"{name}.deviation", item, "off what was asked", "mm", 50.0),
        Metric(f"{name}.torque", item, "torque at speed", "", 1.0),
        Metric(f"{name}.friction", item, "friction", "", None),
    )


def measure_move(name: str, trial: Trial) -> Measurement:
    """Plan one move from cold, and read it back."""
    _, make, _ = MOVES[name]
    model, problem = RobotModel(), PhaseProblem(make())
    _warm(model)
    before = time.process_time()
    try:
        plan = solve(problem, model)
    except PlanNotFound as error:
        return Measurement({}, reason=str(error))
    values = {f"{name}.cpu": time.process_time() - before, **_readings(name, plan, model)}
    with tempfile.TemporaryDirectory() as folder:
        solve_cached(problem, model, folder=Path(folder))
        before = time.process_time()
        solve_cached(problem, model, folder=Path(folder))
        values[f"{name}.cached"] = 1e3 * (time.process_time() - before)
    return Measurement(values)


def _warm(model: RobotModel) -> None:
    """Import the solver and load the kernels: neither is planning."""
    require_crocoddyl()
    solve(PhaseProblem(moves.lift()), model)


def _readings(name: str, plan: DynamicTrajectory, model: RobotModel) -> dict[str, float]:
    worst = {reading.name: reading.value for reading in audit(plan, model)}
    return {
        f"{name}.iterations": float(plan.iterations),
        f"{name}.deviation": 1e3 * plan.position_deviation,
        f"{name}.torque": worst["torque share"],
        f"{name}.friction": worst["friction"],
    }


STUDIES = tuple(
    Study(name, metrics_of(name, item, limit), partial(measure_move, name))
    for name, (item, _, limit) in MOVES.items()
)


BENCHMARK = Benchmark(
    "dynamics",
    "Solve jumps, hops, rears and lifts from cold: processor time, deviation, torque.\n"
    "Needs go2-wbc[dynamics].",
    STUDIES,
    takes="some minutes",
    examples=("jump rear --json",),
    runs=1,
)
register, run = BENCHMARK.register, BENCHMARK.run
