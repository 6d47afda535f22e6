"""Rows, and the file of a sweep: an SQLite database to which each row is added when it is finished.

A row is the result of a run with one seed, as named plain values.

Tables: ``about`` (what the rows depend on), ``columns`` (their names and kinds), ``rows`` and
``failures``, by seed. A row is one transaction in a write-ahead log: a killed process leaves whole
rows only. The columns of ``rows`` have no declared type, because one would turn -0.0 into 0.0; nan,
which SQLite does not have, is NULL.
"""

from __future__ import annotations

import math
import sqlite3
from collections.abc import Iterable, Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np

from go2_wbc.errors import ConfigError, SweepError
from go2_wbc.files import checked_output

Value = float | int | bool | str
Row = Mapping[str, Value]  #: What a function gives for a seed, by the names of the columns
Columns = dict[str, str]
"""The kind of every column, "float", "int", "bool" or "str", in the order of the first row."""

SEED = "seed"  #: The column that no function may give: it is there already
MOST_COLUMNS = 1000  #: As many columns as a table of SQLite holds, less some to spare
_WHOLE = range(-(2**63), 2**63)  #: Whole numbers that SQLite keeps


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


SUFFIXES = (".sqlite", ".db")
APPLICATION = 0x60277377  #: What SQLite's header says of whose file it is
FORMAT = 1  #: The version of these tables
PATIENCE = 60.0  #: Time [s] for which another process may keep the file to itself
_TABLES = (
    "CREATE TABLE IF NOT EXISTS about (name TEXT PRIMARY KEY, value) WITHOUT ROWID",
    "CREATE TABLE IF NOT EXISTS columns (place INTEGER PRIMARY KEY, name TEXT UNIQUE, kind TEXT)",
    "CREATE TABLE IF NOT EXISTS failures (seed INTEGER PRIMARY KEY, text TEXT)",
    f"PRAGMA application_id = {APPLICATION}",
    f"PRAGMA user_version = {FORMAT}",
)
_CAUSES = {
    sqlite3.SQLITE_FULL: "the disk is full; what is finished is kept: free some space and go on",
    sqlite3.SQLITE_IOERR: "the disk refuses; what is finished is kept: see to it and go on",
    sqlite3.SQLITE_NOTADB: "it is no database of a sweep: choose another file",
    sqlite3.SQLITE_CORRUPT: "it is damaged: choose another file",
    sqlite3.SQLITE_READONLY: "it cannot be written to: choose another file",
    sqlite3.SQLITE_BUSY: f"another process has kept it to itself for {PATIENCE:g} s",
}
About = Mapping[str, str | bytes]  #: What rows depend on besides the seed, by name


class SweepFile:
    """Rows and failures of a sweep, on disk. To be closed.

    Attributes:
        path: of the file.
        about: what its rows depend on.
    """

    def __init__(self, path: Path | str, about: About | None = None) -> None:
        """Open the file that is there, or begin a new one.

        Args:
            path: ends in ``.sqlite`` or ``.db``.
            about: what new rows depend on; None opens a file that must be there already.

        Raises:
            ConfigError: if there can be no such file, or it holds something else: rows that depend
                on something else, other tables, another program's data.
            SweepError: if the disk refuses.
        """
        self.path = Path(path).expanduser().absolute()
        if about is None and not self.path.is_file():
            raise ConfigError(f"there is no file {self.path}: `go2-wbc sweep` makes one")
        if about is not None:
            checked_output(self.path, SUFFIXES)
        with self._told():
            self._base = sqlite3.connect(self.path, timeout=PATIENCE, isolation_level=None)
        try:
            self.about = self._opened(about)
        except BaseException:
            self.close()
            raise

    def _opened(self, about: About | None) -> About:
        if not self._header("page_count") and about is not None:
            self._begin(about)
        self._require_format()
        self._all("PRAGMA journal_mode = WAL")
        self._all("PRAGMA synchronous = NORMAL")
        found: dict[str, str | bytes] = dict(self._all("SELECT * FROM about"))
        if about is not None and (other := _differences(found, about)):
            raise ConfigError(
                f"{self.path} holds rows that depend on something else ({'; '.join(other)}): "
                "choose another file, or begin anew with `--fresh` (`fresh=True`)"
            )
        return found

    def _begin(self, about: About) -> None:
        with self._told(), self._transaction():
            for statement in _TABLES:
                self._base.execute(statement)
            self._base.executemany("INSERT OR IGNORE INTO about VALUES (?, ?)", about.items())

    def _require_format(self) -> None:
        if self._header("application_id") != APPLICATION:
            raise ConfigError(f"{self.path} is no database of a sweep: choose another file")
        version = self._header("user_version")
        if version != FORMAT:
            raise ConfigError(
                f"{self.path} is of version {version}, this program knows version {FORMAT}: read "
                "it with the program that wrote it, or choose another file"
            )

    # --- writing --------------------------------------------------------------------------

    def add(self, seed: int, row: Row) -> None:
        """Keep a row, once; what failed with this seed before is forgotten.

        Raises:
            SweepError: if its columns are not those of the other rows, or the disk refuses.
        """
        with self._told(), self._transaction():
            columns = self.columns
            wanted = joined(columns, row) if columns else columns_of(row)
            if not columns:
                names = ", ".join(map(_quoted, row))
                self._base.execute(f"CREATE TABLE rows ({SEED} INTEGER PRIMARY KEY, {names})")
            if wanted != columns:
                places = [(place, *pair) for place, pair in enumerate(wanted.items())]
                self._base.executemany("INSERT OR REPLACE INTO columns VALUES (?, ?, ?)", places)
            names = ", ".join([SEED, *map(_quoted, wanted)])
            marks = ", ".join("?" * (1 + len(wanted)))
            values = [seed, *(row[name] for name in wanted)]
            self._base.execute(f"INSERT OR IGNORE INTO rows ({names}) VALUES ({marks})", values)
            self._base.execute("DELETE FROM failures WHERE seed = ?", [seed])

    def add_failure(self, seed: int, text: str) -> None:
        """Keep why a seed gave no row; it is tried again when the sweep goes on.

        Raises:
            SweepError: if the disk refuses.
        """
        self._all("INSERT OR REPLACE INTO failures VALUES (?, ?)", seed, text)

    # --- reading --------------------------------------------------------------------------

    @property
    def columns(self) -> Columns:
        """Names and kinds of the values; empty before the first row."""
        return dict(self._all("SELECT name, kind FROM columns ORDER BY place"))

    @property
    def finished(self) -> set[int]:
        """Seeds whose rows are there."""
        return (
            {seed for (seed,) in self._all(f"SELECT {SEED} FROM rows")} if self.columns else set()
        )

    @property
    def failures(self) -> dict[int, str]:
        """Why seeds gave no row."""
        return dict(self._all("SELECT seed, text FROM failures ORDER BY seed"))

    def rows(self, seeds: Iterable[int] | None = None) -> list[Row]:
        """The rows in the order of their seeds, which each has as its first value."""
        columns = {SEED: "int", **self.columns}
        if len(columns) == 1:
            return []
        wanted = None if seeds is None else frozenset(seeds)
        names = ", ".join(map(_quoted, columns))
        return [
            {name: _read(value, columns[name]) for name, value in zip(columns, row, strict=True)}
            for row in self._all(f"SELECT {names} FROM rows ORDER BY {SEED}")
            if wanted is None or row[0] in wanted
        ]

    def close(self) -> None:
        """Fold the log into the file and end; idempotent."""
        with self._told():
            self._base.close()

    def __enter__(self) -> SweepFile:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    # --- SQLite ---------------------------------------------------------------------------

    def _all(self, statement: str, *values: Value) -> list[Any]:
        """The rows that a statement gives."""
        with self._told():
            return self._base.execute(statement, values).fetchall()

    def _header(self, name: str) -> int:
        return self._all(f"PRAGMA {name}")[0][0]

    @contextmanager
    def _transaction(self) -> Iterator[None]:
        """All of it, or nothing."""
        self._base.execute("BEGIN IMMEDIATE")
        try:
            yield
            self._base.execute("COMMIT")
        except BaseException:
            if self._base.in_transaction:  # a full disk has rolled it back already
                self._base.execute("ROLLBACK")
            raise

    @contextmanager
    def _told(self) -> Iterator[None]:
        """SQLite's errors as ours."""
        try:
            yield
        except sqlite3.Error as error:
            code = getattr(error, "sqlite_errorcode", 0) & 0xFF  # the rest is the extended code
            why = _CAUSES.get(code, str(error))
            kind = ConfigError if code == sqlite3.SQLITE_NOTADB else SweepError
            raise kind(f"{self.path}: {why}") from error


def _differences(found: About, now: About) -> list[str]:
    """What is not the same, in words."""
    return [
        f"{name} {found.get(name)}, now {now.get(name)}"
        if isinstance(found.get(name), str) and isinstance(now.get(name), str)
        else f"another {name}"
        for name in sorted({*found, *now})
        if found.get(name) != now.get(name)
    ]


def _quoted(name: str) -> str:
    return '"' + name.replace('"', '""') + '"'


def _read(stored: Value | None, kind: str) -> Value:
    if stored is None:
        return math.nan
    if kind == "float":
        return float(stored)
    return bool(stored) if kind == "bool" else stored
