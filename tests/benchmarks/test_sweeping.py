"""The benchmark of sweeps: a row that can be swept, and how memory is judged."""

from __future__ import annotations

import pytest

from benchmarks import sweeping
from benchmarks.sweeping import LONG, STUDIES, growth_of, trial
from controller.sweeps.rows import row_of


def test_a_run_is_a_row_with_the_memory_of_its_process() -> None:
    row = row_of(trial(0))
    assert row["done"] is True
    assert 50.0 < float(row["memory"]) < 5000.0


@pytest.mark.parametrize(("leak", "is_flat"), [(0.0, True), (0.1, False)])
def test_memory_that_grows_is_told(leak: float, is_flat: bool) -> None:
    rows = [{"memory": 500.0 + min(k, 50) + leak * k} for k in range(LONG)]  # 0.1 MB: 17 % in all
    values = growth_of(rows)
    growth = STUDIES[1].metrics[0]
    assert growth.threshold is not None
    assert growth.direction.meets(values["growth"], growth.threshold) is is_flat
    assert values["memory"] == pytest.approx(550.0 + leak * 949.5)


def test_two_workers_are_held_to_two_bare_processes(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(sweeping, "_pace_swept", {1: 2.0, 2: 3.0}.__getitem__)
    monkeypatch.setattr(sweeping, "_pace_bare", {1: 2.5, 2: 4.5}.__getitem__)
    values = STUDIES[0].run(0).values
    assert values["sweeps.share"] == pytest.approx(1.5 / 1.8)
    assert {metric.name for metric in STUDIES[0].metrics} == set(values)
