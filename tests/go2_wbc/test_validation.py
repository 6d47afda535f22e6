"""A number out of its range is refused with the class, the field, the rule and the number."""

from __future__ import annotations

import math
from dataclasses import InitVar, dataclass, fields, replace
from typing import Any

import pytest

from go2_wbc.errors import ConfigError
from go2_wbc.validation import (
    FINITE,
    LARGEST,
    NOT_NEGATIVE,
    POSITIVE,
    SHARE,
    Retired,
    Rule,
    between,
    ranged,
    require,
    retires,
)


@dataclass(frozen=True, slots=True)
class Settings:
    value: object = 1.0
    other: object = 1.0


@dataclass(frozen=True, slots=True)
@retires(old=True, tolerance=1e-3, solver=Retired("qp", "there is one solver"))
@ranged(POSITIVE, share=SHARE, count=NOT_NEGATIVE, friction=SHARE)
class Planner:
    height: float
    count: int = 0
    share: float = 0.5
    old: InitVar[bool] = True
    angles: tuple[float, float] = (0.1, 0.2)
    friction: float | None = None
    name: str = "walk"
    inner: Settings | None = None

    def __post_init__(self, old: bool) -> None:
        if self.share > self.height:
            raise ConfigError(f"share above height, {old=}")


TINY = math.ulp(0.0)
ALLOWED: list[tuple[Rule, list[object]]] = [
    (POSITIVE, [TINY, 1, LARGEST]),
    (NOT_NEGATIVE, [0, 0.0, TINY, 7.0]),
    (FINITE, [-LARGEST, 0.0, 3, (1.0, -2.0)]),
    (SHARE, [TINY, 0.5, 1, 1.0]),
    (between(-1.0, 2.0), [-1.0, 0, 2.0]),
]
REFUSED: list[tuple[Rule, str, list[object]]] = [
    (POSITIVE, "positive", [0.0, -0.0, -TINY, (1.0, 0.0)]),
    (NOT_NEGATIVE, "at least 0", [-TINY, (-1.0, 1.0)]),
    (FINITE, "finite", []),
    (SHARE, "above 0 and at most 1", [0.0, -0.5, math.nextafter(1.0, 2.0)]),
    (between(-1.0, 2.0), "between -1 and 2", [-1.1, (0.0, 2.1)]),
]
NO_NUMBERS: list[object] = [math.nan, math.inf, -math.inf, True, False, "1", None, (1.0, "2")]


@pytest.mark.parametrize(("rule", "values"), ALLOWED)
def test_what_is_in_range_is_accepted(rule: Rule, values: list[object]) -> None:
    for value in values:
        require(Settings(value, value), rule, "value", "other")


@pytest.mark.parametrize("rule", [POSITIVE, NOT_NEGATIVE, FINITE])
def test_no_number_is_larger_than_any_of_a_robot(rule: Rule) -> None:
    with pytest.raises(ConfigError, match=r"Settings.value must be 1e\+09 at most, got 11"):
        require(Settings(1.1 * LARGEST, 0.0), rule, "value")


@pytest.mark.parametrize(("rule", "what", "values"), REFUSED)
def test_what_is_not_is_refused_by_name(rule: Rule, what: str, values: list[object]) -> None:
    for value in [*values, *NO_NUMBERS]:
        with pytest.raises(ConfigError) as caught:
            require(Settings(other=value), rule, "value", "other")
        assert str(caught.value) == f"Settings.other must be {what}, got {value!r}"


@pytest.mark.parametrize(
    ("values", "message"),
    [
        ({"height": 0.0}, "Planner.height must be positive, got 0.0"),
        ({"height": "low"}, "Planner.height must be positive, got 'low'"),
        ({"height": 1.0, "count": -1}, "Planner.count must be at least 0, got -1"),
        ({"height": 1.0, "share": 0.0}, "Planner.share must be above 0 and at most 1, got 0.0"),
        ({"height": 1.0, "angles": (1.0, -1.0)}, r"Planner.angles must be positive, got \(1.0"),
        ({"height": 1.0, "friction": 2.0}, "Planner.friction must be above 0 and at most 1"),
        ({"height": 0.3, "share": 0.5}, "share above height, old=True"),
    ],
)
def test_a_table_above_a_class_holds_for_every_number_of_it(
    values: dict[str, Any], message: str
) -> None:
    assert Planner(1.0, 0, 1, True, (TINY, 1), 1, "", Settings("?")).share == 1
    with pytest.raises(ConfigError, match=message):
        Planner(**values)


def test_what_is_retired_is_no_field_and_may_be_given_and_read() -> None:
    planner = Planner(1.0)
    assert {"tolerance", "solver"}.isdisjoint(item.name for item in fields(planner))
    values: dict[str, Any] = {"tolerance": 1e-3, "solver": "qp"}
    assert Planner(1.0, **values) == replace(planner, **values) == planner
    assert (getattr(planner, "tolerance"), getattr(planner, "solver")) == (1e-3, "qp")  # noqa: B009
    with pytest.raises(TypeError, match="positional"):
        Planner(*range(1, 9), 1e-3)  # type: ignore[arg-type]


@pytest.mark.parametrize(
    ("name", "message"),
    [
        ("tolerance", "Planner.tolerance has no effect any more: it is always 0.001"),
        ("solver", "Planner.solver has no effect any more: there is one solver"),
    ],
)
def test_who_asks_for_what_is_retired_is_told_where(name: str, message: str) -> None:
    values: dict[str, Any] = {name: "other"}
    with pytest.warns(FutureWarning, match=message):
        assert Planner(1.0, **values) == Planner(1.0)
