"""Rows: what a run with one seed gave, as named plain values, and the columns that they form."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from go2_wbc.errors import SweepError

Value = float | int | bool | str
Row = Mapping[str, Value]
"""What a function gives for a seed, by the names of the columns."""
Columns = dict[str, str]
"""The kind of every column, "float", "int", "bool" or "str", in the order of the first row."""

SEED = "seed"
"""The column that no function may give: it is there already."""
MOST_COLUMNS = 1000
"""As many columns as a table of SQLite holds, less some to spare."""
_WHOLE = range(-(2**63), 2**63)
"""Whole numbers that SQLite keeps."""


def row_of(given: object) -> Row:
    """``given`` as a row of plain values; numbers of NumPy become Python's, to the last bit.

    Raises:
        SweepError: if it is no mapping of names to numbers, truth values and texts.
    """
    if not isinstance(given, Mapping) or not given:
        raise SweepError(f"a swept function must return a dict of named values, got {given!r:.60}")
    if len(given) > MOST_COLUMNS:
        raise SweepError(f"a row has at most {MOST_COLUMNS} values, got {len(given)}")
    names = [name.lower() for name in given if isinstance(name, str) and name]
    if len(set(names)) < len(given):
        raise SweepError(f"names of values must differ in more than case, got {list(given)!r:.200}")
    if SEED in names:
        raise SweepError(f"a row has its {SEED} already: give that value another name")
    return {str(name): _plain(name, value) for name, value in given.items()}


def _plain(name: str, value: object) -> Value:
    plain = value.item() if isinstance(value, np.generic) else value
    if isinstance(plain, int) and plain not in _WHOLE:
        raise SweepError(f"{name} must be a whole number of at most 64 bits, got {plain}")
    if isinstance(plain, str) and not plain.isascii():
        plain = plain.encode("utf-8", "replace").decode()  # half of a surrogate pair is no text
    for kind in (bool, int, float, str):
        if type(plain) is kind:
            return plain
    raise SweepError(f"{name} must be a float, an int, a bool or a str, got {value!r:.60}")


def columns_of(row: Row) -> Columns:
    """The columns that a first row stands for."""
    return {name: type(value).__name__ for name, value in row.items()}


def joined(columns: Columns, row: Row) -> Columns:
    """The columns with one row more: whole numbers among others become floats.

    Raises:
        SweepError: if the row has other names, or a value of another kind.
    """
    if row.keys() != columns.keys():
        other = sorted(row.keys() ^ columns.keys())
        raise SweepError(f"every row must have the same names; not in all: {', '.join(other)}")
    kinds = columns_of(row)
    return {name: _common(name, kind, kinds[name]) for name, kind in columns.items()}


def _common(name: str, kind: str, other: str) -> str:
    if kind == other:
        return kind
    if {kind, other} == {"int", "float"}:
        return "float"
    raise SweepError(f"{name} must be of one kind in every row, got {kind} and {other}")
