"""The fit of chances: its gradient, what it finds in made data, and what calibration tells."""

from __future__ import annotations

import math

import numpy as np
import pytest

from benchmarks.probability_fit import Sample, _loss, calibration, fit
from motions.feasibility.probability import ProbabilityModel, Rise

TRUTH = ProbabilityModel(
    {"slip": Rise(0.03, 0.5, 0.3), "torque": Rise(3.0, -0.4, 0.2)}, rest=3.0, leak=0.05
)


def _samples(seed: int, n: int) -> list[Sample]:
    """Motions with margins at random, done as often as ``TRUTH`` says."""
    rng = np.random.default_rng(seed)
    samples = []
    for number in range(n):
        margins = {"slip": rng.uniform(-0.1, 0.2), "torque": rng.uniform(-8.0, 12.0)}
        if number % 3 == 0:
            margins["support"] = rng.uniform(0.05, 0.1)  # never matters
        is_done = bool(rng.random() < TRUTH.probability(margins))
        samples.append(Sample(f"m{number // 5}", margins, is_done))
    return samples


def test_the_gradient_of_the_loss_is_that_of_finite_differences() -> None:
    rng = np.random.default_rng(1)
    x, done = rng.normal(size=(50, 3)), rng.random(50) < 0.5
    x[rng.random((50, 3)) < 0.2] = np.nan
    parameters, step = rng.normal(size=8), 1e-6
    _, gradient = _loss(parameters, x, done)
    for i in range(len(parameters)):
        moved = [parameters + sign * step * np.eye(8)[i] for sign in (1.0, -1.0)]
        up, down = (_loss(at, x, done)[0] for at in moved)
        assert gradient[i] == pytest.approx((up - down) / (2 * step), rel=1e-5, abs=1e-6)


def test_the_fit_finds_what_made_the_data_and_is_calibrated_on_others() -> None:
    model = fit(_samples(2, 4000))
    for name, rise in TRUTH.rises.items():
        found, even = model.rises[name], rise.unit * math.sinh(rise.centre)
        assert found.unit * math.sinh(found.centre) == pytest.approx(even, abs=0.3 * rise.unit)
        for margin in np.linspace(-2.0, 3.0, 11) * rise.unit:
            assert found.chance(margin) == pytest.approx(rise.chance(margin), abs=0.1)
    assert model.leak == pytest.approx(TRUTH.leak, abs=0.02)
    others = _samples(3, 2000)
    chances = np.array([model.probability(sample.margins) for sample in others])
    done = np.array([sample.is_done for sample in others])
    judged = calibration(chances, done, [sample.motion for sample in others])
    assert judged.error <= 0.03
    assert judged.brier <= 0.5 * judged.brier_of_base_rate
    assert judged.error_interval[0] <= judged.error_interval[1] <= 0.08


def test_chances_that_are_too_sure_are_told() -> None:
    rng = np.random.default_rng(4)
    chances = rng.random(1000)
    done = rng.random(1000) < chances
    names = [str(number) for number in range(1000)]
    honest = calibration(chances, done, names)
    boastful = calibration(np.where(chances > 0.5, 0.99, 0.01), done, names)
    assert honest.error < 0.06
    assert boastful.error > 0.15
    assert sum(count for *_, count in honest.bins) == 1000
