"""The speed benchmark measures what it names; how fast that is, no test says."""

from __future__ import annotations

import pytest

from benchmarks import speed
from benchmarks.trials import Trial


def test_every_controller_solves_the_same_problems_in_every_contact_mode(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr(speed, "ROUNDS", 3)
    monkeypatch.setattr(speed, "WARM_UP", 1)
    measured = speed.measure_solves(Trial(0))
    assert set(measured.values) == {metric.name for metric in speed.SOLVE_METRICS}
    assert min(measured.values.values()) > 0.0


def test_a_tick_is_timed_in_every_mode() -> None:
    measured = speed.measure_ticks(Trial(0))
    assert set(measured.values) == {metric.name for metric in speed.TICK_METRICS}
    assert min(measured.values.values()) > 0.0
