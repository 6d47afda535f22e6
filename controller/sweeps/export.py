"""The rows of a sweep for other tools: as CSV or Parquet."""

from __future__ import annotations

import csv
import io
from pathlib import Path
from typing import Any

from controller.sweeps.run import SweepResult
from controller.sweeps.sweep_file import SEED
from go2_wbc.errors import MissingDependency
from go2_wbc.extras import install_line
from go2_wbc.files import checked_output, write_atomically

EXPORT_SUFFIXES = (".csv", ".parquet")


def export_rows(result: SweepResult, path: Path | str) -> Path:
    """Write the rows to a ``.csv`` or ``.parquet`` file, in the order of their seeds.

    Both keep every number to the last bit. Parquet keeps the kinds of the columns, too.

    Returns:
        The absolute path.

    Raises:
        ConfigError: for a path that cannot be written, or another ending.
        MissingDependency: for Parquet without pyarrow.
    """
    target = checked_output(path, EXPORT_SUFFIXES)
    is_csv = target.suffix.lower() == ".csv"
    return write_atomically(target, _csv(result) if is_csv else _parquet(result))


def require_exporter(path: Path | str) -> None:
    """See that what an export needs is there, before the work begins; raises as ``export_rows``."""
    if checked_output(path, EXPORT_SUFFIXES).suffix.lower() == ".parquet":
        _pyarrow()


def _csv(result: SweepResult) -> bytes:
    text = io.StringIO(newline="")
    table = csv.DictWriter(text, [SEED, *result.columns])
    table.writeheader()
    table.writerows(result.rows)  # a float as its shortest text, which reads back as it was
    return text.getvalue().encode()


def _parquet(result: SweepResult) -> bytes:
    pyarrow, parquet = _pyarrow()
    kinds = {
        "float": pyarrow.float64(),
        "int": pyarrow.int64(),
        "bool": pyarrow.bool_(),
        "str": pyarrow.string(),
    }
    columns = {SEED: "int", **result.columns}
    schema = pyarrow.schema([(name, kinds[kind]) for name, kind in columns.items()])
    stream = io.BytesIO()
    parquet.write_table(pyarrow.Table.from_pylist(result.rows, schema=schema), stream)
    return stream.getvalue()


def _pyarrow() -> tuple[Any, Any]:
    try:
        import pyarrow
        from pyarrow import parquet
    except ImportError as error:
        line = install_line("sweep")
        raise MissingDependency(f"Parquet needs pyarrow ({error}): {line}") from error
    return pyarrow, parquet
