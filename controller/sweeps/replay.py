"""One row of a sweep of a motion, run again to be looked at."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from controller.report_view import performed
from controller.sweeps.motion_study import MotionStudy, plan_of, world_of
from controller.sweeps.rows import SEED, Row
from controller.sweeps.sweep_file import SweepFile
from controller.sweeps.trials import TrialRobot
from go2_wbc.errors import CommandError
from motions import FeasibilityChecker
from viz import ReplayContent


@dataclass(frozen=True, slots=True)
class Replay:
    """A run of a motion with a seed.

    Attributes:
        title: what was run.
        row: what was measured now.
        differences: the values that are not those of the row that is kept; none, to the last bit,
            under the same version, on the same kind of processor.
        content: what ``viz`` shows of it.
    """

    title: str
    row: Row
    differences: tuple[str, ...]
    content: ReplayContent


def replay(path: Path | str, seed: int) -> Replay:
    """Run a row of a motion's sweep again, with the plan that the file has kept.

    Args:
        path: the file of the sweep.
        seed: of the row.

    Raises:
        ConfigError: if there is no such file, or it is something else.
        CommandError: if it has no row of this seed, or its rows are not those of a motion.
        PlantError: if the robot did not get as far as the motion.
    """
    with SweepFile(path) as file:
        kept, about = file.rows([seed]), file.about
        finished = file.finished
    archive = about.get("plan")
    if not isinstance(archive, bytes):
        raise CommandError(f"{path} is a sweep of {about.get('what')}: only motions are replayed")
    if not kept:
        seeds = f"{min(finished)} to {max(finished)}" if finished else "none"
        raise CommandError(f"{path} has no row of seed {seed}; it has {seeds}")
    study = MotionStudy(archive, world_of(str(about["world"])))
    world, plant = study.drawn(seed)
    with TrialRobot(plant) as robot:
        checked = FeasibilityChecker(robot.model).evaluate(plan_of(archive))
        row = {SEED: seed, **study.row(world, robot)}
        content = performed(checked, robot.go2.recording(), robot.model)
    return Replay(
        title=f"{about.get('what')}, seed {seed}",
        row=row,
        differences=tuple(name for name in row if repr(row[name]) != repr(kept[0].get(name))),
        content=content,
    )
