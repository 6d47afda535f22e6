"""``python -m benchmarks golden``: does the robot do what it did, to the last bit?

``record`` before a change that shall not change behaviour, ``compare`` after it. Of every control
tick a digest of what each stage made is kept, and of some the numbers, so that a difference can be
told. Records hold for the machine that made them: another processor may round in another way.
"""

from __future__ import annotations

import logging
import zipfile
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import ProcessPoolExecutor, as_completed
from dataclasses import dataclass, fields
from functools import partial
from multiprocessing import get_context
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Annotated, Any
from unittest.mock import patch

import numpy as np
from jaxtyping import Float, Int, UInt64

from benchmarks.command import positive
from benchmarks.golden_runs import KEPT_EVERY, RUNS, STAGES, Ledger, Values
from controller.cli.common import ExitCode, ProgressLine
from go2_wbc.errors import CommandError, ConfigError, unknown_name

RECORD, COMPARE = "record", "compare"


@dataclass(frozen=True, slots=True)
class Stored:
    """A recorded run."""

    digests: UInt64[np.ndarray, "ticks stages"]  #: of each tick, by stage
    sizes: Int[np.ndarray, "kept stages"]  #: of each kept tick, how many numbers each stage has
    numbers: Float[np.ndarray, " n"]  #: of the kept ticks, one stage after the other
    lines: list[str]  #: what came of its calls

    @staticmethod
    def of(ledger: Ledger) -> Stored:
        """What ``ledger`` holds, as arrays."""
        ticks = [[_row(values) for values in tick] for tick in ledger.kept]
        sizes = np.array([[len(row) for row in tick] for tick in ticks], dtype=np.int64)
        numbers = np.concatenate([row for tick in ticks for row in tick])
        return Stored(np.array(ledger.digests, np.uint64), sizes, numbers, ledger.lines)

    def write(self, file: Path) -> None:
        """Write it."""
        arrays: dict[str, Any] = {f.name: np.array(getattr(self, f.name)) for f in fields(self)}
        np.savez_compressed(file, **arrays)

    @staticmethod
    def read(file: Path) -> Stored:
        """Read it.

        Raises:
            ConfigError: if there is no such file, or it is damaged.
        """
        try:
            with np.load(file) as data:
                arrays = {name: data[name] for name in ("digests", "sizes", "numbers")}
                return Stored(**arrays, lines=data["lines"].tolist())
        except (OSError, ValueError, KeyError, zipfile.BadZipFile) as error:
            raise ConfigError(f"cannot read the golden run {file}: {error}") from error

    def row(self, kept: int, stage: int) -> Float[np.ndarray, " n"]:
        """The numbers of a stage of a kept tick."""
        ends = np.cumsum(self.sizes)
        cell = kept * self.sizes.shape[1] + stage
        return self.numbers[ends[cell] - self.sizes[kept, stage] : ends[cell]]


def _row(values: Values) -> Float[np.ndarray, " n"]:
    return np.concatenate([*values.values(), np.empty(0)])


def difference(stored: Stored, ledger: Ledger, tolerance: float) -> str | None:
    """How ``ledger`` differs from what was stored, in one line; None if it does not.

    With a ``tolerance`` a run is accepted whose numbers are as near as that in the first kept tick
    after the first difference: later ones grow, as the robot's feedback has them.
    """
    found = np.array(ledger.digests, np.uint64)
    common = min(len(found), len(stored.digests))
    differs = found[:common] != stored.digests[:common]
    if differs.any():
        tick, stage = (int(place[0]) for place in np.nonzero(differs))
        largest, told = _numbers(stored, ledger, -(-tick // KEPT_EVERY), stage)
        if largest <= tolerance and tolerance > 0.0:
            return None
        return f"differs from tick {tick} on, first in the {list(STAGES)[stage]}: {told}"
    if len(found) != len(stored.digests):
        return f"has {len(found)} ticks instead of {len(stored.digests)}"
    for now, before in zip(ledger.lines, stored.lines, strict=False):
        if now != before:
            return f"says {now!r} instead of {before!r}"
    return None if len(ledger.lines) == len(stored.lines) else "says more or less than before"


def _numbers(stored: Stored, ledger: Ledger, kept: int, stage: int) -> tuple[float, str]:
    """The largest difference in a kept tick, and what it is in ``stage``, or else in another."""
    if kept >= min(len(stored.sizes), len(ledger.kept)):
        return np.inf, "the run ends before its numbers are kept again"
    found = [_off(now, stored.row(kept, i)) for i, now in enumerate(ledger.kept[kept])]
    order = [found[stage], *found]
    told = next((told for largest, told in order if largest > 0.0), "equal again")
    return max(largest for largest, _ in found), f"{told} at tick {kept * KEPT_EVERY}"


def _off(now: Values, before: Float[np.ndarray, " n"]) -> tuple[float, str]:
    """The largest difference of one stage, and which number that is."""
    values = _row(now)
    if len(values) != len(before):
        return np.inf, f"{len(values)} numbers instead of {len(before)}"
    is_same = (values == before) | (np.isnan(values) & np.isnan(before))
    away = np.where(is_same, 0.0, np.nan_to_num(np.abs(values - before), nan=np.inf))
    if is_same.all():
        return 0.0, ""
    worst = int(np.argmax(away))
    names = [f"{name}[{i}]" for name, array in now.items() for i in range(len(array))]
    told = f"{names[worst]} by {away[worst]:.3g}, {values[worst]:.17g} for {before[worst]:.17g}"
    return float(away[worst]), told


def replay(name: str, folder: Path) -> Ledger:
    """Run it; dynamic plans are solved, not read from where they were kept."""
    ledger = Ledger(folder)
    with (
        TemporaryDirectory() as plans,
        patch("motions.dynamics.plan_cache.plan_folder", lambda: Path(plans)),
    ):
        RUNS[name](ledger)
    return ledger


def work_on(name: str, act: str, folder: Path, tolerance: float) -> str | None:
    """Run it and write it, or tell how it differs from what was written."""
    file = folder / f"{name}.npz"
    if act == COMPARE:
        return difference(Stored.read(file), replay(name, folder), tolerance)
    file.with_suffix(".npy").unlink(missing_ok=True)
    Stored.of(replay(name, folder)).write(file)
    return None


def results(
    work: Callable[[str], str | None], names: Sequence[str], workers: int
) -> Iterator[tuple[str, str | None]]:
    """What ``work`` gives for each run, as they end."""
    if workers == 1:
        yield from ((name, work(name)) for name in names)
        return
    with ProcessPoolExecutor(
        workers, get_context("spawn"), initializer=logging.disable, initargs=(logging.WARNING,)
    ) as pool:
        futures = {pool.submit(work, name): name for name in names}
        for future in as_completed(futures):
            yield futures[future], future.result()


def run(
    act: Annotated[str, "write the runs, or check them", (RECORD, COMPARE)],
    folder: Annotated[Path, "FOLDER", "where the runs are kept"],
    *,
    runs: Annotated[tuple[str, ...], "NAME", "some of them only"] = (),
    tolerance: Annotated[float, "X", "accept numbers as near as this"] = 0.0,
    workers: Annotated[int, "N", "processes, default %(default)s", positive] = 2,
) -> int:
    """Does the robot do what it did, to the last bit?

    Record runs before a change and compare them after it: the first tick and stage that differ are
    told. Exit code 0 if every run is equal, 1 if one is not. Records hold for this machine alone.

    Examples:
    python -m benchmarks golden record out/golden
    python -m benchmarks golden compare out/golden
    python -m benchmarks golden compare out/golden --runs trot-imu boxes
    python -m benchmarks golden compare out/golden --tolerance 1e-9
    """
    names = runs or tuple(RUNS)
    for name in names:
        if name not in RUNS:
            raise CommandError(unknown_name("run", name, RUNS))
    if act == RECORD:
        try:
            folder.mkdir(parents=True, exist_ok=True)
        except OSError as error:
            raise ConfigError(f"cannot make {folder}: {error.strerror}") from error
    work = partial(work_on, act=act, folder=folder, tolerance=tolerance)
    is_equal, good = True, "recorded" if act == RECORD else "equal"
    with ProgressLine() as line:
        line.update(0.0, act)
        for number, (name, told) in enumerate(results(work, names, workers), 1):
            is_equal &= told is None
            line.update(number / len(names), name)
            print(f"{name:<16}{told or good}", flush=True)
    return ExitCode.OK if is_equal else ExitCode.FAILED
