"""The report counts honestly: means, worst seeds, falls."""

import importlib
import json
import math

import pytest

from benchmarks.report import WIDTH, render, summarise, summarise_metric
from benchmarks.study import Metric, TrialResult
from tests.benchmarks.support import ERROR, NOTE, SPEED, fake, measured

NEEDED = {
    *("name", "item", "quantity", "unit", "threshold", "direction", "n", "mean", "sd", "worst"),
    *("worst_seed", "falls", "passed", "values", "failures"),
}
"""Keys of a row in the JSON that programs rely on."""


@pytest.mark.parametrize(
    ("metric", "values", "mean", "worst", "seed", "passed"),
    [
        (SPEED, (3.0, 0.5, 1.0), 1.5, 0.5, 1, True),  # the threshold is for the mean
        (ERROR, (3.0, 0.5, 4.0), 2.5, 4.0, 2, False),
        (SPEED, (1.0,), 1.0, 1.0, 0, True),  # on the threshold
        (ERROR, (2.0,), 2.0, 2.0, 0, True),
        (NOTE, (5.0,), 5.0, 5.0, 0, None),
        (SPEED, (), None, None, None, False),
    ],
)
def test_the_mean_is_held_to_the_threshold_and_the_worst_seed_named(
    metric: Metric,
    values: tuple[float, ...],
    mean: float | None,
    worst: float | None,
    seed: int | None,
    passed: bool | None,
) -> None:
    result = summarise_metric(metric, measured(*values, metric=metric))
    assert (result.n, result.mean, result.worst) == (len(values), mean, worst)
    assert (result.worst_seed, result.passed) == (seed, passed)


def test_no_failure_passes_however_good_other_values_are() -> None:
    trials = {0: TrialResult({"fake.speed": 100.0}), 7: TrialResult({}, reason="fell")}
    result = summarise_metric(SPEED, trials)
    assert result.passed is False
    assert (result.falls, result.failures) == (1, {7: "fell"})
    assert (result.n, result.mean, result.worst, result.worst_seed) == (2, 100.0, None, 7)
    trials = {0: TrialResult({"fake.speed": 100.0}, {"fake.speed": "said False"})}
    result = summarise_metric(SPEED, trials)
    assert result.passed is False
    assert (result.falls, result.worst) == (1, 100.0)
    result = summarise_metric(SPEED, measured(2.0, math.nan))
    assert result.passed is False
    assert (result.mean, result.worst_seed, set(result.failures)) == (2.0, 1, {1})


def test_the_table_fits_80_columns_with_numbers_apart_and_names_the_fallen_seed() -> None:
    long_reason = "fell at t=3.20 s: " + "roll 71 deg, pitch -3 deg, " * 20
    trials = {s: TrialResult({}, reason=long_reason) for s in range(9)}
    widest = {s: TrialResult({row: -1.23456e-12}) for s in range(999) for row in ("fake.speed",)}
    for results in (trials, widest, measured(1.0)):
        text = render(summarise([fake()], {"fake": results}))
        assert max(map(len, text.splitlines())) <= WIDTH
    assert "seed 2: fell at t=3.20 s" in render(summarise([fake()], {"fake": trials}))
    trials = {seed: TrialResult({"fake.speed": 0.00894 + 0.000602 * seed}) for seed in range(9)}
    (line,) = [s for s in render(summarise([fake()], {"fake": trials})).splitlines() if "0.0" in s]
    assert len(line.split()[-6:-3]) == 3
    assert all(float(word) < 0.02 for word in line.split()[-6:-3]), line


@pytest.mark.parametrize(
    "name",
    [
        *("balance", "behaviour", "bridges", "combined", "dance", "faults", "locomotion"),
        *("adversary", "qp_infeasibility", "sequences"),
    ],
)
def test_every_real_metric_fits_the_table_and_has_its_own_name(name: str) -> None:
    scenarios = importlib.import_module(f"benchmarks.{name}").STUDIES
    rows = [row for scenario in scenarios for row in scenario.metrics]
    assert len({row.name for row in rows}) == len(rows)
    assert [row.quantity for row in rows if len(row.quantity) > 26] == []
    assert [row.item for row in rows if len(row.item) > WIDTH] == []
    for value in (-1.2e-12, 0.975, 0.000602):
        gave = {seed: {m.name: value for s in scenarios for m in s.metrics} for seed in range(12)}
        results = {s.name: {seed: TrialResult(v) for seed, v in gave.items()} for s in scenarios}
        text = render(summarise(scenarios, results))
        assert max(map(len, text.splitlines())) <= WIDTH


def test_the_deviation_is_that_of_a_sample_and_the_json_has_every_key_and_no_nan() -> None:
    result = summarise_metric(SPEED, measured(3.0, 0.5, 1.0))
    assert result.sd == pytest.approx(math.sqrt((1.5**2 + 1.0**2 + 0.5**2) / 2))
    assert summarise_metric(SPEED, measured(3.0)).sd is None
    results = {"fake": {0: fake().run(0), 1: TrialResult({"fake.speed": math.inf})}}
    value = summarise([fake()], results).as_dict()
    text = json.dumps(value, allow_nan=False)
    rows = json.loads(text)["rows"]
    assert all(set(row) == NEEDED for row in rows)
    assert [row["name"] for row in rows] == ["fake.speed", "fake.error", "fake.note"]
    assert value["passed"] is False
