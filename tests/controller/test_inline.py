"""What a notebook shows of objects."""

import tomllib
from dataclasses import fields
from pathlib import Path

import numpy as np
import pytest

from controller.inline import LONGEST, html_of
from controller.sweeps.run import SweepResult
from controller.sweeps.sweep_file import Row
from controller.telemetry import SeenTerrain
from go2_wbc import brief
from go2_wbc.planning.height_map import HeightMap, fuse
from go2_wbc.recording import Recording
from motions import CheckedMotion, FeasibilityChecker, Timeline, load_motion
from tests.viz.synthetic import step_ahead

LARGEST = 1_200_000  #: Of ten seconds of a motion [bytes]


@pytest.fixture(scope="module")
def checked() -> CheckedMotion:
    return FeasibilityChecker().evaluate(load_motion("wave").hold(3.6))


def test_a_motion_and_a_report_are_a_page_a_table_and_a_picture(checked: CheckedMotion) -> None:
    shown = html_of(checked)
    assert shown
    assert len(shown.encode()) < LARGEST
    assert shown.startswith("<iframe srcdoc=")
    assert "the robot can do it" in shown
    shown = html_of(checked.report)
    assert shown
    assert "<pre>check " in shown
    assert 'src="data:image/png;base64,' in shown
    assert "<iframe" in (html_of(checked.recording()) or "")
    columns = {"seed": "int", "ok": "bool", "speed": "float"}
    rows: list[Row] = [{"seed": seed, "ok": seed > 0, "speed": 0.5 * seed} for seed in range(3)]
    shown = html_of(SweepResult(Path("a.sqlite"), "trot", columns, rows, {}, {})) or ""
    assert "<th>ok</th><td>2 of 3</td>" in shown
    assert "<th>speed</th><td>0.5</td>" in shown


def test_ground_that_was_seen_is_a_small_picture() -> None:
    heights = HeightMap()
    points = step_ahead(0.2, at=0.6) - [0.0, 0.0, 0.3]
    fuse(heights, points, np.array([0.0, 0.0, 0.3]), np.eye(3), 0.01)
    shown = html_of(SeenTerrain(heights, "")) or ""
    assert SeenTerrain(heights, "").height(1, 0) == pytest.approx(0.2, abs=0.02)
    assert shown.startswith("<img")
    assert len(shown) < LARGEST / 10


def test_what_has_no_page_is_left_to_its_line(checked: CheckedMotion) -> None:
    run = checked.recording()
    long = Recording(run.time * LONGEST, *(getattr(run, field.name) for field in fields(run)[1:]))
    assert html_of(long) is None
    assert html_of(Timeline()) is None
    assert html_of(5) is None


def test_objects_find_their_page_by_an_entry_point() -> None:
    root = Path(__file__).parents[2]
    project = tomllib.loads((root / "pyproject.toml").read_text(encoding="utf-8"))["project"]
    assert project["entry-points"]["go2_wbc.inline"] == {"html": "controller.inline:html_of"}
    for kind in (Timeline, CheckedMotion, Recording, SeenTerrain):
        assert kind._repr_html_ is brief.inline_html
