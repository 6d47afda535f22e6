"""``go2-wbc dataset``: what is printed and written, which exit code."""

import json
from pathlib import Path

import pytest

pytest.importorskip("pyarrow", reason='needs pip install "go2-wbc[learning]"')

from controller.cli.common import ExitCode
from controller.learning import read_dataset
from tests.controller.cli.conftest import Run


def test_a_motion_is_recorded_and_told_of_in_words_or_as_json(
    run: Run, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    words = ("dataset", "bow.parquet", "--task", "bow", "--minutes", 0.04, "--workers", 1)
    told = run(*words)
    assert "1 episode, 0 falls, in bow.parquet" in told.out
    assert "1/1" in told.err
    assert [file.name for file in Path("bow.parquet").iterdir()] == ["episode-000000000.parquet"]
    found = read_dataset(tmp_path / "bow.parquet")
    values = json.loads(run(*words, "--json").out)
    assert values["file"] == str(tmp_path / "bow.parquet")
    assert values["rows"] == len(found)
    assert values["minutes"] == pytest.approx(len(found) / 3000.0)


@pytest.mark.parametrize(
    ("words", "told"),
    [
        (("set.csv",), ".parquet"),
        (("set.parquet", "--task", "swim"), "swim"),
        (("set.parquet", "--linear-x", "0.5"), "--linear-x takes two numbers"),
        (("set.parquet", "--linear-x", "0.5", "0.1"), "the lesser first"),
        (("set.parquet", "--set", "times=2"), "--set is for motions"),
        (("set.parquet", "--gait", "moonwalk"), "trot"),
        (("set.parquet", "--minutes", "0"), "minutes"),
    ],
)
def test_what_cannot_be_used_is_named(
    run: Run, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, words: tuple[str, ...], told: str
) -> None:
    monkeypatch.chdir(tmp_path)
    assert told in run("dataset", *words, code=ExitCode.USAGE).err
