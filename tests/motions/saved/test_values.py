"""Numbers, words and dataclasses as JSON: what comes back, and what is refused."""

import json
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np
import pytest

from go2_wbc.curves import Ease
from go2_wbc.errors import MotionFileError
from go2_wbc.legs import Leg
from motions.saved.values import Decoder, Encoder


@dataclass(frozen=True)
class Part:
    feet: Mapping[Leg, tuple[float, float, float]] = field(default_factory=dict)
    ease: Ease | None = None
    body: tuple[float, ...] = ()
    times: int = 1


@dataclass(frozen=True)
class Whole:
    parts: tuple[Part, ...]
    legs: frozenset[Leg]
    ease: Ease | Callable[[float], float] = Ease.CUBIC


WHOLE = Whole(
    (Part(), Part({Leg.RL: (0.1, 0.0, 1e-300)}, Ease.IN, (1.0, 2.0), 3)),
    frozenset({Leg.FR, Leg.FL}),
)


def test_nested_values_and_numbers_of_numpy_come_back() -> None:
    text = json.dumps(Encoder().encoded(WHOLE, "it"))
    assert Decoder().decoded(json.loads(text), Whole, "it") == WHOLE
    assert '"legs": ["FL", "FR"]' in text
    assert '"ease": "in"' in text
    assert Encoder().encoded((np.float64(0.5), np.int64(3)), "it") == [0.5, 3]


@pytest.mark.parametrize("value", [np.nan, np.inf, abs, {1, 2}, np.zeros(3), b"x", Part])
def test_what_json_has_no_word_for_is_refused(value: object) -> None:
    with pytest.raises(MotionFileError, match=r"it\[1\] is .* save the plan instead"):
        Encoder().encoded((1.0, value), "it")


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"ease": "springy"}, "unknown it.ease 'springy'; valid: cubic"),
        ({"legs": ["XX"]}, r"unknown it.legs\[0\] 'XX'; valid: FL, FR, RL, RR"),
        ({"parts": [{"times": 1.5}]}, r"it.parts\[0\].times must be a whole number, got 1.5"),
        ({"parts": [{"feet": {"FL": [0, 1]}}]}, r"it.parts\[0\].feet.FL must be 3 values, got 2"),
        ({"parts": [{"body": {}}]}, r"it.parts\[0\].body must be a list"),
        ({"parts": None}, "it.parts must be a list, got None"),
        ({"part": []}, "unknown field 'part'; valid: ease, legs, parts"),
    ],
)
def test_what_does_not_fit_is_named(change: dict[str, Any], message: str) -> None:
    fields = {**Encoder().encoded(WHOLE, "it"), **change}
    with pytest.raises(MotionFileError, match=message):
        Decoder().decoded(fields, Whole, "it")
