"""What motions there are and whether the robot can do them: list, new, check and export."""

from __future__ import annotations

import keyword
import sys
import textwrap
from collections.abc import Mapping, Sequence
from importlib.util import find_spec
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import numpy as np

from controller.cli.common import (
    ExitCode,
    Json,
    Numbers,
    ProgressLine,
    folder,
    output,
    print_json,
    shown_path,
)
from controller.cli.motion_args import (
    MOTION_HELP,
    SAVED_MOTION,
    SAVED_PLAN,
    Friction,
    MotionWord,
    Payload,
    Settings,
    checker_of,
    meant,
    print_verdict,
    the_motion,
)
from go2_wbc.errors import CommandError, ConfigError
from go2_wbc.files import checked_output, write_atomically

if TYPE_CHECKING:
    from motions import FeasibilityReport, Motion, Suggestion

WIDTH = 80
STARTER = '''"""{title}: a motion for the Go2.

    go2-wbc check {name}.py      can the robot do it?
    go2-wbc preview {name}.py    watch it; the page follows every save of this file
    go2-wbc run {name}.py        play it in MuJoCo
"""

from typing import Annotated

from motions import Range, Timeline, deg, motion


@motion
def {name}(taps: Annotated[int, Range(1, 5)] = 2) -> Timeline:
    """{title}: bow, then tap the ground with a front paw."""
    # The trunk: metres and radians from where it stands; deg() turns degrees into radians.
    line = Timeline().body(pitch=deg(15), z=-0.04, over=0.8).hold(0.3).home(over=0.8)
    # A foot that is raised leaves the ground; the trunk moves over the other three by itself.
    for _ in range(taps):
        line = line.foot("FR", z=0.06, over=0.4).down("FR", over=0.3)
    # home() puts every foot down and brings the trunk back: always end with it.
    return line.home(over=0.8)
'''


# --- list and new ---------------------------------------------------------------------------------


def list_motions(
    file: Annotated[str | None, "FILE.py", "instead of the library"] = None, *, json: Json = False
) -> int:
    """List motions, what they do and what can be set.

    Examples:
        go2-wbc list                 the library
        go2-wbc list my_motion.py    the motions of your own file
        go2-wbc list --json          the same for a program to read
    """
    from motions import find_motion, load_file, motion_names

    if file is None:
        found = [find_motion(name) for name in motion_names()]
    else:
        found = list(load_file(file).values())
    if json:
        print_json([_parameters(motion) for motion in found])
        return ExitCode.OK
    column = max(len(motion.name) for motion in found) + 2
    indent = " " * column
    for motion in found:
        head = motion.name.ljust(column)
        print(textwrap.fill(head + motion.summary, WIDTH, subsequent_indent=indent))
        for parameter in motion.parameters:
            print(f"{indent}--set {parameter}")
    return ExitCode.OK


def _parameters(motion: Motion) -> dict[str, object]:
    values = {item.name: [item.default, str(item.valid)] for item in motion.parameters}
    return {"name": motion.name, "summary": motion.summary, "parameters": values}


def new(
    name: Annotated[str, "NAME", "of the motion and its file"],
    *,
    scene: Annotated[
        bool, "a scene instead: MJCF with a box on its back, a ramp, keyframes"
    ] = False,
    out: Annotated[Path, "DIR", "default: here", folder] = Path(),
    json: Json = False,
) -> int:
    """Write a small, commented motion, or a scene for MuJoCo, to start from.

    Examples:
        go2-wbc new greet            writes greet.py
        go2-wbc new greet --out motions_of_mine
        go2-wbc new yard --scene     writes yard.xml, for run and demo --mjcf
    """
    if not name.isidentifier() or keyword.iskeyword(name):
        raise CommandError(f"NAME must be a Python name such as my_motion, got {name!r}")
    suffix = ".xml" if scene else ".py"
    shown = out / f"{name}{suffix}"
    if shown.expanduser().exists():
        raise ConfigError(f"{shown} exists already: choose another name")
    if not scene and (name in sys.stdlib_module_names or find_spec(name) is not None):
        raise CommandError(f"{name}.py would hide the module {name!r}: choose another name")
    target = checked_output(shown, [suffix])
    title = name.replace("_", " ").capitalize()
    text = _scene() if scene else STARTER.format(name=name, title=title)
    write_atomically(target, text.encode())
    if json:
        print_json({"scene" if scene else "motion": name, "file": str(target)})
    else:
        then = f"run wave --mjcf {shown} --keyframe ramp" if scene else f"check {shown}"
        print(f"wrote {shown}; now: go2-wbc {then}")
    return ExitCode.OK


def _scene() -> str:
    """MJCF in which the robot may stand on the floor and on the ramp."""
    from go2_wbc.plant.mujoco.user_model import RAMP_MIDDLE, RAMP_PITCH, starter_scene
    from go2_wbc.robot.model import RobotModel
    from go2_wbc.robot.rotations import quaternion_from_rpy, rotation_from_rpy
    from motions.postures import standing_feet, standing_on

    model, stances = RobotModel(), {}
    for stance, place, pitch in (
        ("floor", (0.0, 0.0, 0.0), 0.0),
        ("ramp", RAMP_MIDDLE, -RAMP_PITCH),
    ):
        R, p_com = rotation_from_rpy(0.0, pitch, 0.0), [0.0, 0.0, model.profile.stand_height]
        feet = standing_feet(model) @ R.T + place
        p_base, q_joints = standing_on(feet, np.add(place, p_com), R, model)
        stances[stance] = np.concatenate([p_base, quaternion_from_rpy(0.0, pitch, 0.0), q_joints])
    return starter_scene(stances)


# --- check ----------------------------------------------------------------------------------------


def check(
    motion: Annotated[tuple[str, ...], "MOTION", MOTION_HELP] = (),
    *,
    set: Settings = (),
    fix: Annotated[bool, "look for the least change that makes a refused motion feasible"] = False,
    friction: Friction = None,
    payload: Payload = None,
    config: Numbers = None,
    json: Json = False,
) -> int:
    """Check motions: can the robot do them? Nothing is simulated.

    Reach, joint limits, torque, support, friction, load of the feet, collisions, landings. Exit
    code 0 if the robot can do all of them, 1 if it cannot do one.

    Examples:
        go2-wbc check                     every motion of the library, a line each
        go2-wbc check wave                one motion, every limit
        go2-wbc check wave --set times=5
        go2-wbc check wave --friction 0.4 --payload 3
        go2-wbc check my_motion.py        every motion of your own file
        go2-wbc check my_motion.py --fix  what would make it feasible
        go2-wbc check bow --json          the same for a program to read
    """
    from controller.arguments import config as read_config
    from go2_wbc.world import World
    from motions import suggest

    lines = meant(motion, set)
    reports: list[FeasibilityReport] = []
    changes: dict[str, Sequence[Suggestion]] = {}
    with ProgressLine(is_quiet=json) as progress:
        world = World.of(friction, payload)
        checker = checker_of(read_config(config), world, progress)
        for number, line in enumerate(lines):
            progress.update(number / len(lines), line.name)
            reports.append(checker.check(line))
            if fix and not reports[-1].ok:
                progress.update((number + 0.5) / len(lines), f"{line.name}, changes")
                changes[line.name] = suggest(line, checker=checker)
    if json:
        print_json([_report(report, changes) for report in reports])
    else:
        _print_reports(reports, changes)
    return ExitCode.OK if all(report.ok for report in reports) else ExitCode.FAILED


def _print_reports(
    reports: Sequence[FeasibilityReport], changes: Mapping[str, Sequence[Suggestion]]
) -> None:
    """Every limit of one motion, or a verdict each of several; then what would mend them."""
    if len(reports) == 1:
        print(reports[0].table())
        for finding in reports[0].failures:
            print(f"x {finding}")
    else:
        for report in reports:
            print_verdict(report)
    for name, found in changes.items():
        _print_changes(name, found)


def _print_changes(name: str, found: Sequence[Suggestion]) -> None:
    """What to append to the motion ``name`` to make it feasible, the least change first."""
    if not found:
        print(f"\n{name}: no change of tempo, size, height, shifts or jumps makes it feasible.")
        return
    print(f"\n{name} is feasible with one of these appended, the least change first:")
    for one in found:
        print(f"    {one}")


def _report(
    report: FeasibilityReport, changes: Mapping[str, Sequence[Suggestion]]
) -> dict[str, Any]:
    found = changes.get(report.motion)
    more = {} if found is None else {"suggestions": [one.as_dict() for one in found]}
    return {**report.as_dict(), **more}


# --- export ---------------------------------------------------------------------------------------


def export(
    motion: MotionWord,
    *,
    set: Settings = (),
    out: Annotated[
        Path,
        *("FILE", "ends in .csv, .npz, .json or .plan"),
        output(".csv", ".npz", SAVED_MOTION, SAVED_PLAN),
    ],
    json: Json = False,
) -> int:
    """Write a motion's trajectory of the whole robot, or the motion, to a file.

    columns, 100 rows a second, in the frame between the feet (x ahead, z up):
      time [s]; x y z [m] and roll pitch yaw [rad] of the base; angles [rad] and
      speeds [rad/s] of the 12 joints; com_x com_y com_z [m]; stance of each foot.
    npz: the same as arrays time, q (position, quaternion x y z w, joints), v, a (in
    the base frame), rpy, p_com, stance.
    json: the motion as it is written; plan: as it is played, by this robot only.
      Every command takes these two in place of a name.

    Examples:
        go2-wbc export wave --out wave.csv
        go2-wbc export wave --out wave.npz
        go2-wbc export wave --set times=5 --out five.json  then: go2-wbc run five.json
    """
    from controller.motion_files import write_motion
    from motions import FeasibilityChecker

    found = the_motion(motion, set)
    with ProgressLine(is_quiet=json or out.suffix == SAVED_MOTION) as line:
        line.update(0.0, f"compiling {found.name}")
        rows = write_motion(found, out, FeasibilityChecker(progress=line.solving))
    if json:
        told = {} if rows is None else {"rows": rows}
        print_json({"motion": found.name, "file": str(out), **told})
    else:
        number = ":" if rows is None else f": {rows} rows of"
        print(f"wrote {shown_path(out)}{number} {found.name}")
    return ExitCode.OK
