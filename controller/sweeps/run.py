"""``sweep``: a function of a seed over many seeds, in many processes, its rows kept as they end."""

from __future__ import annotations

import csv
import io
import math
import re
import time
from collections.abc import Callable, Mapping, Sequence
from contextlib import closing
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from controller.sweeps.engine import Engine, Failure, LocalEngine, processors
from controller.sweeps.sweep_file import SEED, Columns, Row, SweepFile
from controller.sweeps.targets import digest, identity, target_of
from go2_wbc.arguments import typed
from go2_wbc.brief import brief, inline_html
from go2_wbc.errors import CommandError, SweepError, needing, unknown_name
from go2_wbc.files import checked_output, write_atomically

FOLDER = Path("out/sweeps")  #: Where rows are kept if nothing else is said
ENGINES = ("local", "ray")


@dataclass(frozen=True, slots=True)
class Progress:
    """How far a sweep has come."""

    done: int  #: seeds that have ended, those of earlier runs among them
    total: int  #: seeds that were asked for
    rate: float  #: seeds a second, in this run
    failure: Failure | None = None  #: why the seed that ended last has no row, or None
    seed: int | None = None  #: that one; None before any has ended
    row: Row | None = None  #: what it gave, or None

    @property
    def share(self) -> float:
        """What is done, 0 to 1."""
        return self.done / self.total

    @property
    def remaining(self) -> float:
        """Time [s] that the rest will take at this rate; infinite before the first seed."""
        return (self.total - self.done) / self.rate if self.rate else math.inf


@dataclass(frozen=True, slots=True)
class SweepResult:
    """The rows of a sweep."""

    path: Path  #: of the file that keeps them
    name: str  #: of what was swept
    columns: Columns  #: names and kinds of the values
    rows: list[Row]  #: in the order of their seeds, which are the first value of each
    failures: dict[int, str]  #: why seeds gave no row
    about: dict[str, str]  #: what the rows depend on, by name: versions, digests

    _repr_html_ = inline_html
    __repr__ = brief


@typed(error=CommandError)
def sweep(
    what: object,
    n: int = 1000,
    *,
    first_seed: int = 0,
    workers: int | None = None,
    engine: str = "local",
    address: str | None = None,
    out: Path | str | None = None,
    fresh: bool = False,
    keep_going: bool = False,
    is_enough: Callable[[Sequence[Row]], bool] | None = None,
    on_progress: Callable[[Progress], None] = lambda progress: None,
) -> SweepResult:
    """Run ``what`` over ``n`` seeds, each in a worker process, and keep every row at once.

    A sweep that was interrupted, however that came, goes on where it ended: call it again. The rows
    depend on the seeds only: not on the number and kind of workers, on one kind of processor.

    Args:
        what: a function ``(seed) -> row`` of a module or file, where a row is a dict of floats,
            ints, bools and strings; a motion, as ``GO2Controller.play`` takes it; or a word as
            ``go2-wbc sweep`` takes it: ``"gait:trot@0.5"``, ``"push:12"``, ``"my.py:trial"``.
        n: how many seeds.
        first_seed: the first of them; the others follow.
        workers: processes at a time, each with one thread; by default as many as processors, and
            with Ray as many as its cluster has.
        engine: "local", or "ray" for more than one machine (needs the extra [cluster]).
        address: of the Ray cluster; by default the one in ``RAY_ADDRESS``, or one of this machine.
        out: file for the rows, ``.sqlite`` or ``.db``; by default in ``out/sweeps``.
        fresh: begin anew instead of going on.
        keep_going: let a seed that fails cost no other one its run; its reason is kept.
        is_enough: is asked with the rows of the first seeds, without a gap, and ends the sweep when
            it says so; rows beyond, if workers were ahead, are kept.
        on_progress: is told after every seed.

    Raises:
        CommandError: for an argument that is not valid.
        ConfigError: for a file that cannot be used, or holds rows that depend on something else.
        MissingDependency: for Ray if it is not installed.
        SweepError: if a seed fails, without ``keep_going``, or the engine or the disk does. What
            is finished is kept.
    """
    _require_count("n", n, least=1)
    _require_count("first_seed", first_seed, least=0)
    runner = engine_of(engine, workers, address)
    target = target_of(what)
    slug = re.sub(r"[^\w.@+-]+", "_", Path(target.name).name).strip("._") or "sweep"
    file = FOLDER / f"{slug}.sqlite" if out is None else Path(out)
    if fresh:
        remove_sweep(file)
    seeds, first, start = range(first_seed, first_seed + n), list[Row](), time.monotonic()
    with SweepFile(file, {"what": target.name, **target.about, **identity()}) as rows:
        known = {int(row[SEED]): row for row in rows.rows(seeds)}
        left = [seed for seed in seeds if seed not in known]
        are_enough = _are_enough(first, seeds, known, is_enough)
        on_progress(Progress(n - len(left), n, 0.0))
        with closing(runner.run(target.call, [] if are_enough else left)) as ends:
            for count, ended in enumerate(ends, 1):
                if ended.failure is None:
                    rows.add(ended.item, ended.value)
                    known[ended.item] = ended.value
                else:
                    rows.add_failure(ended.item, ended.failure.text)
                    if not keep_going:
                        raise SweepError(_told(ended.item, ended.failure, rows))
                rate = count / max(time.monotonic() - start, math.ulp(1.0))
                told = ended.failure, ended.item, ended.value
                on_progress(Progress(n - len(left) + count, n, rate, *told))
                if are_enough := _are_enough(first, seeds, known, is_enough):
                    break
        return _result(rows, seeds[: len(first)] if are_enough else seeds)


def _are_enough(
    first: list[Row],
    seeds: Sequence[int],
    known: Mapping[int, Row],
    is_enough: Callable[[Sequence[Row]], bool] | None,
) -> bool:
    """Whether the rows of the first seeds, as far as there is no gap, are enough.

    ``first`` are those that were not; it is added to, until they are.
    """
    for seed in seeds[len(first) :]:
        if is_enough is None or seed not in known:
            return False
        first.append(known[seed])
        if is_enough(first):
            return True
    return False


def read_sweep(path: Path | str) -> SweepResult:
    """What a file of a sweep holds.

    Raises:
        ConfigError: if there is no such file, or it is something else.
    """
    with SweepFile(path) as rows:
        return _result(rows, None)


def remove_sweep(path: Path | str) -> None:
    """Remove the file of a sweep and SQLite's logs beside it, if it is one.

    Raises:
        ConfigError: if it is something else.
    """
    file = Path(path).expanduser()
    if file.exists():
        SweepFile(file).close()
        for ending in ("", "-wal", "-shm"):
            Path(f"{file}{ending}").unlink(missing_ok=True)


def engine_of(name: str, workers: int | None, address: str | None = None) -> Engine:
    """The engine of that name.

    Raises:
        CommandError: for an unknown name, a number of workers that is not valid, or an address
            without Ray.
    """
    if workers is not None:
        _require_count("workers", workers, least=1)
    if name not in ENGINES:
        raise CommandError(unknown_name("engine", name, ENGINES))
    if name == "ray":
        from controller.sweeps.ray_engine import RayEngine

        return RayEngine(workers, address)
    if address is not None:
        raise CommandError("an address is that of a Ray cluster: choose the engine ray")
    return LocalEngine(workers or processors())


def _result(rows: SweepFile, seeds: Sequence[int] | None) -> SweepResult:
    wanted = None if seeds is None else frozenset(seeds)
    failures = {s: text for s, text in rows.failures.items() if wanted is None or s in wanted}
    name = str(rows.about.get("what", rows.path.stem))
    about = {
        key: digest(value) if isinstance(value, bytes) else value
        for key, value in rows.about.items()
    }
    return SweepResult(rows.path, name, rows.columns, rows.rows(wanted), failures, about)


def _told(seed: int, failure: Failure, rows: SweepFile) -> str:
    kept = f"{len(rows.finished)} finished rows are kept in {rows.path}"
    return "\n".join(filter(None, [f"seed {seed}: {failure.text}; {kept}", failure.details]))


def _require_count(name: str, value: object, *, least: int) -> None:
    if isinstance(value, bool) or not isinstance(value, int) or value < least:
        raise CommandError(f"{name} must be a whole number, at least {least}, got {value!r}")


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
        pyarrow_of("sweep")


def _csv(result: SweepResult) -> bytes:
    text = io.StringIO(newline="")
    table = csv.DictWriter(text, [SEED, *result.columns])
    table.writeheader()
    table.writerows(result.rows)  # a float as its shortest text, which reads back as it was
    return text.getvalue().encode()


def _parquet(result: SweepResult) -> bytes:
    pyarrow, parquet = pyarrow_of("sweep")
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


def pyarrow_of(extra: str) -> tuple[Any, Any]:
    """The modules pyarrow and pyarrow.parquet, which this extra brings."""
    with needing(extra, "Parquet needs pyarrow"):
        import pyarrow
        from pyarrow import parquet
    return pyarrow, parquet
