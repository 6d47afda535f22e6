"""A row is plain values by name, and says so where it is not."""

import math

import numpy as np
import pytest

from controller.sweeps.sweep_file import columns_of, joined, row_of
from go2_wbc.errors import SweepError


def test_numbers_of_numpy_become_those_of_python_to_the_last_bit() -> None:
    given = {"a": np.float64(0.1), "b": np.float32(0.1), "c": np.int16(3), "d": np.bool_(True)}
    row = row_of(given)
    assert row == {"a": 0.1, "b": float(np.float32(0.1)), "c": 3, "d": True}
    assert columns_of(row) == {"a": "float", "b": "float", "c": "int", "d": "bool"}


@pytest.mark.parametrize(
    ("given", "message"),
    [
        ([1.0], "must return a dict"),
        (None, "must return a dict"),
        ({}, "must return a dict"),
        ({"a": None}, "a must be a float, an int, a bool or a str, got None"),
        ({"a": [1.0]}, "a must be a float"),
        ({"a": np.zeros(2)}, "a must be a float"),
        ({"a": 2**63}, "a must be a whole number of at most 64 bits"),
        ({"Seed": 1}, "has its seed already"),
        ({"a": 1, "A": 2}, "differ in more than case"),
        ({1: 1}, "names of values"),
        ({"": 1}, "names of values"),
        ({str(k): 1 for k in range(1001)}, "at most 1000 values, got 1001"),
    ],
)
def test_what_is_no_row_is_refused_with_what_is_wrong(given: object, message: str) -> None:
    with pytest.raises(SweepError, match=message):
        row_of(given)


def test_half_of_a_surrogate_pair_becomes_text() -> None:
    assert row_of({"a": "x\ud800"}) == {"a": "x?"}


def test_whole_numbers_among_others_become_floats_in_either_order() -> None:
    whole, other = {"a": 1}, {"a": math.pi}
    assert joined(columns_of(whole), other) == joined(columns_of(other), whole) == {"a": "float"}


@pytest.mark.parametrize(
    ("row", "message"),
    [({"b": 1.0}, "not in all: a, b"), ({"a": True}, "float and bool"), ({"a": "1"}, "and str")],
)
def test_a_row_that_does_not_fit_the_others_is_refused(row: dict, message: str) -> None:
    with pytest.raises(SweepError, match=message):
        joined({"a": "float"}, row)
