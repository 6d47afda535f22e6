"""What a motion is written as: itself, its plan, or the trajectory of the whole robot."""

from __future__ import annotations

import io
from pathlib import Path
from typing import Any, Final

import numpy as np

from go2_wbc.files import checked_output, write_atomically
from go2_wbc.legs import JOINT_NAMES, LEGS
from motions import CompiledPlan, FeasibilityChecker, Timeline, save_motion, save_plan
from motions.plan.trajectory import Trajectory, trajectory_of

SUFFIXES: Final = (".csv", ".npz", ".json", ".plan")
_ARRAYS: Final = ("q", "v", "a", "rpy", "p_com", "stance")  # of an npz file, beside the time


def write_motion(
    motion: Timeline | CompiledPlan, path: Path, checker: FeasibilityChecker
) -> int | None:
    """Write a motion as the ending of ``path`` says, also one that the robot cannot do.

    Args:
        motion: what is written; of a plan there is no ``.json``.
        path: ends in one of ``SUFFIXES``.
        checker: makes the plan.

    Returns:
        The number of rows of a trajectory.

    Raises:
        ConfigError: for a path that cannot be written.
        TimelineError: for a motion that cannot be compiled, or not be saved.
    """
    target = checked_output(path, SUFFIXES)
    if target.suffix == ".json":
        save_motion(motion, target)
        return None
    plan = checker.plan(motion, check=False)
    if target.suffix == ".plan":
        save_plan(plan, target, model=checker.model)
        return None
    trajectory = trajectory_of(plan, checker.model)
    is_csv = target.suffix == ".csv"
    write_atomically(target, _csv(trajectory).encode() if is_csv else _npz(trajectory))
    return len(trajectory.times)


def _npz(path: Trajectory) -> bytes:
    stream = io.BytesIO()
    arrays: dict[str, Any] = {name: getattr(path, name) for name in _ARRAYS}
    np.savez_compressed(stream, time=path.times, **arrays)
    return stream.getvalue()


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
