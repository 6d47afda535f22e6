"""``go2-wbc dataset``: what the controller saw and did, for those who learn from it."""

from __future__ import annotations

from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

from controller.cli.common import ExitCode, Json, ProgressLine, print_json, shown_path, whole
from controller.cli.motion_args import MOTION_HELP, Settings, the_motion
from controller.cli.sweep import tell
from go2_wbc.brief import counted
from go2_wbc.errors import CommandError

if TYPE_CHECKING:
    from controller.learning.dataset import Dataset

Range = Annotated[tuple[float, ...], "V", "least and greatest, m/s"]


def run(
    file: Annotated[Path, "FILE", "a folder of Parquet files, which ends in .parquet"],
    *,
    task: Annotated[str, "WHAT", f"walk, rough, push; or a motion: {MOTION_HELP}"] = "walk",
    set: Settings = (),
    minutes: Annotated[float, "N", "of robot time, default 10"] = 10.0,
    seed: Annotated[int, "K", "of the first episode, default 0", whole] = 0,
    workers: Annotated[int | None, "N", "processes, default: all processors"] = None,
    gait: Annotated[str, "NAME", "default: trot"] = "trot",
    linear_x: Range = (),
    linear_y: Range = (),
    angular_z: Annotated[tuple[float, ...], "W", "likewise, rad/s"] = (),
    json: Json = False,
) -> int:
    """Record what the controller saw, did and was asked, as a data set for learners.

    A row is 0.02 s: the observation of the Gymnasium environments, the joint targets and torques of
    that time, the command, the gait's phase, which feet stand, and the world. Friction, mass,
    heading and start differ from episode to episode. The same command goes on after an
    interruption. Needs the extra [learning].

    Examples:
        go2-wbc dataset trot.parquet
        go2-wbc dataset trot.parquet --minutes 60 --linear-x 0.3 0.8 --angular-z 0 0
        go2-wbc dataset pushed.parquet --task push --seed 1000 --workers 2
        go2-wbc dataset bow.parquet --task bow --minutes 2
    """
    from controller.learning.dataset import WALKS, read_dataset, record

    given = (("linear_x", linear_x), ("linear_y", linear_y), ("angular_z", angular_z))
    commands = {name: _pair(name, values) for name, values in given if values}
    if set and task in WALKS:
        raise CommandError(f"--set is for motions, {task} has no parameters")
    with ProgressLine(is_quiet=json) as line:
        line.update(0.0, "starting")
        folder = record(
            file,
            task if task in WALKS else the_motion(task, set),
            minutes=minutes,
            seed=seed,
            workers=workers,
            gait=gait,
            commands=commands,
            on_progress=partial(tell, line),
        )
    told = _told(read_dataset(folder))
    if json:
        print_json({"file": str(folder), **told})
    else:
        print(f"{told['rows']} rows, {told['minutes']:.1f} min of robot time")
        falls = counted(told["falls"], "fall")
        print(f"{counted(told['episodes'], 'episode')}, {falls}, in {shown_path(folder)}")
    return ExitCode.OK


def _pair(name: str, values: tuple[float, ...]) -> tuple[float, float]:
    if len(values) != 2:
        option = name.replace("_", "-")
        raise CommandError(f"--{option} takes two numbers, the lesser first, got {values}")
    return values[0], values[1]


def _told(found: Dataset) -> dict[str, Any]:
    falls = {int(seed) for seed in found["seed"][found["fell"]]}
    return {
        "rows": len(found),
        "minutes": len(found) / found.about["rate"] / 60.0,
        "episodes": len({*found["seed"].tolist()}),
        "falls": len(falls),
    }
