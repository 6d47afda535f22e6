"""``python -m benchmarks moonshots``: how high, how far, how far round, and what forbids more.

The greatest jump of each kind that the planner finds, the check lets pass and a few robots do
(``jump_climb``) is played over other seeds, on which nothing was tuned. There are no thresholds:
what was reached is told, and what stopped the climb, beside what the legs and the motors' line
permit (``jump_physics``).
"""

from __future__ import annotations

import argparse
import math
from collections.abc import Mapping
from dataclasses import asdict, replace
from functools import cache, partial
from textwrap import wrap

from benchmarks.command import (
    QUICK_SEEDS,
    SEEDS,
    add_seeds,
    measure_all,
    publish,
    run_and_report,
    tasks_of,
)
from benchmarks.dynamic_motions import Played, metrics_of, plant_of, play
from benchmarks.jump_climb import KINDS, Climb, Climber, Jump, compiled
from benchmarks.jump_physics import PhysicsRow, physics_rows
from benchmarks.report import WIDTH, render, summarise
from benchmarks.study import Direction, Measurement, Metric, Study, chosen_studies
from controller.cli.common import ExitCode, Subparsers, add_parser
from controller.cli.progress import ProgressLine
from controller.sweeps.trials import Trial, TrialFailed
from go2_wbc.robot.model import RobotModel
from motions import CompiledPlan

OFFSET = 500
"""Seeds from which these trials are away from those of ``dynamic_motions``; 200 to 219 had been
seen when the climb was made to stop at what is not done."""
TRIED = range(600, 603)
"""Seeds of the trials by which a climb decides, counted like ``OFFSET``."""
BUDGET = 20.0
"""Processor time [s] of one attempt."""
EXAMPLES = """
python -m benchmarks moonshots                  everything; some minutes
python -m benchmarks moonshots --rows high --seeds 5
python -m benchmarks moonshots --budget 40      40 s for every attempt
python -m benchmarks moonshots --json
"""


@cache
def plan_of(jump: Jump) -> CompiledPlan:
    """The plan of a jump; once for all trials of a process."""
    return compiled(jump, RobotModel())


def measure(trial: Trial, name: str, jump: Jump) -> Measurement:
    """Play it, stand for a second, look what came of it."""
    plan, model = plan_of(jump), RobotModel()
    planned, done, stood = (f"{name}.{part}" for part in ("planned", "done", "stood"))
    values, failures = {planned: _size(name, jump), done: 0.0, stood: 0.0}, {}
    try:
        played = play(plant_of(Trial(trial.seed + OFFSET)), plan, model)
    except TrialFailed as failed:
        return Measurement(values, {done: str(failed), stood: str(failed)}, str(failed))
    values |= {**played.values(name, plan, model), f"{name}.reached": _reached(name, played)}
    values[stood] = 1.0
    if played.objection:
        values[done], failures[done] = 0.0, played.objection
    return Measurement(values, failures)


def not_done(plan: CompiledPlan) -> str:
    """What is in the way of the plan's being done in the trials of a climb, if anything."""
    for seed in TRIED:
        try:
            objection = play(plant_of(Trial(seed)), plan, RobotModel()).objection
        except TrialFailed as failed:
            objection = str(failed)
        if objection:
            return f"played: {objection}"
    return ""


def _size(name: str, jump: Jump) -> float:
    return KINDS[name].scale * {"high": jump.height, "far": jump.x, "round": jump.yaw}[name]


def _reached(name: str, played: Played) -> float:
    turned = played.turned % (2.0 * math.pi)
    sizes = {"high": played.height, "far": float(played.moved[0]), "round": turned}
    return KINDS[name].scale * sizes[name]


def scenario_of(name: str, jump: Jump) -> Study:
    """The trials of the greatest jump of a kind."""
    kind = KINDS[name]
    title = f"{kind.title}, the greatest that is done"
    planned = [
        Metric(f"{name}.planned", title, "planned", kind.unit, None),
        Metric(f"{name}.reached", title, "reached", kind.unit, None, Direction.AT_LEAST),
        Metric(f"{name}.stood", title, "stands 1 s later", "", None, Direction.AT_LEAST),
    ]
    common = [replace(metric, threshold=None) for metric in metrics_of(name, title, 1.0)]
    return Study(name, (*planned, *common), partial(measure, name=name, jump=jump))


def register(subparsers: Subparsers) -> None:
    """Add the options of ``moonshots``."""
    parser = add_parser(
        subparsers,
        "moonshots",
        "The greatest jumps that are done, what stops greater ones, and what physics\n"
        "permits. Exit code 0.",
        examples=EXAMPLES,
    )
    add_seeds(parser)
    parser.add_argument(
        "--budget", metavar="S", type=float, default=BUDGET,
        help="processor time of one attempt to plan [s], default %(default)g",
    )  # fmt: skip


def run(args: argparse.Namespace) -> int:
    """Climb, play, and tell."""
    easy = [scenario_of(name, kind.ask(kind.sizes[0])) for name, kind in KINDS.items()]
    chosen = chosen_studies(easy, args.rows)
    if args.list:
        return run_and_report(args, chosen, [])
    model = RobotModel()
    climbs = _climbs([scenario.name for scenario in chosen], model, args.budget)
    scenarios = [scenario_of(name, climb.jump) for name, climb in climbs.items()]
    seeds = args.seeds or (QUICK_SEEDS if args.quick else SEEDS)
    report = summarise(scenarios, measure_all(args, tasks_of(scenarios, seeds)))
    rows = physics_rows(model)
    values = {
        **report.as_dict(),
        "climbs": {name: asdict(climb) for name, climb in climbs.items()},
        "physics": [asdict(row) for row in rows],
    }
    publish(args, values, f"{render(report)}\n\n{_climb_table(climbs)}\n\n{_physics_table(rows)}")
    return ExitCode.OK


def _climbs(names: list[str], model: RobotModel, budget: float) -> Mapping[str, Climb]:
    with ProgressLine() as line:
        return {
            name: Climber(KINDS[name], model, budget, play=not_done, tell=line.done).climb()
            for name in names
        }


def _climb_table(climbs: Mapping[str, Climb]) -> str:
    """What stopped the climbs: every jump that is greater than the one that is done."""
    lines = ["what stopped the climbs", "-" * WIDTH]
    for name, climb in climbs.items():
        kind = KINDS[name]
        for attempt in climb.attempts:
            if attempt.reason and attempt.size > kind.scale * climb.size:
                text = f"{kind.title}, {attempt}"
                lines += wrap(text, WIDTH, initial_indent="  ", subsequent_indent="      ")
    return "\n".join(lines)


def _physics_table(rows: tuple[PhysicsRow, ...]) -> str:
    lines = ["what legs and motors permit, legs without inertia", "-" * WIDTH]
    lines += [f"  {row.what:<52}{row.value:>9.3g} {row.unit}" for row in rows]
    return "\n".join(lines)
