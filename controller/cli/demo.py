"""``go2-wbc demo``: stand, sit, walk, turn, high five; the report and the files that it leaves."""

from __future__ import annotations

import json
import math
import sys
import textwrap
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass, replace
from itertools import count, groupby
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import numpy as np
from jaxtyping import Int

import viz  # what is named viz.X below is imported when something is drawn
from controller.cli.common import (
    ExitCode,
    Mjcf,
    Numbers,
    ProgressLine,
    folder,
    print_json,
    reader,
    shown_path,
    whole,
)
from go2_wbc.errors import CommandError, ConfigError
from go2_wbc.files import checked_output, write_atomically

if TYPE_CHECKING:
    from controller.demo.steps import DemoProgress, DemoReport, DemoTotals, Measurement, StepResult
    from controller.go2_controller import GO2Controller
    from go2_wbc.recording import Recording


BACKENDS = ("condensed", "full", "placo")
TERRAINS = ("stairs", "course")
SOLVERS = ("active_set", "daqp", "proxqp", "quadprog")
START_NOISE = 0.05
"""Standard deviation [rad] of the joint angles from which the robot starts with ``--seed``."""
TITLE = "Go2: stand, sit, walk, turn, high five"
SEEING = "Go2: {} by sight"
FILES: Mapping[str, str] = {
    "demo.npz": "recording (NumPy)",
    "report.json": "report",
    "demo.html": "3D replay, offline",
    "demo.png": "filmstrip",
    "demo.webp": "animation",
}
"""The files that are left, the last three only with media, and what each holds."""
_positive = reader(float, lambda value: 0.0 < value < float("inf"), "a positive number")


@dataclass(frozen=True, slots=True, kw_only=True)
class Output:
    """What a run leaves and shows."""

    out: Annotated[Path, "DIR", "default: %(default)s", folder] = Path("out/demo")
    no_media: Annotated[bool, "no page and no pictures"] = False
    json: Annotated[bool, "print JSON instead of the table"] = False
    viewer: Annotated[bool, "also open MuJoCo's window"] = False
    realtime: Annotated[bool, "at the pace of the wall clock"] = False


@dataclass(frozen=True, slots=True, kw_only=True)
class Robot:
    """The simulated robot and its world; None is the usual."""

    seed: Annotated[
        int | None, "N", "start from joint angles that this seed draws (default: exact ones)", whole
    ] = None
    friction: Annotated[float | None, "MU", "of the feet, default 0.8", _positive] = None
    mass_scale: Annotated[float, "X", "factor on all masses", _positive] = 1.0
    mjcf: Mjcf = None
    terrain: Annotated[
        str | None, TERRAINS, "walk over it instead, on the robot's own sensors and a lidar"
    ] = None


@dataclass(frozen=True, slots=True, kw_only=True)
class Control:
    """What controls the robot; None is the usual."""

    config: Numbers = None
    backend: Annotated[str | None, BACKENDS, "whole-body back end"] = None
    solver: Annotated[str | None, SOLVERS, "QP solver"] = None


@dataclass(frozen=True, slots=True, kw_only=True)
class Elsewhere:
    """The robot of another process."""

    ros2: Annotated[bool, "on a robot that `go2-wbc ros2` serves elsewhere"] = False
    namespace: Annotated[str, "NAME", "its name, default %(default)s"] = "robot1"


def run(
    *,
    output: Annotated[Output, "output"],
    elsewhere: Annotated[Elsewhere, "over ROS 2"],
    robot: Annotated[Robot, "robot and world"],
    control: Annotated[Control, "controller"],
) -> int:
    """Stand, sit, walk, turn, high five and sit in MuJoCo; then print what was measured.

    With --terrain it walks over that instead, by sight. It leaves an offline 3D replay and
    pictures. Exit code 0 if every step was done, 1 if one was not, 3 if something broke.

    Examples:
        go2-wbc demo                         headless; table, replay page, animation
        go2-wbc demo --no-media --json       figures only, for a program to read
        go2-wbc demo --viewer --realtime     watch it live in MuJoCo's window
        go2-wbc demo --friction 0.4 --mass-scale 1.2 --seed 3
        go2-wbc demo --backend placo --solver proxqp
        go2-wbc demo --terrain course        stairs, a block, stones, a gap, by sight
        go2-wbc demo --ros2                  on the robot of `go2-wbc ros2 --realtime`
    """
    if elsewhere.namespace != Elsewhere().namespace and not elsewhere.ros2:
        raise CommandError("--namespace is that of a robot elsewhere: give --ros2, too")
    if elsewhere.ros2:
        return _run_over_ros(elsewhere.namespace, as_json=output.json)
    paths = checked_paths(output.out)  # before the run: its results must not be lost
    report, recording = _perform(output, robot, control)
    given = {**asdict(robot), **asdict(control), "realtime": output.realtime}
    settings = {name: str(v) if isinstance(v, Path) else v for name, v in given.items()}
    values = {**report.as_dict(), "settings": settings}
    if output.json:
        print_json(values)
    else:
        print(render(report, sys.stdout.encoding), end="\n\n", flush=True)
    try:
        recording.save(paths[0])
        write_atomically(paths[1], (json.dumps(values, indent=2) + "\n").encode())
        if not output.no_media:
            title = TITLE if robot.terrain is None else SEEING.format(robot.terrain)
            _write_media(recording, report, paths, title)
    except ConfigError as error:  # the disk or the size: no fault of the caller's usage
        print(f"go2-wbc: {error}", file=sys.stderr)
        return ExitCode.RUNTIME
    if not output.json:
        for path in paths[:2] if output.no_media else paths:
            size = f"{path.stat().st_size / 1000:>6.0f} kB"
            print(f"  {FILES[path.name]:<20}{size}  {shown_path(path)}")
    return ExitCode.OK if report.ok else ExitCode.FAILED


def _run_over_ros(namespace: str, *, as_json: bool) -> int:
    """Run the demo on a robot that another process serves, print the steps."""
    from controller.bridges.ros2.demo import run_ros_demo
    from controller.demo.steps import DEMO_STEPS, DemoReport

    number = count(1)
    with ProgressLine() as line:
        results = run_ros_demo(
            namespace,
            lambda step: line.done(
                f"{next(number)}/{len(DEMO_STEPS)} {step.label}: {step.verdict}"
            ),
        )
    ok = all(step.ok for step in results)
    if as_json:
        print_json({"ok": ok, "steps": DemoReport.steps_as_dicts(results)})
    else:
        print(render_steps(results, sys.stdout.encoding))
        print(f"{sum(step.ok for step in results)} of {len(results)} steps borne out by odometry.")
    return ExitCode.OK if ok else ExitCode.FAILED


def checked_paths(folder: Path) -> list[Path]:
    """The paths of ``FILES`` in ``folder``, which is created.

    Raises:
        ConfigError: if one of them could not be written.
    """
    if folder.exists() and not folder.is_dir():
        raise ConfigError(f"cannot write into {folder}: it is a file, give a folder")
    return [checked_output(folder / name, (Path(name).suffix,)) for name in FILES]


def _perform(output: Output, robot: Robot, control: Control) -> tuple[DemoReport, Recording]:
    from controller.demo.steps import DEMO_STEPS, TERRAINS, run_demo, terrain_steps

    steps = DEMO_STEPS if robot.terrain is None else terrain_steps(TERRAINS[robot.terrain])
    with ProgressLine() as line:

        def show(progress: DemoProgress) -> None:
            place = f"{progress.index + 1}/{progress.count} {progress.label}"
            if progress.result is None:
                line.update(progress.index / progress.count, place)
            else:
                line.done(f"{place}: {progress.result.verdict}")

        line.update(0.0, "loading the robot")
        with _controller(output, robot, control) as go2:
            report = run_demo(go2, show, steps)
            return report, go2.recording()


def _controller(output: Output, robot: Robot, control: Control) -> GO2Controller:
    from controller.demo.steps import TERRAINS
    from controller.go2_controller import GO2Controller
    from go2_wbc.config import Config, load_config
    from go2_wbc.plant import MujocoPlant

    sees = robot.terrain is not None
    config = Config() if control.config is None else load_config(control.config)
    if control.backend is not None:
        config = replace(config, backend=control.backend)
    if control.solver is not None:
        config = replace(config, wbc=replace(config.wbc, solver=control.solver))
    viewer = output.viewer and _has_display()
    plant = MujocoPlant(
        robot.mjcf,
        robot=config.robot,
        friction=robot.friction,
        mass_scale=robot.mass_scale,
        seed=robot.seed or 0,
        initial_joint_noise=0.0 if robot.seed is None else START_NOISE,
        motor=config.motor,
        terrain=TERRAINS[robot.terrain] if robot.terrain else None,
        lidar=sees,
        sensors="imu" if sees else "ideal",
        visuals=viewer,
    )
    return GO2Controller(plant=plant, realtime=output.realtime, viewer=viewer, config=config)


def _has_display() -> bool:
    from go2_wbc.plant.mujoco.viewer import display_problem

    problem = display_problem()
    if problem is not None:
        reason = problem.split(" (")[0]
        print(f"go2-wbc: no viewer: {reason}; going on without it", file=sys.stderr)
    return problem is None


def _write_media(recording: Recording, report: DemoReport, paths: list[Path], title: str) -> None:
    """Page, filmstrip and animation; the animation takes by far the longest."""
    _, _, page, filmstrip, animation = paths
    with ProgressLine() as line:
        line.update(0.0, f"drawing {page.name}")
        viz.export_html(recording, page, title=title)
        line.update(0.1, f"drawing {filmstrip.name}")
        viz.export_filmstrip(recording, filmstrip, times=filmstrip_times(report, recording))
        viz.export_animation(
            recording,
            animation,
            progress=lambda share: line.update(0.2 + 0.8 * share, f"drawing {animation.name}"),
        )


def filmstrip_times(report: DemoReport, recording: Recording) -> list[float] | None:
    """Seconds after the start at which the robot sits, swings two legs, and holds its paw up.

    Of a walk over a terrain, three moments of it. None if the run has no such moments; the
    filmstrip then chooses for itself.
    """
    steps = {step.name: step for step in report.steps}
    if (cross := steps.get("cross")) is not None:
        start = cross.start - float(recording.time[0])
        return [start + share * cross.duration for share in (0.25, 0.5, 0.75)]
    if not {"sit", "forward", "high_five"} <= steps.keys():
        return None

    def rows_of(name: str) -> Int[np.ndarray, " k"]:
        since = recording.time - steps[name].start
        return np.flatnonzero((since > 0.0) & (since < steps[name].duration))

    sitting = rows_of("sit")
    swinging = _longest_mode(recording, rows_of("forward"), feet=2)
    raising = _longest_mode(recording, rows_of("high_five"), feet=3)
    if not (len(sitting) and len(swinging) and len(raising)):
        return None
    rows = (sitting[-1], swinging[len(swinging) // 2], raising[len(raising) // 2])
    return [float(recording.time[row] - recording.time[0]) for row in rows]


def _longest_mode(recording: Recording, rows: Int[np.ndarray, " k"], feet: int) -> list[int]:
    """The longest run of ``rows`` in which the same ``feet`` feet are in stance."""
    modes = groupby(rows.tolist(), key=lambda row: recording.stance[row].tolist())
    return max((list(run) for mode, run in modes if sum(mode) == feet), key=len, default=[])


WIDTH = 80
_HEADER = f"     {'step':<21}{'time':>7}  {'figure':<23}{'asked':>9}{'measured':>9}"
_INDENT = " " * 5
_DECIMALS = {"deg": 1}  #: Decimals of a unit's numbers; 3 for any other


def render(report: DemoReport, encoding: str | None = None) -> str:
    """The table of steps, the totals and the verdict.

    Args:
        encoding: of the terminal; ticks and crosses become words where it lacks them.
    """
    done = sum(step.ok for step in report.steps)
    verdict = f"{done} of {len(report.steps)} steps done."
    if report.ok:
        verdict = f"All {done} steps done, each judged by what was measured."
    return "\n".join(
        [render_steps(report.steps, encoding), *_total_rows(report.totals), "", verdict]
    )


def render_steps(steps: Sequence[StepResult], encoding: str | None = None) -> str:
    """The table of steps alone, with a line below; see ``render``."""
    marks = _marks(encoding)
    rows = [_HEADER, "-" * WIDTH]
    for step in steps:
        head = f"{marks[step.ok]:>4} {step.label:<21}{step.duration:>5.1f} s  "
        first, *others = [_cells(figure) for figure in step.figures] or [""]
        rows += [(head + first).rstrip(), *(" " * len(head) + cells for cells in others)]
        if not step.ok:
            rows += textwrap.wrap(
                step.reason, WIDTH, initial_indent=_INDENT, subsequent_indent=_INDENT
            )
    return "\n".join([*rows, "-" * WIDTH])


def _marks(encoding: str | None) -> dict[bool, str]:
    try:
        "✓✗".encode(encoding or "ascii")
    except (UnicodeEncodeError, LookupError):
        return {True: "ok", False: "FAIL"}
    return {True: "✓", False: "✗"}


def _cells(figure: Measurement) -> str:
    decimals = _DECIMALS.get(figure.unit, 3)
    asked = "" if figure.asked is None else f"{figure.asked:.{decimals}f}"
    measured = f"{figure.measured:.{decimals}f}" if math.isfinite(figure.measured) else "-"
    return f"{figure.name:<23}{asked:>9}{measured:>9} {figure.unit}"


def _total_rows(totals: DemoTotals) -> list[str]:
    lines = (
        ("peak joint torque", f"{100 * totals.peak_torque_ratio:.0f} % of its limit"),
        ("peak joint speed", f"{100 * totals.peak_speed_ratio:.0f} % of its limit"),
        ("on three legs: least support margin", _or_dash(totals.least_support_margin, "m", 3)),
        ("on three legs: least load of a foot", _or_dash(totals.least_foot_load, "N", 0)),
        ("control ticks without a QP solution", str(totals.qp_failures)),
        ("robot time", f"{totals.robot_time:.1f} s"),
        ("CPU time of control and physics", f"{totals.cpu_time:.1f} s"),
        ("real-time factor", f"{totals.real_time_factor:.1f}"),
    )
    return [f"{_INDENT}{name:<38}{value}" for name, value in lines]


def _or_dash(value: float, unit: str, decimals: int) -> str:
    return f"{value:.{decimals}f} {unit}" if math.isfinite(value) else "-"
