"""What an annotation takes, and what is said of what it does not."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import cast

import numpy as np
import pytest
from jaxtyping import Float, Int

from go2_wbc.arguments import typed
from go2_wbc.errors import CommandError, ConfigError
from go2_wbc.legs import Leg
from go2_wbc.validation import LARGEST

Three = Float[np.ndarray, "3"]
Rows = Float[np.ndarray, "n 3"]
Pair = tuple[float, int]


ARRAY, FINITE, WHOLE = (
    "an array of shape ",
    f"a finite number, {LARGEST:g} at most",
    "a whole number",
)
PATH = "a path that a file can have"


@pytest.mark.parametrize(
    ("kind", "good", "bad", "said"),
    [
        (float, [1, -LARGEST, np.float32(2.0)], [np.inf, np.nan, 1.01 * LARGEST, "1", 1j], FINITE),
        (int, [1, np.int64(3), 2**63 - 1, 1 - 2**63], [1.0, 2**63, -(2**63), "1"], WHOLE),
        (bool, [True, np.False_], [1, "yes"], "True or False"),
        (str, ["", "a"], [1, b"a"], "a text"),
        (float | None, [None, 2], ["2", np.nan], f"{FINITE} or None"),
        (int | float, [1, 2.5], ["2"], FINITE),
        (Path, ["a", Path("a"), "b/" + 255 * "a"], [1, 256 * "a", Path("a\0/b")], PATH),
        (Path | str, ["a"], [128 * "ä"], f"{PATH} or a text"),
        (Callable[[], None], [print], [1], "a function"),
        (Leg, [Leg.FL], ["FL"], "a Leg"),
        (Sequence[int], [[1], (1, 2), [], np.arange(2)], [[1.5], 1, "12"], f"a list, each {WHOLE}"),
        (tuple[str, ...], [("a",), ["a", "b"], ()], [("a", 1), "a"], "a list, each a text"),
        (Pair, [(1.5, 2), [1, 2]], [(1.5,), (1.5, 2, 3), (1, 1.5)], f"a list, each {FINITE}"),
        (Mapping[str, float], [{}, {"a": 1}], [{"a": "b"}, {1: 1.0}, ["a"]], "a mapping"),
        (Three, [[1, 2, 3], np.zeros(3), [True] * 3], [[1, 2], [[1, 2, 3]], "abc"], f"{ARRAY}(3)"),
        (Three, [], [[[1], [1, 2]]], f"{ARRAY}(3)"),
        (Rows, [np.zeros((0, 3)), np.ones((2, 3))], [np.zeros(3), np.zeros((3, 2))], ARRAY),
        (Int[np.ndarray, "..."], [[1, 2], [[1]]], [[1.5]], ARRAY),
        (object, [None, 1, "a"], [], ""),
    ],
    ids=str,
)
def test_an_annotation_takes_what_it_says_and_refuses_the_rest(
    kind: object, good: list[object], bad: list[object], said: str
) -> None:
    def call(value: object) -> object:
        return value

    call.__annotations__["value"] = kind
    checked = typed()(call)
    for value in good:
        assert checked(value) is value
    for value in bad:
        with pytest.raises(ConfigError) as told:
            checked(value)
        assert str(told.value).startswith(f"value must be {said}")
        assert str(told.value).endswith(f", got {value!r:.80}")


def test_only_the_parameters_that_are_named_are_checked_and_defaults_are_taken() -> None:
    @typed("a", error=CommandError)
    def call(a: int = cast(int, None), b: int = 0, *rest: int) -> tuple[object, ...]:
        return (a, b, *rest)

    assert call() == (None, 0)
    assert call(1, "b", "c") == (1, "b", "c")  # type: ignore[arg-type]
    with pytest.raises(CommandError, match="a must be a whole number, got 'b'"):
        call("b")  # type: ignore[arg-type]

    @typed()
    def several(*rest: int) -> int:
        return sum(rest)

    assert several(1, 2) == 3
    with pytest.raises(ConfigError, match=r"rest must be a whole number, got 2\.5"):
        several(1, 2.5)  # type: ignore[arg-type]
    with pytest.raises(TypeError):
        call(c=1)  # type: ignore[call-arg]


def test_a_late_check_says_why_a_call_has_failed_and_costs_nothing_else() -> None:
    @typed(late=True)
    def half(value: float) -> float:
        if value == 3.0:
            raise CommandError("not three")
        return value / 2 if value else value.imag + {}[0]

    assert half(True) == 0.5
    assert half(np.inf) == np.inf, "it has not failed"
    with pytest.raises(ConfigError, match=r"value must be a finite number.*got '1'"):
        half("1")  # type: ignore[arg-type]
    with pytest.raises(CommandError, match="not three"):
        half(3.0)
    with pytest.raises(KeyError):
        half(0.0)


def test_what_a_values_own_checks_say_comes_first() -> None:
    @typed()
    @dataclass(frozen=True)
    class Size:
        length: float

        def __post_init__(self) -> None:
            if self.length == "short":
                raise CommandError("short")

    assert Size(1.0).length == 1.0
    with pytest.raises(CommandError, match="short"):
        Size("short")  # type: ignore[arg-type]
    with pytest.raises(ConfigError, match="length must be a finite number"):
        Size("long")  # type: ignore[arg-type]
