"""The file of borders: read back as it was written."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from benchmarks.validation_set.questions import draw_name, draws, questions
from benchmarks.validation_set.stored import read_borders, write_borders
from go2_wbc.errors import ConfigError

BORDERS: dict[str, float | None] = {"crouch 0": 1.25, "rise 0": None}


def test_borders_are_read_as_they_were_written(tmp_path: Path) -> None:
    file = tmp_path / "borders.json"
    write_borders(BORDERS, file)
    assert read_borders(file) == BORDERS


def test_a_damaged_file_is_an_error_that_says_what_to_do(tmp_path: Path) -> None:
    file = tmp_path / "borders.json"
    file.write_text("{")
    with pytest.raises(ConfigError, match="--borders"):
        read_borders(file)
    with pytest.raises(ConfigError, match="cannot be read"):
        read_borders(tmp_path / "none.json")


def test_the_borders_that_are_kept_are_those_of_the_exam() -> None:
    kept = read_borders()
    assert set(kept) <= {draw_name(family, number) for family, number in draws()}
    for question in questions(kept):
        assert question.amplitude > 0.0


def test_a_file_is_one_entry_a_line(tmp_path: Path) -> None:
    file = tmp_path / "borders.json"
    write_borders(BORDERS, file)
    assert len(file.read_text().splitlines()) == 2 + len(BORDERS)
    assert json.loads(file.read_text()) == BORDERS
