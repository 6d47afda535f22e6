"""Borders and outcomes in files: read back as written, and never believed when they are old."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from benchmarks.validation_set import stored
from benchmarks.validation_set.questions import FAMILIES, Question, draw_name, draws, questions
from benchmarks.validation_set.stored import (
    digest,
    read_borders,
    read_outcomes,
    write_borders,
    write_outcomes,
)
from controller.motion_failures import MotionFailures
from go2_wbc.errors import ConfigError
from go2_wbc.robot.model import RobotModel

BORDERS: dict[str, float | None] = {"crouch 0": 1.25, "rise 0": None}
OUTCOMES = {
    "a 0 1.0 x": MotionFailures(("slip 12 mm",), ("fell",), (), ()),
    "b": MotionFailures((), (), (), ()),
}


def test_borders_are_read_as_they_were_written(tmp_path: Path) -> None:
    file = tmp_path / "borders.json"
    write_borders(BORDERS, file)
    assert read_borders(file) == BORDERS


def test_outcomes_are_read_as_they_were_written(tmp_path: Path) -> None:
    file = tmp_path / "outcomes.json"
    write_outcomes(OUTCOMES, file)
    assert read_outcomes(file) == (OUTCOMES, "")


def test_outcomes_of_other_code_do_not_hold(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    file = tmp_path / "outcomes.json"
    write_outcomes(OUTCOMES, file)
    now = stored.physics_header()
    monkeypatch.setattr(stored, "physics_header", lambda: {**now, "code": "other"})
    found, why = read_outcomes(file)
    assert not found
    assert "now other" in why


def test_a_damaged_file_is_an_error_that_says_what_to_do(tmp_path: Path) -> None:
    file = tmp_path / "borders.json"
    file.write_text("{")
    with pytest.raises(ConfigError, match="--borders"):
        read_borders(file)
    assert read_outcomes(tmp_path / "none.json") == ({}, "no outcomes are stored")


def test_the_digest_tells_plans_apart_that_are_played_differently() -> None:
    model, family = RobotModel(), FAMILIES["lean_aside"]
    plans = [Question(family, 0, s).plan(model) for s in (0.5, 0.5, 0.501)]
    digests = [digest(plan) for plan in plans]
    assert digests[0] == digests[1] != digests[2]


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


def test_the_code_that_decides_outcomes_is_there() -> None:
    assert [name for name in stored.DECIDES if not (stored.ROOT / name).exists()] == []
