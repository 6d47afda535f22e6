"""``go2-wbc run``: play a motion in MuJoCo; what was asked, what was achieved."""

from __future__ import annotations

import argparse
from collections.abc import Callable
from contextlib import closing
from itertools import count
from pathlib import Path
from typing import TYPE_CHECKING

from controller.cli.common import ExitCode, Subparsers, add_parser, print_json
from controller.cli.motion_args import add_motion, add_world, the_motion, world_of
from controller.cli.progress import ProgressLine
from go2_wbc.errors import PlantError, StanceMismatch

if TYPE_CHECKING:
    from controller.motion_measurement import MotionMeasurement
    from go2_wbc.world import World

TELL_EVERY = 50
"""Ticks between two looks at the progress line."""
GETTING_READY = 2.5
"""About how long [s] the robot takes to stand up before the motion."""
EXAMPLES = """
go2-wbc run high_five
go2-wbc run wave --set side=left --html wave.html
go2-wbc run my_motion.py --friction 0.5
go2-wbc run my_motion.py --force    although the check says no
"""


def register(subparsers: Subparsers) -> None:
    """Add the options of ``run``."""
    parser = add_parser(
        subparsers,
        "run",
        "Check a motion, then play it in MuJoCo under the whole-body controller, in the\n"
        "world that it was checked for (friction 0.5 by default), and print what came\n"
        "of it. Exit code 0 if it was done, 1 if it is infeasible or was not done.",
        examples=EXAMPLES,
    )
    add_motion(parser)
    parser.add_argument("--force", action="store_true", help="play it even if it is infeasible")
    add_world(parser)
    parser.add_argument(
        "--html", metavar="FILE", type=Path, help="write a 3D replay page, the plan as a ghost"
    )
    parser.add_argument("--json", action="store_true", help="print JSON")


def run(args: argparse.Namespace) -> int:
    """Check, play, measure, print."""
    from controller.go2_controller import GO2Controller
    from controller.motion_measurement import measure_motion
    from controller.report_view import performed
    from go2_wbc.files import checked_output
    from go2_wbc.motion_plan import Posture
    from go2_wbc.plant import plant_in_world
    from go2_wbc.plant.mujoco.ground_truth import GroundTruth
    from motions import FeasibilityChecker
    from viz import HTML_SUFFIXES, export_html

    motion, world = the_motion(args.motion, args.values), world_of(args)
    target = None if args.html is None else checked_output(args.html, HTML_SUFFIXES)
    with ProgressLine(is_quiet=args.json) as line:
        line.update(0.0, f"checking {motion.name}")
        checker = FeasibilityChecker(world=world, progress=line.solving)
        checked = checker.evaluate(motion)
    plan, report = checked.plan, checked.report
    if not args.force:
        report.raise_if_infeasible()
    with (
        line,
        closing(GroundTruth(plant_in_world(world))) as truth,
        GO2Controller(plant=truth) as go2,
    ):
        truth.on_tick = teller(line, truth.control_period, plan.name, plan.duration)
        starts = {Posture.STAND: go2.stand, Posture.SIT: go2.sit}
        if plan.entry not in starts:
            raise StanceMismatch(f"{plan.name} starts from {plan.entry.value}: cannot be run")
        if not starts[plan.entry]() or truth.fall():
            reason = truth.fall() or go2.last_outcome.reason
            raise PlantError(f"the robot did not get ready: {reason}")
        result = measure_motion(go2, truth, plan, checker.model)
        recording = go2.recording()
    if args.json:
        print_json(
            {"motion": plan.name, "feasible": report.ok, **_where(world), **result.as_dict()}
        )
    else:
        _print(plan.name, plan.duration, world, result)
    if target is not None:
        export_html(performed(checked, recording, checker.model), target, title=plan.name)
        if not args.json:
            print(f"3D replay beside the plan, offline: {args.html}")
    return ExitCode.OK if result.ok else ExitCode.FAILED


def teller(line: ProgressLine, period: float, name: str, duration: float) -> Callable[[], None]:
    """Shows after every so many ticks how far the robot has come."""
    ticks = count(1)

    def tell() -> None:
        if (tick := next(ticks)) % TELL_EVERY == 0:
            time = tick * period
            line.update(min(time / (GETTING_READY + duration), 1.0), f"{name}, {time:.1f} s")

    return tell


def _where(world: World) -> dict[str, float]:
    return {"friction": world.friction, "payload": world.payload}


def _print(name: str, duration: float, world: World, result: MotionMeasurement) -> None:
    load = f", {world.payload:g} kg on its trunk" if world.payload else ""
    print(
        f"{name}, {duration:.1f} s in MuJoCo, as it was checked: friction {world.friction:g}{load}"
    )
    print("-" * 80)
    for label, value, unit in result.lines():
        print(f"  {label:<38}{value:>10} {unit}")
    print("-" * 80)
    print("done" if result.ok else f"NOT done: {result.fall or result.reason}")
