"""``record``: observations and actions of the expert, as a folder of Parquet files, one data set.

Each episode is a file of its own, written to a temporary file and renamed by the process that ran
it. So only whole episodes are left if the processes are killed, and a later run adds those that are
missing. Each file stores what its rows depend on; a folder takes only episodes that agree in this.
"""

from __future__ import annotations

import io
import json
import math
import time
from collections.abc import Callable, Mapping
from contextlib import closing
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from controller.learning.expert import EPISODE, Arrays, Expert
from controller.learning.tasks import TASKS, Commands, Range
from controller.observation import OBSERVATION, RATE, STANCE
from controller.sweeps.motion_study import archive_of, plan_of
from controller.sweeps.run import Progress, engine_of, pyarrow_of
from controller.sweeps.targets import digest, identity
from go2_wbc.arguments import typed
from go2_wbc.brief import brief
from go2_wbc.contacts import find_gait
from go2_wbc.errors import CommandError, ConfigError, SweepError
from go2_wbc.files import write_atomically
from go2_wbc.legs import JOINT_NAMES, LEGS
from go2_wbc.motion_plan import Posture
from go2_wbc.robot.model import RobotModel
from motions import CompiledPlan, FeasibilityChecker, Playable

SUFFIX, EXTRA = ".parquet", "learning"
WALK = "walk"
WALKS = {WALK: "velocity", "rough": "rough", "push": "push"}
"""The tasks in which the expert walks, and the environments' names for them."""
_KEY = b"go2_wbc"  # of the metadata
_VECTORS: Mapping[str, tuple[tuple[str, ...], str]] = {
    "observation": (OBSERVATION.parts, ""),
    "joint_targets": (JOINT_NAMES, "rad"),
    "joint_torques": (JOINT_NAMES, "N m"),
    "command": (("linear_x", "linear_y", "angular_z"), "m/s, m/s, rad/s"),
    "stance": (tuple(leg.name for leg in LEGS), "1"),
}
"""Order and unit of the columns that hold several numbers; an observation has its own units."""


@dataclass(frozen=True, slots=True)
class Dataset:
    """What ``record`` has written, in the order of the episodes."""

    columns: Arrays  #: by name; the first axis is that of the rows
    about: Mapping[str, Any]  #: task, units and order of the columns, rate [1/s], gains, versions

    __repr__ = brief

    def __getitem__(self, name: str) -> np.ndarray:
        return self.columns[name]

    def __len__(self) -> int:
        return len(self.columns["seed"])


@dataclass(frozen=True, slots=True)
class Recorder:
    """Writes the episode of a seed; what workers call."""

    folder: Path
    expert: Expert
    about: str  #: as JSON

    def file_of(self, seed: int) -> Path:
        """The file of an episode."""
        return self.folder / f"episode-{seed:09d}{SUFFIX}"

    def __call__(self, seed: int) -> int:
        """How many rows it has."""
        columns = self.expert.episode(seed)
        write_atomically(self.file_of(seed), _parquet(columns, self.about))
        return len(columns["seed"])


@typed("path", "minutes", "seed", "workers", "gait", error=CommandError)
def record(
    path: Path | str,
    task: Playable = WALK,
    *,
    minutes: float = 10.0,
    seed: int = 0,
    workers: int | None = None,
    gait: str = "trot",
    commands: Mapping[str, Range] | None = None,
    on_progress: Callable[[Progress], None] = lambda progress: None,
) -> Path:
    """Let ``GO2Controller`` do ``task`` in random worlds, and keep what a learner needs of it.

    A recording that was interrupted, however that came, goes on where it ended: call it again. The
    rows depend on the seeds alone, not on the number of workers. ``pandas.read_parquet`` and
    others read the folder as one table.

    Args:
        path: of the folder, which ends in ``.parquet``.
        task: "walk" for the trot on the level, "rough", "push", or a motion, as
            ``GO2Controller.play`` takes it.
        minutes: of robot time, rounded up to whole episodes: walks of 20 s, or the motion.
        seed: of the first episode; the others follow.
        workers: processes; by default as many as processors.
        gait: in which it walks.
        commands: ranges by name: ``linear_x``, ``linear_y`` [m/s], ``angular_z`` [rad/s]; by
            default those of the environment.
        on_progress: is told after every episode.

    Returns:
        The absolute path.

    Raises:
        CommandError: for an argument that is not valid.
        ConfigError: for a folder that cannot be used, or holds episodes of something else.
        MissingDependency: without pyarrow.
        SweepError: if an episode fails; what is finished is kept.
    """
    pyarrow_of(EXTRA)
    if not (math.isfinite(minutes) and minutes > 0.0) or seed < 0:
        raise CommandError(f"minutes must be positive, and seed 0 or more: {minutes!r}, {seed!r}")
    expert, name, duration = _expert(task, gait, commands or {})
    recorder = Recorder(_folder(path), expert, json.dumps(_about(expert, name)))
    seeds = range(seed, seed + math.ceil(60.0 * minutes / duration - 1e-9))
    _require_same(recorder)
    left = [seed for seed in seeds if not recorder.file_of(seed).exists()]
    start, done = time.monotonic(), len(seeds) - len(left)
    on_progress(Progress(done, len(seeds), 0.0))
    with closing(engine_of("local", workers).run(recorder, left)) as ends:
        for count, ended in enumerate(ends, 1):
            if (failure := ended.failure) is not None:
                raise SweepError(f"episode {ended.item}: {failure.text}\n{failure.details}")
            rate = count / max(time.monotonic() - start, math.ulp(1.0))
            on_progress(Progress(done + count, len(seeds), rate))
    return recorder.folder


def read_dataset(path: Path | str) -> Dataset:
    """What ``record`` has written, all episodes in one.

    Raises:
        ConfigError: for a folder without episodes, or one that cannot be read.
        MissingDependency: without pyarrow.
    """
    pyarrow, parquet = pyarrow_of(EXTRA)
    files = sorted(Path(path).expanduser().glob(f"episode-*{SUFFIX}"))
    if not files:
        raise ConfigError(f"{path} holds no episodes: record(path) writes them")
    try:
        tables = [parquet.read_table(file) for file in files]
    except (OSError, pyarrow.ArrowException) as error:
        raise ConfigError(f"cannot read {path}: {error}") from error
    table = pyarrow.concat_tables(tables)
    columns = {name: _array(table[name].combine_chunks()) for name in table.column_names}
    return Dataset(columns, json.loads(tables[0].schema.metadata[_KEY]))


def _expert(task: Playable, gait: str, ranges: Mapping[str, Range]) -> tuple[Expert, str, float]:
    """What is recorded, its name, and how long an episode takes [s]."""
    if isinstance(task, str) and task in WALKS:
        own = TASKS[WALKS[task]]
        commands = _commands(own.commands, ranges)
        return Expert(replace(own, commands=commands), find_gait(gait).name), task, EPISODE
    if ranges:
        raise CommandError(f"a motion follows no commands; tasks that do: {', '.join(WALKS)}")
    plan = FeasibilityChecker(RobotModel()).plan(task)
    if not isinstance(plan, CompiledPlan) or plan.entry not in (Posture.STAND, Posture.SIT):
        raise CommandError(f"only a motion that starts standing or sitting can be recorded: {plan}")
    archive = archive_of(plan)
    return Expert(TASKS[WALKS[WALK]], gait, archive), plan.name, plan_of(archive).duration


def _commands(own: Commands, ranges: Mapping[str, Range]) -> Commands:
    for name, given in ranges.items():
        if name not in ("linear_x", "linear_y", "angular_z"):
            raise CommandError(f"commands are linear_x, linear_y and angular_z, got {name!r}")
        low_high = tuple(given)
        if len(low_high) != 2 or not -math.inf < low_high[0] <= low_high[1] < math.inf:
            raise CommandError(f"{name} must be two numbers, the lesser first, got {given!r}")
    return replace(own, **{name: (float(a), float(b)) for name, (a, b) in ranges.items()})


def _about(expert: Expert, name: str) -> dict[str, Any]:
    """What rows depend on besides the seed, and what they mean."""
    columns = {column: {"parts": parts, "unit": unit} for column, (parts, unit) in _VECTORS.items()}
    columns["observation"] = {"parts": OBSERVATION.parts, "unit": ", ".join(OBSERVATION.units)}
    columns |= {"time": {"unit": "s"}, "phase": {"unit": "1"}, "mass_scale": {"unit": "1"}}
    return {
        "task": name,
        "gait": expert.gait,
        "plan": digest(expert.archive),
        "commands": asdict(expert.task.commands),
        "rate": RATE,
        "kp": expert.kp,
        "kd": expert.kd,
        "stance": STANCE,
        "columns": columns,
        **identity(),
    }


def _folder(path: Path | str) -> Path:
    folder = Path(path).expanduser().absolute()
    if folder.suffix != SUFFIX:
        raise ConfigError(f"a data set is a folder that ends in {SUFFIX}, got {folder}")
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise ConfigError(f"cannot use {folder}: {error.strerror or error}") from error
    for aside in folder.glob(".episode-*"):  # of who was killed
        aside.unlink(missing_ok=True)
    return folder


def _require_same(recorder: Recorder) -> None:
    """Raise ConfigError where the folder holds episodes of something else."""
    _, parquet = pyarrow_of(EXTRA)
    wanted = json.loads(recorder.about)
    for file in sorted(recorder.folder.glob(f"episode-*{SUFFIX}")):
        try:
            about = json.loads(parquet.read_schema(file).metadata[_KEY])
        except (OSError, ValueError, KeyError, TypeError) as error:
            raise ConfigError(f"{file} is no episode: {error}; choose another folder") from error
        if other := [name for name in wanted if about.get(name) != wanted[name]]:
            told = f"its {', '.join(other)} {'is' if len(other) == 1 else 'are'} another"
            raise ConfigError(f"{file} holds something else, {told}: choose another folder")


def _parquet(columns: Arrays, about: str) -> bytes:
    pyarrow, parquet = pyarrow_of(EXTRA)
    arrays = {}
    for name, values in columns.items():
        flat = pyarrow.array(values.ravel())
        is_vector = values.ndim == 2
        arrays[name] = (
            pyarrow.FixedSizeListArray.from_arrays(flat, values.shape[1]) if is_vector else flat
        )
    table = pyarrow.table(arrays).replace_schema_metadata({_KEY: about.encode()})
    stream = io.BytesIO()
    parquet.write_table(table, stream)
    return stream.getvalue()


def _array(column: Any) -> np.ndarray:  # noqa: ANN401, pyarrow is untyped
    """A column as an array; lists become its second axis."""
    size = getattr(column.type, "list_size", None)
    if size is None:
        return column.to_numpy(zero_copy_only=False)
    return column.flatten().to_numpy(zero_copy_only=False).reshape(-1, size)
