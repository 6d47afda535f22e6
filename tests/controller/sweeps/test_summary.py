"""Rates and means with intervals that hold what they say."""

import json
import math

import numpy as np
import pytest

from controller.sweeps.summary import rate_interval, summarise
from controller.sweeps.sweep_file import columns_of

TABLE = {(0, 10): (0.0, 0.3085), (10, 10): (0.6915, 1.0), (5, 10): (0.1871, 0.8129)}
"""Clopper and Pearson's intervals at 95 %, from printed tables."""
PRINTED = 5e-5  #: Half of the last digit of the table


@pytest.mark.parametrize(("seen", "interval"), TABLE.items(), ids=str)
def test_the_interval_of_a_rate_is_that_of_the_tables(
    seen: tuple[int, int], interval: tuple[float, float]
) -> None:
    assert rate_interval(*seen) == pytest.approx(interval, abs=PRINTED)


def test_the_interval_of_a_mean_holds_the_true_one_as_often_as_it_says() -> None:
    rng, held, trials = np.random.default_rng(3), 0, 400
    for _ in range(trials):
        rows = [{"x": float(value)} for value in rng.normal(2.0, 3.0, size=5)]
        (spread,) = summarise(rows, {"x": "float"}).spreads
        held += spread.low <= 2.0 <= spread.high
    low, high = rate_interval(held, trials, confidence=0.999)
    assert low <= 0.95 <= high


def test_every_kind_of_column_is_summed_up() -> None:
    rows = [
        {"ok": True, "x": 1.0, "n": 3, "why": ""},
        {"ok": False, "x": math.nan, "n": 5, "why": "fell"},
        {"ok": True, "x": 3.0, "n": 7, "why": "fell"},
        {"ok": True, "x": math.inf, "n": 9, "why": "slid"},
    ]
    summary = summarise(rows, columns_of(rows[0]))
    (ok,), (x, n), (why,) = summary.rates, summary.spreads, summary.words
    assert (ok.name, ok.n, ok.count, ok.rate) == ("ok", 4, 3, 0.75)
    assert (x.n, x.mean, x.least, x.most) == (2, 2.0, 1.0, 3.0)
    assert (n.n, n.mean, n.percentiles[1]) == (4, 6.0, 6.0)
    assert (why.n, why.kinds, why.commonest) == (3, 2, ("fell", 2))


def test_the_order_of_rows_changes_no_bit_and_what_overflows_has_no_interval() -> None:
    rows = [{"x": value} for value in np.random.default_rng(1).normal(size=999).tolist()]
    assert summarise(rows, {"x": "float"}) == summarise(rows[::-1], {"x": "float"})
    (spread,) = summarise([{"x": 1e308}, {"x": -1e308}], {"x": "float"}).spreads
    assert (spread.mean, spread.low, spread.high) == (0.0, -math.inf, math.inf)


@pytest.mark.parametrize("rows", [[], [{"x": math.nan, "ok": True}], [{"x": 1.0, "ok": False}]])
def test_what_is_not_known_is_none_in_json(rows: list) -> None:
    told = summarise(rows, {"x": "float", "ok": "bool"}).as_dict()
    json.dumps(told, allow_nan=False)
    assert told["n"] == len(rows)
