"""Data sets: complete however often they were killed, without doubles, readable by others."""

import signal
import subprocess
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest

pytest.importorskip("pyarrow", reason='needs pip install "go2-wbc[learning]"')

import pandas
from pyarrow import parquet

from controller.learning.dataset import Dataset, read_dataset, record
from controller.observation import OBSERVATION
from go2_wbc.errors import CommandError, ConfigError

EPISODES = 3
MINUTES = EPISODES * 2.4 / 60.0  #: That many times a bow


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """All at once, in one process."""
    return record(tmp_path_factory.mktemp("set") / "bow.parquet", "bow", minutes=MINUTES, workers=1)


@pytest.fixture(scope="module")
def whole(folder: Path) -> Dataset:
    return read_dataset(folder)


def test_one_that_is_killed_and_resumed_is_the_one_that_was_not(
    tmp_path: Path, whole: Dataset
) -> None:
    folder = tmp_path / "bow.parquet"
    program = (
        "from controller.learning import record; tell = lambda progress: print('on', flush=True); "
        f"record({str(folder)!r}, 'bow', minutes=1, workers=2, on_progress=tell)"
    )
    with subprocess.Popen([sys.executable, "-c", program], stdout=subprocess.PIPE) as process:
        assert process.stdout is not None
        assert [process.stdout.readline() for _ in range(2)] == [b"on\n"] * 2
        process.send_signal(signal.SIGKILL)
    assert process.returncode == -signal.SIGKILL
    (folder / ".episode-000000009.parquet.x1").write_bytes(b"half")
    before = {file: file.read_bytes() for file in folder.glob("episode-*")}
    record(folder, "bow", minutes=MINUTES, workers=2)
    after = {file: file.read_bytes() for file in folder.glob("*")}
    assert all(after[file] == content for file, content in before.items())
    assert not list(folder.glob(".*"))
    for file in set(after) - {folder / f"episode-{n:09d}.parquet" for n in range(EPISODES)}:
        file.unlink()  # it had been asked for more
    found = read_dataset(folder)
    assert found.about == whole.about
    for name, values in whole.columns.items():
        assert np.array_equal(found[name], values), name


def test_nothing_comes_twice_and_more_is_added(folder: Path, whole: Dataset) -> None:
    assert sorted(set(whole["seed"])) == list(range(EPISODES))
    pairs = np.column_stack([whole["seed"], whole["step"]])
    assert len(np.unique(pairs, axis=0)) == len(whole)
    told: list[Any] = []
    record(folder, "bow", minutes=MINUTES, on_progress=told.append)
    assert [(progress.done, progress.total) for progress in told] == [(EPISODES, EPISODES)]


def test_what_it_means_is_kept_with_it_and_others_read_it(folder: Path, whole: Dataset) -> None:
    assert whole.about["task"] == "bow"
    assert tuple(whole.about["columns"]["observation"]["parts"]) == OBSERVATION.parts
    assert whole.about["columns"]["joint_torques"]["unit"] == "N m"
    assert whole["observation"].shape == (len(whole), OBSERVATION.size)
    assert whole["phase"][0] == 0.0
    assert whole["phase"].max() < 1.0
    table = pandas.read_parquet(folder)
    assert len(table) == len(whole)
    assert np.array_equal(np.stack(table["joint_targets"].tolist()), whole["joint_targets"])
    assert parquet.read_schema(next(folder.glob("episode-*"))).metadata


def test_a_folder_of_something_else_is_refused(folder: Path, tmp_path: Path) -> None:
    with pytest.raises(ConfigError, match="task"):
        record(folder, "nod", minutes=0.1)
    with pytest.raises(ConfigError, match=r"\.parquet"):
        record(tmp_path / "bow.csv", "bow")
    strange = tmp_path / "bow.parquet"
    strange.mkdir()
    (strange / "episode-000000000.parquet").write_bytes(b"nothing")
    for use in (lambda: record(strange, "bow"), lambda: read_dataset(strange)):
        with pytest.raises(ConfigError, match=r"bow\.parquet"):
            use()
    with pytest.raises(ConfigError, match="no episodes"):
        read_dataset(tmp_path)
    (tmp_path / "taken.parquet").write_text("")
    with pytest.raises(ConfigError, match="taken"):
        record(tmp_path / "taken.parquet", "bow")


@pytest.mark.parametrize(
    ("task", "settings"),
    [
        ("swim", {}),
        ("walk", {"minutes": 0.0}),
        ("walk", {"minutes": float("nan")}),
        ("walk", {"seed": -1}),
        ("walk", {"workers": 0}),
        ("walk", {"gait": "moonwalk"}),
        ("walk", {"commands": {"speed": (0.0, 1.0)}}),
        ("walk", {"commands": {"linear_x": (1.0, 0.0)}}),
        ("bow", {"commands": {"linear_x": (0.0, 1.0)}}),
    ],
)
def test_wrong_arguments_are_named(tmp_path: Path, task: str, settings: dict[str, Any]) -> None:
    with pytest.raises(CommandError):
        record(tmp_path / "set.parquet", task, **settings)
