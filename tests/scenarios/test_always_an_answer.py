"""Where the QP contradicts itself there is an answer, and the robot is not damped for that.

A sample of ``python -m benchmarks answers``, one seed of each row.
"""

from __future__ import annotations

import pytest

from benchmarks.answers import SCENARIOS
from controller.sweeps.trials import Trial

SAMPLES = [("boxes", 19), ("pushes", 12), ("stops", 13)]
"""Scenario and seed; in all of these the hard QP has no solution in some ticks."""
GRAVE = 0.1  # [%] of the ticks


@pytest.mark.slow
@pytest.mark.parametrize(("name", "seed"), SAMPLES)
def test_contradictions_are_answered_and_never_damp_an_upright_robot(name: str, seed: int) -> None:
    scenario = next(scenario for scenario in SCENARIOS if scenario.name == name)
    values = scenario.measure(Trial(seed)).values
    assert values[f"{name}.failures"] == 0.0
    assert values[f"{name}.damped"] == 0.0
    assert values[f"{name}.unreported"] == values[f"{name}.falls"] == 0.0
    assert values[f"{name}.relaxed"] > 0.0, "or the test would say nothing"
    assert values[f"{name}.grave"] <= GRAVE
