"""``go2-wbc run``: play a motion in MuJoCo; what was asked, what was achieved."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import closing, contextmanager, nullcontext
from dataclasses import dataclass, replace
from itertools import count
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import viz
from controller.cli.common import (
    ExitCode,
    Html,
    Json,
    Mjcf,
    Numbers,
    ProgressLine,
    output,
    print_json,
    shown_path,
    video_file,
    whole,
)
from controller.cli.motion_args import (
    Friction,
    MotionWord,
    Payload,
    Sensors,
    Settings,
    checker_of,
    the_motion,
)
from controller.cli.motion_preview import VIDEO_RATE
from controller.modes import Mode
from go2_wbc.brief import counted
from go2_wbc.errors import ConfigError, PlantError, StanceMismatch

if TYPE_CHECKING:
    from controller.go2_controller import GO2Controller
    from controller.motion_measurement import MotionMeasurement
    from go2_wbc.config import Config
    from go2_wbc.motion_plan import MotionPlan
    from go2_wbc.plant import MujocoPlant
    from go2_wbc.plant.mujoco.ground_truth import GroundTruth
    from go2_wbc.recording import Recording
    from go2_wbc.robot.model import RobotModel
    from go2_wbc.world import World
    from motions import CheckedMotion

TELL_EVERY = 50  #: Ticks between two looks at the progress line
MOST_LIMITS = 6  #: That are printed
GETTING_READY = 2.5  #: About how long [s] the robot takes to stand up before the motion


@dataclass(frozen=True, slots=True, kw_only=True)
class Scene:
    """Where it is played, and whether one looks on."""

    mjcf: Mjcf = None
    keyframe: Annotated[str | None, "NAME", "of the scene: begin there, not lying"] = None
    viewer: Annotated[bool, "also open MuJoCo's window, at the pace of the wall clock"] = False


@dataclass(frozen=True, slots=True, kw_only=True)
class Files:
    """What is written; None for what is not."""

    html: Annotated[Html, "write a 3D replay page, the plan as a ghost"] = None
    video: Annotated[
        Path | None, "FILE", "an animation; ends in .webp, .gif or .mp4", video_file
    ] = None
    export: Annotated[
        Path | None,
        *("FILE", "the recording; .npz, .mcap for Foxglove or .rrd for Rerun"),
        output(".npz", ".mcap", ".rrd"),
    ] = None


def run(
    motion: MotionWord,
    *,
    set: Settings = (),
    force: Annotated[bool, "play it even if it is infeasible"] = False,
    friction: Friction = None,
    payload: Payload = None,
    sensors: Sensors = "ideal",
    seed: Annotated[int, "N", "of sensors and of what the world leaves open", whole] = 0,
    explain: Annotated[bool, "also tell which limits were in the way; shown in the page"] = False,
    config: Numbers = None,
    scene: Annotated[Scene, "scene"],
    files: Annotated[Files, "files"],
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
        go2-wbc run wave --explain --html wave.html
        go2-wbc run wave --viewer --video wave.webp --export wave.mcap
        go2-wbc run wave --mjcf yard.xml --keyframe ramp    of `new yard --scene`
    """
    from controller.arguments import config as read_config
    from controller.motion_measurement import measure_motion
    from go2_wbc.plant import plant_in_world
    from go2_wbc.recording import EXPORTS, viewer
    from go2_wbc.world import World

    if scene.keyframe is not None and scene.mjcf is None:
        raise ConfigError("--keyframe names one of a scene: give its file, too, by --mjcf")
    if files.export is not None and (extra := EXPORTS.get(files.export.suffix)):
        viewer(extra)  # what is missing is told before the work
    meant, numbers = the_motion(motion, set), read_config(config)
    world = replace(World.of(friction, payload), sensors=sensors)
    plant = plant_in_world(
        world, seed=seed, mjcf=scene.mjcf, keyframe=scene.keyframe, visuals=scene.viewer
    )
    with ProgressLine(is_quiet=json) as line:
        line.update(0.0, f"checking {meant.name}")
        checker = checker_of(numbers, world, line)
        checked = checker.evaluate(meant)
    plan, report = checked.plan, checked.report
    if not force:
        report.raise_if_infeasible()
    with getting_ready(plan, plant, line, numbers, viewer=scene.viewer) as (go2, truth):
        go2.telemetry.explains = explain
        result = measure_motion(go2, truth, plan, checker.model)
        recording = go2.recording()
    limits = times_in_the_way(recording)
    if json:
        where = {"friction": world.friction, "payload": world.payload}
        told = {"limits": limits} if explain else {}
        print_json(
            {"motion": plan.name, "feasible": report.ok, **where, **result.as_dict(), **told}
        )
    else:
        _print(plan.name, plan.duration, world, result)
        if explain:
            _print_limits(limits)
    _write(files, recording, checked, checker.model, is_quiet=json)
    return ExitCode.OK if result.ok else ExitCode.FAILED


def _write(
    files: Files, recording: Recording, checked: CheckedMotion, model: RobotModel, *, is_quiet: bool
) -> None:
    from controller.report_view import performed

    told: list[tuple[str, Path]] = []
    if files.export is not None:
        to_own = files.export.suffix == ".npz"
        path = recording.save(files.export) if to_own else recording.export(files.export)
        told.append(("recording", path))
    if files.html is not None or files.video is not None:
        content, name = performed(checked, recording, model), checked.plan.name
        if files.html is not None:
            path = viz.export_html(content, files.html, title=name)
            told.append(("3D replay beside the plan, offline", path))
        if files.video is not None:
            with ProgressLine(is_quiet=is_quiet) as line:
                path = viz.export_animation(
                    content,
                    files.video,
                    speed=1.0,
                    fps=VIDEO_RATE,
                    progress=lambda share: line.update(share, f"drawing {name}"),
                )
            told.append(("animation", path))
    for what, path in [] if is_quiet else told:
        print(f"{what}: {shown_path(path)}")


@contextmanager
def getting_ready(
    plan: MotionPlan,
    plant: MujocoPlant,
    line: ProgressLine,
    config: Config | None = None,
    *,
    viewer: bool = False,
) -> Iterator[tuple[GO2Controller, GroundTruth]]:
    """A robot that has got ready for a plan, with the truth; ``line`` tells how far it has come.

    With ``viewer`` MuJoCo's window shows it, at the pace of the wall clock, if there is a display.

    Raises:
        StanceMismatch: for a plan that starts otherwise than standing or sitting.
        PlantError: if the robot does not get ready.
    """
    from controller.go2_controller import GO2Controller
    from controller.pacing import Pacer
    from controller.runner import GREATEST_LAG
    from go2_wbc.motion_plan import Posture
    from go2_wbc.plant.mujoco.ground_truth import GroundTruth

    ticks, window = count(1), None
    if viewer:
        from go2_wbc.plant.mujoco.viewer import open_viewer  # MuJoCo's window with it

        window = open_viewer(plant)
    pacer = Pacer(plant.control_period, GREATEST_LAG)

    def tell() -> None:
        if window is not None:
            window.show(plant.time)
            pacer.wait()
        if (tick := next(ticks)) % TELL_EVERY == 0:
            time = tick * truth.control_period
            share = min(time / (GETTING_READY + plan.duration), 1.0)
            line.update(share, f"{plan.name}, {time:.1f} s")

    with (
        line,
        nullcontext() if window is None else closing(window),
        closing(GroundTruth(plant)) as truth,
        GO2Controller(plant=truth, config=config) as go2,
    ):
        truth.on_tick = tell
        starts = {Posture.STAND: go2.stand, Posture.SIT: go2.sit}
        if plan.entry not in starts:
            raise StanceMismatch(f"{plan.name} starts from {plan.entry.value}: cannot be run")
        is_ready = (go2.mode is Mode.LYING or go2.take_over()) and starts[plan.entry]()
        if not is_ready or truth.fall():
            reason = truth.fall() if is_ready else go2.last_outcome.reason
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


def times_in_the_way(recording: Recording) -> dict[str, float]:
    """For how long [s] each limit was in the way in a recording, the longest first."""
    times: dict[str, float] = {}
    for span in recording.binding():
        times[span.label] = times.get(span.label, 0.0) + span.end - span.start
    return {name: round(t, 3) for name, t in sorted(times.items(), key=lambda item: -item[1])}


def _print_limits(times: dict[str, float]) -> None:
    print("limits in the way:" if times else "no limit was in the way")
    for name, seconds in [*times.items()][:MOST_LIMITS]:
        print(f"  {name:<38}{seconds:>10.2f} s")
    if (more := len(times) - MOST_LIMITS) > 0:
        print(f"  and {counted(more, 'other')}, for less time")
