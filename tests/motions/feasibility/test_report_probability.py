"""The chance of a motion: rises with every margin, multiplies causes, survives extremes."""

import math
from dataclasses import replace

import pytest
from hypothesis import given
from hypothesis import strategies as st

from motions import check
from motions.feasibility import report
from motions.feasibility.report import ProbabilityModel, Rise

MODEL = ProbabilityModel({"slip": Rise(0.01, 0.5, 0.4), "torque": Rise(2.0, -1.0, 0.5)}, rest=3.0)
MARGINS = st.floats(-1e6, 1e6)


@given(slip=MARGINS, torque=MARGINS, more=st.floats(0.0, 1e3))
def test_a_wider_margin_never_lowers_the_chance(slip: float, torque: float, more: float) -> None:
    before = MODEL.probability({"slip": slip, "torque": torque})
    assert 0.0 <= before <= 1.0
    assert MODEL.probability({"slip": slip + more, "torque": torque}) >= before
    assert MODEL.probability({"slip": slip, "torque": torque + more}) >= before


def test_causes_multiply_what_no_fit_has_seen_is_yes_or_no_and_the_leak_is_left() -> None:
    margins = {"slip": 0.01 * math.sinh(0.9), "torque": 2.0 * math.sinh(-1.0)}
    chances = MODEL.chances(margins)
    assert chances == pytest.approx({"slip": 1 / (1 + math.exp(-1)), "torque": 0.5})
    rest = 1 / (1 + math.exp(-3))
    assert MODEL.probability(margins) == pytest.approx(rest * math.prod(chances.values()))
    assert MODEL.probability({"slip": math.nan}) == pytest.approx(rest)
    assert MODEL.probability({"slip": -math.inf}) == 0.0
    assert MODEL.chances({"a": 1e-9, "b": 0.0, "c": -1e-9}) == {"a": 1.0, "b": 1.0, "c": 0.0}
    leaky = replace(MODEL, leak=0.1)
    rest = 1 / (1 + math.exp(-3))
    assert leaky.probability({"slip": -math.inf}) == pytest.approx(0.1 * rest)
    even = {"torque": 2.0 * math.sinh(-1.0)}
    assert leaky.probability(even) == pytest.approx((0.1 + 0.9 * 0.5) * rest)
    assert leaky.probability({"slip": math.inf}) == pytest.approx(rest)
    assert leaky.probability({"numbers": -1.0}) == 0.0


def test_a_model_comes_back_from_its_values() -> None:
    for model in (MODEL, replace(MODEL, leak=0.1)):
        assert ProbabilityModel.of(model.as_dict()) == model


@pytest.mark.parametrize(
    ("rest", "words"), [(9.0, "over 99 %"), (1.0, "73 %"), (-9.0, "under 1 %")]
)
def test_nothing_is_told_to_be_certain(
    monkeypatch: pytest.MonkeyPatch, rest: float, words: str
) -> None:
    monkeypatch.setattr(report, "fitted", lambda: ProbabilityModel({}, rest))
    assert f"Chance that it is done so: {words}." in check("nod").table()
