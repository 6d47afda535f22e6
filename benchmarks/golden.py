"""``python -m benchmarks golden``: does the robot do what it did, to the last bit?

``record`` before a change that shall not change behaviour, ``compare`` after it. Of every control
tick a digest of what each stage made is kept, and of some the numbers, so that a difference can be
told. Records hold for the machine that made them: another processor may round in another way.
"""

import pickle
import zlib
from contextlib import closing
from functools import partial
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Annotated
from unittest.mock import patch

import numpy as np

from benchmarks.command import positive
from benchmarks.golden_runs import KEPT_EVERY, RUNS, STAGES, Ledger, Values
from controller.cli.common import ExitCode, ProgressLine
from controller.sweeps.engine import LocalEngine
from go2_wbc.errors import CommandError, ConfigError, unknown_name
from go2_wbc.files import checked_output

RECORD, COMPARE = "record", "compare"


def written(ledger: Ledger, file: Path) -> None:
    """Keep a run."""
    file.write_bytes(zlib.compress(pickle.dumps(ledger), 1))


def read(file: Path) -> Ledger:
    """A run that was kept; only of files that ``record`` wrote on this machine.

    Raises:
        ConfigError: if there is no such file, or it is damaged.
    """
    try:
        return pickle.loads(zlib.decompress(file.read_bytes()))
    except (OSError, zlib.error, pickle.UnpicklingError, AttributeError) as error:
        raise ConfigError(f"cannot read the golden run {file}: {error}") from error


def difference(stored: Ledger, ledger: Ledger, tolerance: float) -> str | None:
    """How ``ledger`` differs from what was stored, in one line; None if it does not.

    With a ``tolerance`` a run is accepted whose numbers are as near as that in the first kept tick
    after the first difference: later ones grow, as the robot's feedback has them.
    """
    found, before = (np.array(one.digests, np.uint64) for one in (ledger, stored))
    common = min(len(found), len(before))
    differs = found[:common] != before[:common]
    if differs.any():
        tick, stage = (int(place[0]) for place in np.nonzero(differs))
        largest, told = _numbers(stored, ledger, -(-tick // KEPT_EVERY), stage)
        if largest <= tolerance and tolerance > 0.0:
            return None
        return f"differs from tick {tick} on, first in the {list(STAGES)[stage]}: {told}"
    if len(found) != len(before):
        return f"has {len(found)} ticks instead of {len(before)}"
    for now, then in zip(ledger.lines, stored.lines, strict=False):
        if now != then:
            return f"says {now!r} instead of {then!r}"
    return None if len(ledger.lines) == len(stored.lines) else "says more or less than before"


def _numbers(stored: Ledger, ledger: Ledger, kept: int, stage: int) -> tuple[float, str]:
    """The largest difference in a kept tick, and what it is in ``stage``, or else in another."""
    if kept >= min(len(stored.kept), len(ledger.kept)):
        return np.inf, "the run ends before its numbers are kept again"
    found = [_off(*pair) for pair in zip(ledger.kept[kept], stored.kept[kept], strict=True)]
    order = [found[stage], *found]
    told = next((told for largest, told in order if largest > 0.0), "equal again")
    return max(largest for largest, _ in found), f"{told} at tick {kept * KEPT_EVERY}"


def _off(now: Values, then: Values) -> tuple[float, str]:
    """The largest difference of one stage, and which number that is."""
    values, before = (np.concatenate([*one.values(), np.empty(0)]) for one in (now, then))
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
    files = {name: folder / f"{name}.pickle" for name in names}
    before = {name: read(file) for name, file in files.items()} if act == COMPARE else {}
    if act == RECORD:
        for file in files.values():
            checked_output(file, (file.suffix,)).with_suffix(".npy").unlink(missing_ok=True)
    is_equal, good = True, "recorded" if act == RECORD else "equal"
    ends = LocalEngine(workers).run(partial(replay, folder=folder), names)
    with ProgressLine() as line, closing(ends):
        line.update(0.0, act)
        for number, ended in enumerate(ends, 1):
            if ended.failure is not None:
                raise RuntimeError(f"{ended.item}: {ended.failure.text}\n{ended.failure.details}")
            if act == RECORD:
                written(ended.value, files[ended.item])
            told = difference(before[ended.item], ended.value, tolerance) if before else None
            is_equal &= told is None
            line.update(number / len(names), ended.item)
            print(f"{ended.item:<16}{told or good}", flush=True)
    return ExitCode.OK if is_equal else ExitCode.FAILED
