"""Finished trials on disk: an interrupted run can be resumed, with nothing measured twice.

The trials of a study are the rows of a sweep, in a file of its own that ``controller.read_sweep``
reads: a column for each metric, and in words why one has no value.
"""

import hashlib
import json
import math
from collections.abc import Iterable, Iterator
from contextlib import ExitStack, contextmanager
from dataclasses import asdict, dataclass
from pathlib import Path

from benchmarks.study import Study, TrialResult
from controller.sweeps.run import remove_sweep
from controller.sweeps.sweep_file import SEED, Row, SweepFile
from controller.sweeps.targets import SOURCES, identity
from go2_wbc.config import Config
from go2_wbc.errors import ConfigError

ROOT = Path(__file__).resolve().parent.parent
FOLDER = Path("out/benchmarks")  #: Where finished trials are kept, in a folder for each benchmark
_WORDS = ("failures", "notes")  #: Of a trial, by row


def settings_header() -> dict[str, str]:
    """What trials depend on besides study and seed; resumed is only what agrees."""
    settings = hashlib.sha256(repr(asdict(Config())).encode()).hexdigest()[:12]
    return {**identity(ROOT, (*SOURCES, "benchmarks")), "settings": settings}


@dataclass(frozen=True, slots=True)
class Store:
    """The finished trials of studies."""

    finished: dict[tuple[str, int], TrialResult]
    """Trials of the run that is resumed, by study and seed."""
    files: dict[str, SweepFile]  #: by study

    def add(self, study: Study, seed: int, result: TrialResult) -> None:
        """Keep a trial, all of it or nothing, as the row of a sweep; nan is no value."""
        values = {m.name: float(result.values.get(m.name, math.nan)) for m in study.metrics}
        words = {name: json.dumps(getattr(result, name)) for name in _WORDS}
        self.files[study.name].add(seed, {**values, "reason": result.reason, **words})


@contextmanager
def opened(folder: Path, studies: Iterable[Study], *, resume: bool) -> Iterator[Store]:
    """Begin anew, or go on with what is there.

    Raises:
        ConfigError: if a file cannot be written, is not such a file, or holds trials under other
            settings.
    """
    store, header = Store({}, {}), settings_header()
    with ExitStack() as exits:
        for study in studies:
            file = file_of(folder, study)
            file.parent.mkdir(parents=True, exist_ok=True)
            if not resume:
                remove_sweep(file)
            try:
                rows = exits.enter_context(SweepFile(file, {"what": study.name, **header}))
            except ConfigError as error:
                hint = "; run without --resume to begin anew" if resume else ""
                raise ConfigError(f"{error}{hint}") from error
            store.files[study.name] = rows
            trials = {(study.name, int(row[SEED])): result_of(study, row) for row in rows.rows()}
            store.finished.update(trials)
        yield store


def file_of(folder: Path, study: Study) -> Path:
    """Where the trials of a study are kept."""
    return folder / f"{study.name.replace(', ', '-').replace(' ', '_')}.sqlite"


def result_of(study: Study, row: Row) -> TrialResult:
    """The trial that a row keeps."""
    values = {m.name: float(row[m.name]) for m in study.metrics}
    words = {name: json.loads(str(row[name])) for name in _WORDS}
    known = {name: value for name, value in values.items() if not math.isnan(value)}
    return TrialResult(known, reason=str(row["reason"]), **words)
