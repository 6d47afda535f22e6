"""Benchmarks under test run in this process and write where the test says."""

from collections.abc import Callable, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

from benchmarks import behaviour, command
from benchmarks.study import Study
from controller.sweeps.engine import Ended, Ends, Engine, Item

Only = Callable[[Study], None]


class Here(Engine):
    """Runs all in this process, where its function may be anything."""

    def run(self, function: Callable[[Item], Any], items: Sequence[Item]) -> Ends[Item]:
        yield from (Ended(item, function(item)) for item in items)


@pytest.fixture
def results_folder(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> Path:
    """Where the finished trials are kept during a test."""
    folder = tmp_path / "benchmarks"
    monkeypatch.setattr(command, "FOLDER", folder)
    return folder


@pytest.fixture
def only(monkeypatch: pytest.MonkeyPatch, results_folder: Path) -> Only:
    """Makes a study the only one of ``behaviour``, and runs it in this process."""

    def install(study: Study) -> None:
        monkeypatch.setattr(behaviour, "run", replace(behaviour.BENCHMARK, studies=(study,)).run)
        monkeypatch.setattr("controller.sweeps.run.LocalEngine", lambda _workers: Here())

    return install
