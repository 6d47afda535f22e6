"""Killed processes, garbage and floods: the benchmark's own scenarios, each as a test."""

from __future__ import annotations

import pytest

from benchmarks.bridges.faults import TILT_LIMIT, Fault, run_all
from benchmarks.bridges.unitree_faults import FAULTS, tilt_during
from controller.sweeps.trials import TrialFailed
from tests.controller.bridges.unitree.support import needs_dds


@needs_dds
@pytest.mark.slow
@pytest.mark.parametrize("fault", FAULTS, ids=lambda fault: fault.name)
def test_the_robot_does_not_fall_and_recovers(fault: Fault) -> None:
    assert tilt_during(fault) < TILT_LIMIT


def test_a_fault_that_went_wrong_does_not_hide_the_others() -> None:
    def fall(_at: None) -> None:
        raise TrialFailed("it fell")

    def tilt_during(fault: Fault) -> float:
        fault.play(None)
        return 5.0

    result = run_all((Fault("a", "falls", fall), Fault("b", "stands", print)), tilt_during)
    assert result.values == {"b": 5.0}
    assert result.failure("a") == "it fell"
    assert result.failure("b") is None
