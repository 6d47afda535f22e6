"""``go2-wbc run``: play a motion in MuJoCo; what was asked, what was achieved."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import closing, contextmanager
from dataclasses import replace
from itertools import count
from typing import TYPE_CHECKING, Annotated

from controller.cli.common import ExitCode, print_json, shown_path
from controller.cli.motion_args import (
    Friction,
    MotionWord,
    Payload,
    Sensors,
    Settings,
    checker_of,
    the_motion,
)
from controller.cli.options import Html, Json, Numbers, whole
from controller.cli.progress import ProgressLine
from go2_wbc.errors import PlantError, StanceMismatch

if TYPE_CHECKING:
    from controller.go2_controller import GO2Controller
    from controller.motion_measurement import MotionMeasurement
    from go2_wbc.config import Config
    from go2_wbc.motion_plan import MotionPlan
    from go2_wbc.plant import MujocoPlant
    from go2_wbc.plant.mujoco.ground_truth import GroundTruth
    from go2_wbc.world import World

TELL_EVERY = 50
"""Ticks between two looks at the progress line."""
GETTING_READY = 2.5
"""About how long [s] the robot takes to stand up before the motion."""


def run(
    motion: MotionWord,
    *,
    set: Settings = (),
    force: Annotated[bool, "play it even if it is infeasible"] = False,
    friction: Friction = None,
    payload: Payload = None,
    sensors: Sensors = "ideal",
    seed: Annotated[int, "N", "of sensors and of what the world leaves open", whole] = 0,
    config: Numbers = None,
    html: Annotated[Html, "write a 3D replay page, the plan as a ghost"] = None,
    json: Json = False,
) -> int:
    """Check a motion, then play it in MuJoCo under the whole-body controller.

    That is in the world that it was checked for (friction 0.5 by default). Then print what came of
    it. Exit code 0 if it was done, 1 if it is infeasible or was not done.

    Examples:
        go2-wbc run high_five
        go2-wbc run wave --set side=left --html wave.html
        go2-wbc run my_motion.py --friction 0.5 --sensors imu --seed 3
        go2-wbc run my_motion.py --force    although the check says no
    """
    from controller.arguments import config as read_config
    from controller.motion_measurement import measure_motion
    from controller.report_view import performed
    from go2_wbc.plant import plant_in_world
    from go2_wbc.world import World
    from viz import export_html

    meant, numbers = the_motion(motion, set), read_config(config)
    world = replace(World.of(friction, payload), sensors=sensors)
    with ProgressLine(is_quiet=json) as line:
        line.update(0.0, f"checking {meant.name}")
        checker = checker_of(numbers, world, line)
        checked = checker.evaluate(meant)
    plan, report = checked.plan, checked.report
    if not force:
        report.raise_if_infeasible()
    with getting_ready(plan, plant_in_world(world, seed=seed), line, numbers) as (go2, truth):
        result = measure_motion(go2, truth, plan, checker.model)
        recording = go2.recording()
    if json:
        where = {"friction": world.friction, "payload": world.payload}
        print_json({"motion": plan.name, "feasible": report.ok, **where, **result.as_dict()})
    else:
        _print(plan.name, plan.duration, world, result)
    if html is not None:
        export_html(performed(checked, recording, checker.model), html, title=plan.name)
        if not json:
            print(f"3D replay beside the plan, offline: {shown_path(html)}")
    return ExitCode.OK if result.ok else ExitCode.FAILED


@contextmanager
def getting_ready(
    plan: MotionPlan, plant: MujocoPlant, line: ProgressLine, config: Config | None = None
) -> Iterator[tuple[GO2Controller, GroundTruth]]:
    """A robot that has got ready for a plan, with the truth; ``line`` tells how far it has come.

    Raises:
        StanceMismatch: for a plan that starts otherwise than standing or sitting.
        PlantError: if the robot does not get ready.
    """
    from controller.go2_controller import GO2Controller
    from go2_wbc.motion_plan import Posture
    from go2_wbc.plant.mujoco.ground_truth import GroundTruth

    ticks = count(1)

    def tell() -> None:
        if (tick := next(ticks)) % TELL_EVERY == 0:
            time = tick * truth.control_period
            share = min(time / (GETTING_READY + plan.duration), 1.0)
            line.update(share, f"{plan.name}, {time:.1f} s")

    with (
        line,
        closing(GroundTruth(plant)) as truth,
        GO2Controller(plant=truth, config=config) as go2,
    ):
        truth.on_tick = tell
        starts = {Posture.STAND: go2.stand, Posture.SIT: go2.sit}
        if plan.entry not in starts:
            raise StanceMismatch(f"{plan.name} starts from {plan.entry.value}: cannot be run")
        if not starts[plan.entry]() or truth.fall():
            reason = truth.fall() or go2.last_outcome.reason
            raise PlantError(f"the robot did not get ready: {reason}")
        yield go2, truth


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
