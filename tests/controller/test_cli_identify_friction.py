"""``go2-wbc identify-friction``: a table, and a file that the controller takes."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from controller.cli import main as cli
from controller.cli.common import ExitCode
from go2_wbc.config import load_config
from go2_wbc.plant import MujocoPlant, Plant, friction_identification
from go2_wbc.plant.friction_identification import FrictionEstimate

FOUND = FrictionEstimate(
    np.linspace(0.1, 1.2, 12), np.linspace(0.0, 2.0, 12), np.full(12, 0.01), np.full(12, 0.02)
)


@pytest.fixture
def found(monkeypatch: pytest.MonkeyPatch) -> list[Plant]:
    """Identifies at once, see test_friction_identification; lists the plants asked for."""
    plants: list[Plant] = []

    def identify(plant: Plant, *, on_progress: Callable[[float], None]) -> FrictionEstimate:
        plants.append(plant)
        on_progress(1.0)
        return FOUND

    monkeypatch.setattr(friction_identification, "identify_friction", identify)
    return plants


def test_it_prints_and_writes_what_the_controller_takes(
    found: list[Plant], tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path = tmp_path / "friction.toml"
    assert cli.main(["identify-friction", "--out", str(path)]) == ExitCode.OK
    assert [type(plant) for plant in found] == [MujocoPlant]
    out = capsys.readouterr().out
    assert max(map(len, out.splitlines()[:13])) <= 80
    again = tmp_path / "printed.toml"
    again.write_text(out, encoding="utf-8")
    for file in (path, again):
        assert load_config(file).wbc.joint_friction == FOUND.feed_forward


def test_a_program_can_read_it(found: list[Plant], capsys: pytest.CaptureFixture[str]) -> None:
    assert cli.main(["identify-friction", "--json"]) == ExitCode.OK
    assert len(found) == 1
    answer = json.loads(capsys.readouterr().out)
    assert answer["dry"] == pytest.approx(FOUND.dry)
    assert answer["viscous_error"] == pytest.approx(FOUND.viscous_error)


def test_a_robot_and_a_model_at_once_are_refused(capsys: pytest.CaptureFixture[str]) -> None:
    words = ["identify-friction", "--mjcf", "my_go2.xml", "--interface", "lo"]
    assert cli.main(words) == ExitCode.USAGE
    assert "not both" in capsys.readouterr().err


def test_a_file_that_cannot_be_driven_is_refused(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    words = ["identify-friction", "--mjcf", str(tmp_path / "none.xml"), "--json"]
    assert cli.main(words) == ExitCode.RUNTIME
    captured = capsys.readouterr()
    assert "no such file" in captured.err
    assert captured.out == ""
