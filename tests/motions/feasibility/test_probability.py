"""The chance of a motion: rises with every margin, multiplies causes, survives extremes."""

from __future__ import annotations

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from motions.feasibility.probability import UNSEEN_WIDTH, ProbabilityModel, Rise

MODEL = ProbabilityModel({"slip": Rise(0.02, 0.01), "torque": Rise(-1.0, 0.5)}, rest=3.0)
MARGINS = st.floats(-1e6, 1e6)


@given(slip=MARGINS, torque=MARGINS, more=st.floats(0.0, 1e3))
def test_a_wider_margin_never_lowers_the_chance(slip: float, torque: float, more: float) -> None:
    before = MODEL.probability({"slip": slip, "torque": torque})
    assert 0.0 <= before <= 1.0
    assert MODEL.probability({"slip": slip + more, "torque": torque}) >= before
    assert MODEL.probability({"slip": slip, "torque": torque + more}) >= before


def test_causes_multiply_and_what_was_not_checked_is_no_risk() -> None:
    chances = MODEL.chances({"slip": 0.03, "torque": -1.0})
    assert chances == pytest.approx({"slip": 1 / (1 + math.exp(-1)), "torque": 0.5})
    rest = 1 / (1 + math.exp(-3))
    assert MODEL.probability({"slip": 0.03, "torque": -1.0}) == pytest.approx(
        rest * math.prod(chances.values())
    )
    assert MODEL.probability({"slip": math.nan}) == pytest.approx(rest)


def test_a_check_that_no_fit_has_seen_is_a_yes_or_no() -> None:
    assert MODEL.chances({"other": 20 * UNSEEN_WIDTH})["other"] == pytest.approx(1.0, abs=1e-6)
    assert MODEL.chances({"other": -20 * UNSEEN_WIDTH})["other"] == pytest.approx(0.0, abs=1e-6)


def test_a_model_comes_back_from_its_values() -> None:
    assert ProbabilityModel.of(MODEL.as_dict()) == MODEL
