"""``go2-wbc identify-friction``: a table, and a file that the controller takes."""

import json
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from controller.cli.common import ExitCode
from go2_wbc.config import load_config
from go2_wbc.plant import MujocoPlant, Plant, friction_identification
from go2_wbc.plant.friction_identification import FrictionEstimate
from tests.controller.cli.conftest import Run

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
    found: list[Plant], tmp_path: Path, run: Run
) -> None:
    path = tmp_path / "friction.toml"
    out = run("identify-friction", "--out", path).out
    assert [type(plant) for plant in found] == [MujocoPlant]
    assert max(map(len, out.splitlines()[:13])) <= 80
    again = tmp_path / "printed.toml"
    again.write_text(out, encoding="utf-8")
    for file in (path, again):
        assert load_config(file).wbc.joint_friction == FOUND.feed_forward


def test_a_program_can_read_it(found: list[Plant], run: Run) -> None:
    answer = json.loads(run("identify-friction", "--json").out)
    assert len(found) == 1
    assert answer["dry"] == pytest.approx(FOUND.dry)
    assert answer["viscous_error"] == pytest.approx(FOUND.viscous_error)


def test_a_file_that_cannot_be_driven_is_refused(tmp_path: Path, run: Run) -> None:
    said = run("identify-friction", "--mjcf", tmp_path / "none.xml", "--json", code=ExitCode.USAGE)
    assert "no such file" in said.err
    assert said.out == ""
