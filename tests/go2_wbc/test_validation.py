"""A number out of its range is refused with the class, the field, the rule and the number."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass

import pytest

from go2_wbc.errors import ConfigError
from go2_wbc.validation import (
    require_finite,
    require_not_negative,
    require_positive,
    require_share,
)


@dataclass(frozen=True, slots=True)
class Settings:
    value: object = 1.0
    other: object = 1.0


Check = Callable[..., None]
TINY = math.ulp(0.0)
ALLOWED: list[tuple[Check, list[object]]] = [
    (require_positive, [TINY, 1, 1e300]),
    (require_not_negative, [0, 0.0, TINY, 7.0]),
    (require_finite, [-1e300, 0.0, 3, (1.0, -2.0)]),
    (require_share, [TINY, 0.5, 1, 1.0]),
]
REFUSED: list[tuple[Check, str, list[object]]] = [
    (require_positive, "positive", [0.0, -0.0, -TINY, (1.0, 0.0)]),
    (require_not_negative, "at least 0", [-TINY, (-1.0, 1.0)]),
    (require_finite, "finite", []),
    (require_share, "above 0 and at most 1", [0.0, -0.5, math.nextafter(1.0, 2.0)]),
]
NO_NUMBERS: list[object] = [math.nan, math.inf, -math.inf, True, False, "1", None, (1.0, "2")]


@pytest.mark.parametrize(("check", "values"), ALLOWED)
def test_what_is_in_range_is_accepted(check: Check, values: list[object]) -> None:
    for value in values:
        check(Settings(value, value), "value", "other")


@pytest.mark.parametrize(("check", "rule", "values"), REFUSED)
def test_what_is_not_is_refused_by_name(check: Check, rule: str, values: list[object]) -> None:
    for value in [*values, *NO_NUMBERS]:
        with pytest.raises(ConfigError) as caught:
            check(Settings(other=value), "value", "other")
        assert str(caught.value) == f"Settings.other must be {rule}, got {value!r}"
