"""``python -m benchmarks dynamics``: what solving dynamic motions takes, and what comes of it.

Plans are made from cold, by processor time and without imports. The motions are those of
``benchmarks.dynamic_motions``, on which the planner's numbers were chosen, so their rows say what
it costs, not how far it generalises; that is for ``python -m benchmarks nearest``.
"""

from __future__ import annotations

import tempfile
import time
from functools import partial
from pathlib import Path

from benchmarks.command import Benchmark
from benchmarks.dynamic_motions import ITEMS
from benchmarks.study import Study, TrialResult
from controller.sweeps.trials import Trial
from go2_wbc.robot.model import RobotModel
from motions import compile_timeline
from motions.dynamics import PhaseProblem, audit, phase_builders, solve, solve_cached
from motions.dynamics.solver import require_crocoddyl

PLANNING, SLOW_PLANNING, SLOW = 4.0, 10.0, "rear40"
"""Processor time [s] that a plan may take, and that of one."""


def measure_planning(_trial: Trial, found: TrialResult, name: str) -> None:
    """Plan one motion from cold, and read it back."""
    model = RobotModel()
    (span,) = compile_timeline(ITEMS[name].write(), model).dynamic
    problem = span.asked
    if not isinstance(problem, PhaseProblem):
        raise TypeError(f"{name} is no motion of phases")
    require_crocoddyl()
    solve(PhaseProblem(phase_builders.lift()), model)  # loads the kernels, which is no planning
    before = time.process_time()
    plan = solve(problem, model)
    found.values["cpu"] = time.process_time() - before
    worst = {reading.name: reading.value for reading in audit(plan, model)}
    found.values |= {
        "iterations": float(plan.iterations),
        "deviation": 1e3 * plan.position_deviation,
        "torque": worst["torque share"],
        "friction": worst["friction"],
    }
    with tempfile.TemporaryDirectory() as folder:
        solve_cached(problem, model, folder=Path(folder))
        before = time.process_time()
        solve_cached(problem, model, folder=Path(folder))
        found.values["cached"] = 1e3 * (time.process_time() - before)


STUDIES = tuple(
    Study(
        name,
        {
            item.title: (
                ("cpu", "processor time", f"<= {SLOW_PLANNING if name == SLOW else PLANNING:g} s"),
                ("iterations", "iterations", ""),
                ("cached", "from the cache", "<= 50 ms"),
                ("deviation", "off what was asked", "<= 50 mm"),
                ("torque", "torque at speed", "<= 1"),
                ("friction", "friction", ""),
            )
        },
        partial(measure_planning, name=name),
    )
    for name, item in ITEMS.items()
)


BENCHMARK = Benchmark(
    "dynamics",
    "Solve jumps, hops, rears and lifts from cold: processor time, deviation, torque.\n"
    "Needs go2-wbc[dynamics].",
    STUDIES,
    takes="some minutes",
    examples=("up rear25 --json",),
    runs=1,
)
register, run = BENCHMARK.register, BENCHMARK.run
