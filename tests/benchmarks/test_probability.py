"""What is made of the runs of ``probability``: the model that is stored, the table, the diagram."""

from __future__ import annotations

import csv
import io
import json
from pathlib import Path

import pytest

from benchmarks.probability import (
    COLUMNS,
    csv_of,
    judge,
    passed_that_fell,
    render,
    save_reliability,
    store,
)
from benchmarks.validation_set.drawing import TEST, TRAIN
from controller.sweeps.rows import Row
from motions.feasibility.probability import ProbabilityModel, Rise

MODEL = ProbabilityModel({"slip": Rise(0.01, 0.0, 0.4)}, rest=3.0, leak=0.05)


def _row(seed: int, *, half: str = TEST, slip: float, done: bool, fell: bool = False) -> Row:
    return {
        "seed": seed,
        "motion": f"nod {seed // 5}",
        "family": "nod",
        "half": half,
        "stratum": "easy",
        "friction": 0.5,
        "payload": 1.23456,
        "refused": slip < 0.0,
        "done": done,
        "fell": fell,
        "harm": "" if done else "slip 12 mm",
        "margins": json.dumps({"slip": slip}),
    }


ROWS = [_row(seed, slip=0.002 * (seed - 10), done=seed > 9) for seed in range(20)]


def test_what_is_stored_is_the_model_and_what_it_was_fitted_to(tmp_path: Path) -> None:
    file, train = tmp_path / "probability.json", [_row(7, half=TRAIN, slip=0.0, done=True)]
    store(MODEL, [*ROWS, *train], "c0de", file)
    kept = json.loads(file.read_text(encoding="utf-8"))
    assert ProbabilityModel.of(kept) == MODEL
    assert (kept["about"]["motions"], kept["about"]["runs"], kept["about"]["code"]) == (
        1,
        1,
        "c0de",
    )


def test_every_run_is_a_line_with_the_chance_that_was_stated() -> None:
    lines = list(csv.DictReader(io.StringIO(csv_of(MODEL, ROWS).decode())))
    assert len(lines) == len(ROWS)
    assert tuple(lines[0]) == (*COLUMNS, "chance")
    assert (lines[3]["refused"], lines[3]["done"], lines[3]["payload"]) == ("1", "0", "1.235")
    assert float(lines[15]["chance"]) == pytest.approx(MODEL.probability({"slip": 0.01}), abs=5e-4)


def test_the_diagram_has_a_point_for_every_bin_with_runs(tmp_path: Path) -> None:
    judged = judge(MODEL, ROWS)
    assert sum(count for *_, count in judged.bins) == len(ROWS)
    text = save_reliability(judged, tmp_path / "reliability.svg").read_text()
    assert "20 runs of the test half" in text
    assert "chance stated" in text
    assert all(f">{count}<" in text for *_, count in judged.bins)


def test_a_passed_motion_that_fell_is_counted_and_named() -> None:
    rows = [*ROWS, _row(20, slip=0.01, done=False, fell=True), _row(21, slip=-1.0, done=False)]
    assert passed_that_fell(rows) == (1, 11)
    text = render(judge(MODEL, rows), rows, {})
    assert "motions that passed in their world and fell there: 1 of 11" in text
    assert "seed 20: nod 4, friction 0.50, 1.2 kg" in text
