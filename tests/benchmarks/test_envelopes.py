"""The measured envelopes: how a bound is found, and what is stored."""

import json
from pathlib import Path

import pytest

from benchmarks import envelopes
from benchmarks.envelopes import ITEMS, MOST, STEPS, collected, holds, render, trial, write
from go2_wbc.contacts import GAITS
from go2_wbc.planning.envelopes import measured_envelopes


@pytest.mark.parametrize("item", [0, 7])
def test_a_bound_is_the_greatest_speed_that_holds_under_every_seed(
    item: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    _, axis = ITEMS[item]
    limits = [0.7 * MOST[axis], 0.4 * MOST[axis], 0.9 * MOST[axis]]
    monkeypatch.setattr(envelopes, "SEEDS", len(limits))
    monkeypatch.setattr(envelopes, "holds", lambda _g, _a, speed, seed: speed <= limits[seed])
    bound = trial(item)["bound"]
    assert isinstance(bound, float)
    assert min(limits) - MOST[axis] / 2**STEPS <= bound <= min(limits)


def test_what_is_stored_is_what_the_package_reads(tmp_path: Path) -> None:
    rows = [
        {"gait": gait, "axis": axis, "bound": 0.5 + 0.01 * n}
        for n, (gait, axis) in enumerate(ITEMS)
    ]
    bounds, file = collected(rows), tmp_path / "envelopes.json"
    write(bounds, file)
    kept = json.loads(file.read_text(encoding="utf-8"))["gaits"]
    assert kept == bounds
    assert kept.keys() == GAITS.keys() == measured_envelopes().keys()
    assert bounds["trot"]["backward"] == 0.51
    lines = render(bounds).splitlines()
    assert max(map(len, lines)) <= 80
    assert "0.51" in next(line for line in lines if line.startswith("trot"))
    assert "?" in render(collected(rows[1:]))


@pytest.mark.slow
@pytest.mark.parametrize(
    ("axis", "speed", "is_held"), [("forward", 0.5, True), ("lateral", 3.0, False)]
)
def test_a_trot_holds_a_slow_speed_and_not_a_reckless_one(
    axis: str, speed: float, is_held: bool
) -> None:
    assert holds("trot", axis, speed, 0) is is_held
