"""Finished trials on disk: an interrupted run can be resumed, with nothing measured twice.

A file of JSON lines. The first says what the results depend on; each other one is the measurement
of one (scenario, seed), appended in one write as soon as it is there.
"""

from __future__ import annotations

import hashlib
import json
import os
from collections.abc import Mapping
from dataclasses import asdict
from pathlib import Path
from typing import Any, NoReturn

from benchmarks.scenario import Measurement
from controller.sweeps.identity import SOURCES, identity
from go2_wbc.config import Config
from go2_wbc.errors import ConfigError
from go2_wbc.files import checked_output, write_atomically

ROOT = Path(__file__).resolve().parent.parent


def settings_header() -> dict[str, str]:
    """What the results depend on besides scenario and seed; resumed is only what agrees."""
    settings = hashlib.sha256(repr(Config()).encode()).hexdigest()[:12]
    return {**identity(ROOT, (*SOURCES, "benchmarks")), "settings": settings}


class ResultsLog:
    """The file of one benchmark's results.

    Attributes:
        finished: measurements of the run that is resumed, by scenario and seed.
        remark: what a person should know of the file that was read; or empty.
    """

    def __init__(self, path: Path, *, resume: bool) -> None:
        """Begin a new file, or go on with the one that is there.

        Raises:
            ConfigError: if the file cannot be written, is not such a file, or holds results under
                other settings.
        """
        self._path = checked_output(path, (".jsonl",))
        self.finished: dict[tuple[str, int], Measurement] = {}
        self.remark = ""
        header = settings_header()
        if resume and path.exists():
            self._read(header)
        else:
            write_atomically(self._path, _line(header))

    def append(self, scenario: str, seed: int, measurement: Measurement) -> None:
        """Keep a result; whoever kills the process leaves a whole line or a damaged last one."""
        with self._path.open("ab", buffering=0) as file:
            file.write(_line({"scenario": scenario, "seed": seed, **asdict(measurement)}))

    def _read(self, header: dict[str, str]) -> None:
        text = self._path.read_bytes()
        whole, _, damaged = text.rpartition(b"\n")
        rows = []
        for number, line in enumerate(whole.splitlines(), 1):
            try:
                rows.append(dict(json.loads(line)))
            except (ValueError, TypeError) as error:
                self._refuse(f"line {number} is damaged", error)
        found = rows[0] if rows else self._refuse("no results are in it")
        other = [
            f"{key} {found.get(key)}, now {header[key]}"
            for key in header
            if found.get(key) != header[key]
        ]
        if other:
            self._refuse(f"holds results under other settings ({'; '.join(other)})")
        for row in rows[1:]:
            key = (row.pop("scenario"), row.pop("seed"))
            self.finished[key] = Measurement(**row)
        self.remark = f"{len(self.finished)} finished trials are taken from {self._path}"
        if damaged:
            self.remark += "; its damaged last line is ignored"
            os.truncate(self._path, len(text) - len(damaged))

    def _refuse(self, why: str, cause: Exception | None = None) -> NoReturn:
        raise ConfigError(f"{self._path}: {why}; run without --resume to begin anew") from cause


def _line(values: Mapping[str, Any]) -> bytes:
    return (json.dumps(values) + "\n").encode()  # nan and infinity as Python writes and reads them
