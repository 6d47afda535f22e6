"""A motion as a function from a seed to a row, played in a sample of a world; and a row again."""

from __future__ import annotations

import json
import math
import tempfile
from dataclasses import asdict, dataclass, fields, replace
from functools import cache
from pathlib import Path

import numpy as np

from controller.motion_measurement import MotionMeasurement, failures_of, measure_motion, shares_of
from controller.report_view import performed
from controller.sweeps.sweep_file import SEED, Row, SweepFile
from controller.sweeps.trials import JOINT_NOISE, YAW_RANGE, TrialFailed, TrialRobot
from go2_wbc.errors import CommandError, Go2WbcError
from go2_wbc.plant import MujocoPlant, plant_in_world
from go2_wbc.world import World
from motions import CompiledPlan, FeasibilityChecker, load_plan, save_plan
from viz import ReplayContent


def archive_of(plan: CompiledPlan) -> bytes:
    """A plan as the content of its file: plays as it does, number by number."""
    with tempfile.TemporaryDirectory() as folder:
        return save_plan(plan, Path(folder, "swept.plan")).read_bytes()


@cache
def plan_of(archive: bytes) -> CompiledPlan:
    """The plan of an archive, read once in each process."""
    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder, "swept.plan")
        file.write_bytes(archive)
        return load_plan(file)


@dataclass(frozen=True, slots=True)
class MotionStudy:
    """Plays a motion, unchecked, on a robot that has got up."""

    archive: bytes  #: its compiled plan, as ``archive_of`` gives it
    world: World  #: each seed plays in a sample of it

    def __call__(self, seed: int) -> Row:
        """Whether it was done, what went wrong, and what was measured.

        See ``failures_of`` and ``MotionMeasurement``; lengths in m, times in s.
        """
        world, plant = self.drawn(seed)
        with TrialRobot(plant) as robot:
            return self.row(world, robot)

    def row(self, world: World, robot: TrialRobot) -> Row:
        """The row of a robot that lies in a sample ``world``."""
        try:
            measured = self._played(robot)
        except (TrialFailed, Go2WbcError) as error:
            measured = replace(_NOTHING, fall=str(error))
        plan = plan_of(self.archive)
        harm, shares = failures_of(measured, plan), shares_of(measured, plan)
        closest, (share, _) = max(shares.items(), key=lambda item: np.nan_to_num(item[1][0]))
        values = {**measured.as_dict(), "fall": measured.fall or ""}
        row: Row = {"done": not harm, "harm": "; ".join(harm)}
        row |= {"closest": closest, "closest_share": share, **_told(world)}
        return row | {name: value for name, value in values.items() if value is not None}

    def drawn(self, seed: int) -> tuple[World, MujocoPlant]:
        """The world of a seed, and the robot in it: heading and start differ, too."""
        rng = np.random.default_rng(seed)
        world, yaw = self.world.sample(rng), rng.uniform(*YAW_RANGE)
        noise = JOINT_NOISE
        plant = plant_in_world(world, seed=seed, initial_yaw=yaw, initial_joint_noise=noise)
        return world, plant

    def _played(self, robot: TrialRobot) -> MotionMeasurement:
        plan = plan_of(self.archive)
        robot.get_ready(plan.entry)
        return measure_motion(robot.go2, robot.truth, plan, robot.model)


_NOTHING = MotionMeasurement(
    None, False, "", *[math.nan for field in fields(MotionMeasurement) if field.type == "float"]
)
"""What is measured of a robot that did not get up."""


def _told(world: World) -> Row:
    names = ("friction", "mass_scale", "joint_friction")
    return {name: getattr(world, name) for name in names}


def text_of(world: World) -> str:
    """A world as the text that a file of a sweep keeps."""
    return json.dumps(asdict(world))


def world_of(text: str) -> World:
    """The world of such a text."""
    values = json.loads(text)
    return World(**{**values, "payload_place": tuple(values["payload_place"])})


@dataclass(frozen=True, slots=True)
class Replay:
    """A run of a motion with a seed."""

    title: str  #: what was run
    row: Row  #: what was measured now
    differences: tuple[str, ...]
    """The values that are not those of the row that is kept; none, to the last bit, under the same
    version, on the same kind of processor."""
    content: ReplayContent  #: what ``viz`` shows of it


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
