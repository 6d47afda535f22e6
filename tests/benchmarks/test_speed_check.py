"""The cost of checking is measured for every motion that is named; how much, no test says."""

from __future__ import annotations

import pytest

from benchmarks import speed_check
from controller.sweeps.trials import Trial


def test_checking_and_compiling_are_timed_for_every_motion(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(speed_check, "ROUNDS", 1)
    measured = speed_check.measure_checks(Trial(0))
    assert set(measured.values) == {metric.name for metric in speed_check.CHECK_METRICS}
    assert min(measured.values.values()) > 0.0


@pytest.mark.parametrize("seconds", speed_check.LENGTHS)
def test_the_motions_are_as_long_as_they_say(seconds: int) -> None:
    assert speed_check.lively_motion(seconds).end == pytest.approx(seconds, rel=0.2)
