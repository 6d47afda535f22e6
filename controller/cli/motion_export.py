"""``go2-wbc export``: a motion's trajectory as NumPy or CSV, or the motion itself, as a file."""

from __future__ import annotations

import argparse
import io
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from controller.cli.common import ExitCode, Subparsers, add_parser, print_json
from controller.cli.motion_args import SAVED_MOTION, SAVED_PLAN, add_motion, the_motion
from controller.cli.progress import ProgressLine
from go2_wbc.legs import JOINT_NAMES, LEGS

if TYPE_CHECKING:
    from motions import CompiledPlan, Timeline
    from motions.plan.trajectory import Trajectory

EXAMPLES = """
go2-wbc export wave --out wave.csv
go2-wbc export wave --out wave.npz
go2-wbc export wave --set times=5 --out five.json  then: go2-wbc run five.json
"""
COLUMNS = """
columns, 100 rows a second, in the frame between the feet (x ahead, z up):
  time [s]; x y z [m] and roll pitch yaw [rad] of the base; angles [rad] and
  speeds [rad/s] of the 12 joints; com_x com_y com_z [m]; stance of each foot.
npz: the same as arrays time, q (position, quaternion x y z w, joints), v, a (in
the base frame), rpy, p_com, stance.
json: the motion as it is written; plan: as it is played, by this robot only.
  Every command takes these two in place of a name.
"""
ARRAYS = ("q", "v", "a", "rpy", "p_com", "stance")
"""What an npz file holds beside the time."""


def register(subparsers: Subparsers) -> None:
    """Add the options of ``export``."""
    parser = add_parser(
        subparsers,
        "export",
        "Write a motion's trajectory of the whole robot, or the motion, to a file.\n" + COLUMNS,
        examples=EXAMPLES,
    )
    add_motion(parser)
    parser.add_argument(
        "--out", metavar="FILE", type=Path, required=True, help="ends in .csv, .npz, .json or .plan"
    )
    parser.add_argument("--json", action="store_true", help="print JSON")


def run(args: argparse.Namespace) -> int:
    """Write what the ending asks for."""
    from go2_wbc.files import checked_output
    from motions import save_motion

    target = checked_output(args.out, [".csv", ".npz", SAVED_MOTION, SAVED_PLAN])
    motion = the_motion(args.motion, args.values)
    rows: dict[str, object] = {}
    if target.suffix == SAVED_MOTION:
        save_motion(motion, target)
    else:
        with ProgressLine(is_quiet=args.json) as line:
            line.update(0.0, f"compiling {motion.name}")
            rows = _write_compiled(motion, target, line)
    if args.json:
        print_json({"motion": motion.name, "file": str(target), **rows})
    else:
        number = f": {rows['rows']} rows of" if rows else ":"
        print(f"wrote {args.out}{number} {motion.name}")
    return ExitCode.OK


def _write_compiled(
    motion: Timeline | CompiledPlan, target: Path, line: ProgressLine
) -> dict[str, object]:
    """Write the plan or its trajectory; returns the number of rows of the latter."""
    from go2_wbc.files import write_atomically
    from motions import FeasibilityChecker, save_plan
    from motions.plan.trajectory import trajectory_of

    checker = FeasibilityChecker(progress=line.solving)
    plan, model = checker.plan(motion, check=False), checker.model
    if target.suffix == SAVED_PLAN:
        save_plan(plan, target, model=model)
        return {}
    path = trajectory_of(plan, model)
    if target.suffix == ".npz":
        stream = io.BytesIO()
        arrays: dict[str, Any] = {name: getattr(path, name) for name in ARRAYS}
        np.savez_compressed(stream, time=path.times, **arrays)
        content = stream.getvalue()
    else:
        content = _csv(path).encode()
    write_atomically(target, content)
    return {"rows": len(path.times)}


def _csv(path: Trajectory) -> str:
    joints = [name.removesuffix("_joint") for name in JOINT_NAMES]
    header = ["time", "x", "y", "z", "roll", "pitch", "yaw", *joints]
    header += [f"{joint}_speed" for joint in joints] + ["com_x", "com_y", "com_z"]
    numbers, feet = ["%.6f"] * len(header), ["%d"] * len(LEGS)
    header += [f"{leg.name}_stance" for leg in LEGS]
    q, v = path.q, path.v
    columns = [path.times, q[:, :3], path.rpy, q[:, 7:], v[:, 6:], path.p_com, path.stance]
    stream = io.StringIO()
    np.savetxt(
        stream,
        np.column_stack(columns),
        fmt=[*numbers, *feet],
        delimiter=",",
        header=",".join(header),
        comments="",
    )
    return stream.getvalue()
