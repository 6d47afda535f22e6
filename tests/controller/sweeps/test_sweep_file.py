"""The file of a sweep: keeps every bit, once, and refuses what is something else."""

import itertools
import math
import sqlite3
import struct
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from controller.sweeps.sweep_file import SweepFile, columns_of, joined, row_of
from go2_wbc.errors import ConfigError, SweepError
from tests.controller.sweeps.swept import ODD

ABOUT = {"what": "it", "code": "abc"}
ROW = {"x": 0.5, "ok": True, "word": "ü", "n": -3}


@pytest.fixture
def file(tmp_path: Path) -> Path:
    """Two rows and a failure."""
    file = tmp_path / "rows.sqlite"
    with SweepFile(file, ABOUT) as rows:
        rows.add(7, ROW)
        rows.add(2, ROW)
        rows.add_failure(3, "it fell")
    return file


def bits(value: float) -> bytes:
    return struct.pack("<d", value)


def test_floats_come_back_bit_by_bit(tmp_path: Path) -> None:
    with SweepFile(tmp_path / "odd.sqlite", ABOUT) as rows:
        for seed, value in enumerate(ODD):
            rows.add(seed, {"value": value, "minus": -value})
    with SweepFile(tmp_path / "odd.sqlite") as rows:
        found = rows.rows()
    for row, value in zip(found, ODD, strict=True):
        if math.isnan(value):
            assert math.isnan(float(row["value"]))
        else:
            assert bits(float(row["value"])) == bits(value)
            assert bits(float(row["minus"])) == bits(-value)


def test_rows_come_back_by_seed_with_their_kinds_and_are_kept_once(file: Path) -> None:
    with SweepFile(file, ABOUT) as rows:
        assert rows.rows() == [{"seed": 2, **ROW}, {"seed": 7, **ROW}]
        assert rows.rows([7]) == [{"seed": 7, **ROW}]
        assert rows.columns == {"x": "float", "ok": "bool", "word": "str", "n": "int"}
        assert rows.rows()[0]["ok"] is True
        assert rows.finished == {2, 7}
        assert rows.failures == {3: "it fell"}
        assert rows.about == ABOUT
    with SweepFile(file, ABOUT) as rows:
        rows.add(7, {**ROW, "x": 99.0})
        rows.add(3, ROW)
        assert [row["x"] for row in rows.rows()] == [0.5, 0.5, 0.5]
        assert rows.failures == {}


def test_the_order_in_which_rows_end_does_not_change_what_is_read(tmp_path: Path) -> None:
    given = {0: {"a": 1}, 1: {"a": 0.5}, 2: {"a": 3}}
    read = []
    for name, order in (("up", (0, 1, 2)), ("down", (2, 1, 0))):
        with SweepFile(tmp_path / f"{name}.sqlite", ABOUT) as rows:
            for seed in order:
                rows.add(seed, given[seed])
            read.append([(type(row["a"]), row["a"]) for row in rows.rows()])
    assert read[0] == read[1] == [(float, 1.0), (float, 0.5), (float, 3.0)]


def test_names_of_columns_may_be_anything(tmp_path: Path) -> None:
    row = {'a "b"': 1.0, "select": 2.0, "x; drop table rows": 3.0}
    with SweepFile(tmp_path / "names.db", ABOUT) as rows:
        rows.add(0, row)
        assert rows.rows() == [{"seed": 0, **row}]


def test_a_row_of_another_kind_is_refused_and_changes_nothing(file: Path) -> None:
    with SweepFile(file, ABOUT) as rows:
        with pytest.raises(SweepError, match="not in all: n"):
            rows.add(9, {"x": 0.5, "ok": True, "word": "ü"})
        rows.add(9, ROW)
        assert rows.finished == {2, 7, 9}


@pytest.mark.parametrize(
    ("spoil", "message"),
    [
        (lambda base: base.execute("PRAGMA user_version = 2"), "version 2, this program knows"),
        (lambda base: base.execute("PRAGMA application_id = 5"), "is no database of a sweep"),
        (lambda base: base.execute("UPDATE about SET value = 'def'"), "code def, now abc; what"),
    ],
)
def test_what_holds_something_else_is_refused_and_untouched(
    file: Path, spoil: Callable[[sqlite3.Connection], object], message: str
) -> None:
    base = sqlite3.connect(file)
    spoil(base)
    base.commit()
    base.close()
    before = file.read_bytes()
    with pytest.raises(ConfigError, match=message):
        SweepFile(file, ABOUT)
    assert file.read_bytes() == before


def test_what_is_no_database_or_not_there_is_refused_and_untouched(tmp_path: Path) -> None:
    file = tmp_path / "letter.db"
    file.write_text("Dear reader, " * 100)
    with pytest.raises(ConfigError, match="is no database of a sweep"):
        SweepFile(file, ABOUT)
    assert file.read_text().startswith("Dear reader")
    with pytest.raises(ConfigError, match="there is no file"):
        SweepFile(tmp_path / "none.sqlite")
    with pytest.raises(ConfigError, match=r"valid: \.sqlite, \.db"):
        SweepFile(tmp_path / "rows.txt", ABOUT)


def test_a_full_disk_is_told_and_keeps_what_is_finished(tmp_path: Path) -> None:
    """SQLite's own limit of pages says the same as a disk without space."""
    file = tmp_path / "full.sqlite"
    seeds = itertools.count()

    def fill(rows: SweepFile) -> None:
        for seed in seeds:
            rows.add(seed, {"text": "x" * 3000})

    with SweepFile(file, ABOUT) as rows:
        rows._base.execute("PRAGMA max_page_count = 12")
        with pytest.raises(SweepError, match=r"full\.sqlite: the disk is full"):
            fill(rows)
    lost = next(seeds) - 1
    assert lost > 1
    with SweepFile(file, ABOUT) as rows:
        assert rows.finished == set(range(lost))
        rows.add(lost, {"text": "again"})
        assert len(rows.rows()) == lost + 1


def test_what_was_killed_while_it_began_is_begun_again(tmp_path: Path) -> None:
    (tmp_path / "empty.sqlite").touch()
    with SweepFile(tmp_path / "empty.sqlite", ABOUT) as rows:
        rows.add(0, ROW)
        assert rows.finished == {0}


def test_numbers_and_words_become_those_of_python() -> None:
    given = {"a": np.float64(0.1), "b": np.float32(0.1), "c": np.int16(3), "d": np.bool_(True)}
    row = row_of(given)
    assert row == {"a": 0.1, "b": float(np.float32(0.1)), "c": 3, "d": True}
    assert columns_of(row) == {"a": "float", "b": "float", "c": "int", "d": "bool"}
    assert row_of({"a": "x\ud800"}) == {"a": "x?"}
    whole, other = {"a": 1}, {"a": math.pi}
    assert joined(columns_of(whole), other) == joined(columns_of(other), whole) == {"a": "float"}


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


@pytest.mark.parametrize(
    ("row", "message"),
    [({"b": 1.0}, "not in all: a, b"), ({"a": True}, "float and bool"), ({"a": "1"}, "and str")],
)
def test_a_row_that_does_not_fit_the_others_is_refused(row: dict, message: str) -> None:
    with pytest.raises(SweepError, match=message):
        joined({"a": "float"}, row)
