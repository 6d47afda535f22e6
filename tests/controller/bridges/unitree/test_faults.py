"""Killed processes, garbage and floods: the bench's own scenarios, each as a test."""

from __future__ import annotations

import pytest

from benchmarks.bridges.faults import TILT_BAR, Fault, run_all
from benchmarks.bridges.unitree_faults import FAULTS
from benchmarks.trials import Failed
from tests.controller.bridges.unitree.support import needs_dds


@needs_dds
@pytest.mark.slow
@pytest.mark.parametrize("fault", FAULTS, ids=lambda fault: fault.name)
def test_the_robot_does_not_fall_and_recovers(fault: Fault) -> None:
    assert fault.run() < TILT_BAR


def test_a_fault_that_went_wrong_does_not_hide_the_others() -> None:
    def fall() -> float:
        raise Failed("it fell")

    result = run_all((Fault("a", "falls", fall), Fault("b", "stands", lambda: 5.0)))
    assert result.values == {"b": 5.0}
    assert result.failure("a") == "it fell"
    assert result.failure("b") is None
